/* SPDX-License-Identifier: GPL-3.0-or-later */
/* record_sets.h — MODEL RECORD... [--check RECORD...]: names off a command line, and the records read. */
#ifndef BEAMFIT_RECORD_SETS_H
#define BEAMFIT_RECORD_SETS_H

#include <stdbool.h>
#include "ground/ground.h"
#include "model/model.h"
#include "record/record.h"

/* Starts empty ({0}); names are the command line's own, records belong to the list. */
struct record_list {
    size_t n_names, n;
    const char **names;
    struct record *records; /* n of them: as many of the names as have been read */
};

/* Reads one record: record_read(), or a command's own way. */
struct record_reader {
    enum bf_status (*read)(void *context, const char *path, struct record *out, struct bf_error *err);
    void *context;
};

void record_list_add(struct record_list *list, const char *name);
/*
 * Every name, once; records over time in order, and then the others. A record that begins in motion beside its input (initial_state_find()) is marked, and a warning says so. On failure the records before the bad one stay, to be freed as always.
 */
enum bf_status record_list_read(struct record_list *list, const struct model *model, struct bf_error *err);
enum bf_status record_list_read_by(struct record_list *list, const struct model *model,
                                   const struct record_reader *reader, struct bf_error *err);
/*
 * Takes the noise of measured inputs off where nothing stands out of it (inputs_clean()), and zero shifts of accelerometers (baselines_take_off()), of the records of
 * both lists, each with a warning; when they cannot be looked for, a warning says so. Records over time that do not state the recorder's filter get a usual one
 * (record_assume_filter()), with a warning where the model has something that feels it. held_out may be NULL.
 */
void record_lists_clean(const struct model *model, struct record_list *fitted, struct record_list *held_out);
void record_list_free(struct record_list *list);
/* How many of the records that were read are over time; lists of frequencies and spectra without phase stand behind them. */
size_t record_list_sampled(const struct record_list *list);

/* Starts empty ({0}). */
struct record_sets {
    const char *model; /* the first name; NULL: none */
    struct record_list fitted, held_out;
    bool checking; /* names go to held_out */
};

/* In the command's table of options. The words after its value go with it. */
enum { RECORD_SETS_CHECK_CODE = 'c' };
#define RECORD_SETS_CHECK(what)                                                                                        \
    {                                                                                                                  \
        RECORD_SETS_CHECK_CODE, 0, "check", "RECORD...", NULL, what                                                    \
    }

/*
 * options_next() of a command that takes names between its options: the names and --check
 * are taken care of, any other option is returned. Names after --check, up to the next option, are held out.
 */
int record_sets_next(struct record_sets *sets, int argc, char **argv, const struct option_row rows[],
                     struct bf_error *err);
/* Fitted ones first. BF_USAGE: a record is fitted and held out, by its content. */
enum bf_status record_sets_read(struct record_sets *sets, const struct model *model, struct bf_error *err);
void record_sets_free(struct record_sets *sets);

/* The records of both lists, those over time first, and of each kind the held-out ones last; they stay the lists' own. free() records. */
struct record_join {
    struct record *records;
    size_t n_sampled, n_sampled_held_out, n_lines, n_lines_held_out;
};
void record_sets_join(const struct record_sets *sets, struct record_join *out);

#endif
