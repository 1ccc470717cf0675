/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * model_yaml.h — the model file from inside: what the files of this folder share of reading and writing it.
 *
 *   text --yaml_parse--> tree with positions --model_from_yaml--> struct model
 *   struct model --model_to_text--> canonical text (a new file, and the measure of equality of two models)
 *   text + struct model --model_edit_text--> the same text with the values that differ replaced in place
 *
 * Saving edits the original text at the byte positions of the tree, so comments, order and unknown keys survive.
 */
#ifndef BEAMFIT_MODEL_YAML_H
#define BEAMFIT_MODEL_YAML_H

#include <stdio.h>
#include "model.h"
#include "model_yaml_text.h"
#include "ground/ground.h"

/* TREE — of the file, with the place of every node (model_yaml.c, the only file that sees libfyaml). */

enum { YAML_BYTES = 1 << 20, YAML_NODES = 50000, YAML_DEPTH = 16 };

enum yaml_kind { YAML_SCALAR, YAML_SEQUENCE, YAML_MAPPING };

struct yaml_node {
    enum yaml_kind kind;
    bool plain;               /* a scalar without quotes (numbers, true, false, nothing) */
    bool flow;                /* a collection in brackets */
    size_t from, to;          /* bytes of the text, quotes and brackets included; blocks: first to last child */
    long line, column;        /* of the start; lines from 1, columns from 0 */
    char *text;               /* of a scalar; "" for nothing */
    size_t n;                 /* children of a sequence, pairs of a mapping */
    struct yaml_node **key;   /* [n], scalars; NULL for a sequence */
    struct yaml_node **value; /* [n] */
};

/*
 * One document of text without aliases and tags, of bounded size and depth, no key twice in a mapping.
 * path is for messages. Empty and binary text, and text that is not YAML, are BF_BAD_FILE.
 */
enum bf_status yaml_parse(const char *path, const char *text, size_t n, struct yaml_node **out, struct bf_error *err);
void yaml_free(struct yaml_node *node);

/* Value of a key, NULL when absent or when the node is no mapping. *key (may be NULL): the key's node. */
const struct yaml_node *yaml_get(const struct yaml_node *mapping, const char *key, const struct yaml_node **key_node);
bool yaml_is_nothing(const struct yaml_node *node);

/* READING — model_yaml_read.c the whole, _values.c single values, _channels.c channels and effects, _board.c the board. */

struct yaml_reader {
    const char *path;
    struct bf_error *err;
    struct model *model;
};

/* Fills an empty model; the caller frees it also after a failure. */
enum bf_status model_from_yaml(const char *path, const struct yaml_node *root, struct model *model,
                               struct bf_error *err);

enum bf_status yaml_fail(const struct yaml_reader *r, const struct yaml_node *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
enum bf_status yaml_expect(const struct yaml_reader *r, const struct yaml_node *node, enum yaml_kind kind,
                           const char *what);
/* Every key must be in known[n_known] or begin with "x_" or "x-"; the message proposes the closest. */
enum bf_status yaml_known_keys(const struct yaml_reader *r, const struct yaml_node *mapping, const char *what,
                               const char *const known[], size_t n_known);
enum bf_status yaml_number(const struct yaml_reader *r, const struct yaml_node *node, const char *what, double *out);
enum bf_status yaml_bool(const struct yaml_reader *r, const struct yaml_node *node, const char *what, bool *out);
enum bf_status yaml_name(const struct yaml_reader *r, const struct yaml_node *node, const char *what, size_t size,
                         char *out);
/* out arrives with name, unit, default bounds and `fixed`, and leaves with what the file says. */
enum bf_status yaml_parameter(const struct yaml_reader *r, const struct yaml_node *node, bool per_record,
                              struct parameter *out);
/* A place: a number, or the mapping of a parameter, whose keys the caller checks. */
enum bf_status yaml_place(const struct yaml_reader *r, const struct yaml_node *node, struct parameter *out);
enum bf_status yaml_interval(const struct yaml_reader *r, const struct yaml_node *node, const char *what,
                             double *from_m, double *to_m);

/* The same of numbers that were read. */
enum bf_status yaml_check_interval(const struct yaml_reader *r, const struct yaml_node *node, const char *what,
                                   double from_m, double to_m);

/*
 * model_yaml_geometry.c: a number, which is held, or the mapping of a parameter, with `prior_m` or `sd` as the ruler's standard deviation in metres. out
 * arrives with name and bounds.
 */
enum bf_status yaml_length(const struct yaml_reader *r, const struct yaml_node *node, struct parameter *out,
                           bool *listed);
/* `per_record: {FILE: metres}` of a channel's place; nothing where that is absent. */
enum bf_status yaml_stated_places(const struct yaml_reader *r, const struct yaml_node *at, const char *channel);
enum bf_status yaml_read_length(const struct yaml_reader *r, const struct yaml_node *node);
enum bf_status yaml_read_patch(const struct yaml_reader *r, const struct yaml_node *node, double *from_m, double *to_m);

/* What the sensor of an output weighs, `mass_kg` of its node; left alone where that is absent. */
enum bf_status yaml_sensor_mass(const struct yaml_reader *r, const struct yaml_node *node, double *mass_kg);

enum bf_status yaml_read_inputs(const struct yaml_reader *r, const struct yaml_node *node);
enum bf_status yaml_read_outputs(const struct yaml_reader *r, const struct yaml_node *node);
enum bf_status yaml_read_effects(const struct yaml_reader *r, const struct yaml_node *node);
enum bf_status yaml_read_board(const struct yaml_reader *r, const struct yaml_node *node); /* model_yaml_board.c */
enum bf_status yaml_read_fit(const struct yaml_reader *r, const struct yaml_node *node);

/* WRITING — model_yaml_print.c new text, _edit.c and _splice.c changes to an old one. */

/* The keys of a parameter and their texts, "" for those that say nothing beyond `absent` (the reader's defaults). */
enum { YAML_PARAMETER_KEYS = 8, YAML_PARAMETER_PRIOR = 1, YAML_PARAMETER_FIXED = 4 };
struct yaml_parameter_text {
    const char *key[YAML_PARAMETER_KEYS];
    char text[YAML_PARAMETER_KEYS][DECIMAL_TEXT];
};
/* Turns a copy of a channel's place or gain into what the reader makes of `{}`: the keys that equal it are not written. */
void yaml_channel_absent(const struct model *m, struct parameter *p);
void yaml_parameter_keys(const struct parameter *p, const struct parameter *absent, struct yaml_parameter_text *out);

/* "{kind: …, …}" in one line. */
void model_print_effect(struct yaml_text *text, const struct model *model, const struct model_effect *effect);
/* "{record: {value: …}, …}" of one parameter. */
void model_print_per_record(struct yaml_text *text, const struct model_effect *effect, int slot);
bool model_has_per_record(const struct model_effect *effect, int slot);
/* What follows "fit:": lines with so many blanks in front; indent < 0: in braces, as needed inside a flow mapping. */
void model_print_fit(struct yaml_text *text, const struct fit_info *fit, long indent);
/* "board:" and its lines; nothing when the model has none (model_yaml_board.c). */
void model_print_board(struct yaml_text *text, const struct model_board *board);
/* The whole model as a new file; caller frees. */
char *model_to_text(const struct model *model);

/*
 * text with every difference between the model it states and `model` edited in place; caller frees.
 * NULL when the text cannot be edited to say this model (then write model_to_text()).
 */
char *model_edit_text(const char *text, size_t n, const struct model *model);

#endif
