/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_work.h — between the files that make a record of a foreign file: the work in progress. */
#ifndef BEAMFIT_IMPORT_WORK_H
#define BEAMFIT_IMPORT_WORK_H

#include "import.h"
#include "import_private.h"

enum { IMPORT_SHOWN = 60 }; /* characters of a name in a message */

/* A column to be: channel and name (owned). */
struct import_column {
    size_t channel;
    char *name;
};

/* The uniform axis of the record and where it is from. */
struct import_axis {
    size_t n;
    double t0_s, dt_s;
    size_t channel; /* that held the times, or IMPORT_NO_AXIS */
    char from[160];
};

struct import_work {
    const struct import_file *file;
    const struct import_choice *choice;
    size_t n_columns;
    struct import_column *columns;
    struct import_axis axis;
    size_t first, last; /* samples kept, both included */
};

long import_line_of(const struct import_file *file, size_t sample); /* 0: unknown */
/* By the name in the file, by the column's name to be, or "#3". IMPORT_NO_AXIS when there is none. */
size_t import_find_channel(const struct import_file *file, const char *name);
enum bf_status import_fail_no_channel(const struct import_file *file, const char *option, const char *name,
                                      struct bf_error *err);
bool import_is_axis(const struct import_file *file, size_t channel); /* of another channel */

/* Which channel holds the times of the record; IMPORT_NO_AXIS: none, the file or the user states a rate. */
enum bf_status import_choose_time(const struct import_work *w, size_t *time, struct bf_error *err);
/* Fills w->axis; the columns are chosen. */
enum bf_status import_make_axis(struct import_work *w, size_t time, struct bf_error *err);

#endif
