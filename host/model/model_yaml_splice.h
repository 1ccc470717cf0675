/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * model_yaml_splice.h — changes to the text of a YAML file, collected at byte positions of its tree and applied at once.
 * Only model_yaml_edit.c uses it.
 */
#ifndef BEAMFIT_MODEL_YAML_SPLICE_H
#define BEAMFIT_MODEL_YAML_SPLICE_H

#include "model_yaml.h"

struct splice {
    size_t from, to; /* bytes of the old text to replace */
    char *text;
    size_t order; /* of two insertions at one place the earlier comes first */
};

struct splicer {
    const char *text; /* [n_text] */
    size_t n_text;
    struct splice *splices;
    size_t n;
    bool failed; /* the text cannot be edited as asked */
};

void splice_replace(struct splicer *s, size_t from, size_t to, const char *text);
/* The same with three texts in a row. */
void splice_replace3(struct splicer *s, size_t from, size_t to, const char *a, const char *b, const char *c);

/* End of the line of `at`, before its line break. */
size_t splice_end_of_line(const struct splicer *s, size_t at);
/* Behind the colon of a key. */
size_t splice_after_colon(struct splicer *s, const struct yaml_node *key);
/* A line break and so many blanks; caller frees. */
char *splice_line_break(long indent);

/* Index of a key's pair, < 0: absent. */
long splice_index(const struct yaml_node *mapping, const char *key);
/* Sets key to the text `value`, as a new last pair when it is absent; "" takes the pair out. */
void splice_set_pair(struct splicer *s, const struct yaml_node *mapping, const char *key, const char *value);
void splice_append_pair(struct splicer *s, const struct yaml_node *mapping, const char *key, const char *value);
void splice_delete_pair(struct splicer *s, const struct yaml_node *mapping, size_t i);
/* is_first_left: no item before it stays. */
void splice_delete_item(struct splicer *s, const struct yaml_node *list, size_t i, bool is_first_left);

/* The new text, with the line ends of the old one; sets failed when two changes overlap. Caller frees. */
char *splice_apply(struct splicer *s);
void splice_free(struct splicer *s);

#endif
