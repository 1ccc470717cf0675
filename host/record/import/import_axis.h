/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_axis.h — the uniform time axis of a record that is made of a foreign file. */
#ifndef BEAMFIT_IMPORT_AXIS_H
#define BEAMFIT_IMPORT_AXIS_H

#include "import.h"

/* A column of the record to be. */
struct import_column {
    size_t channel; /* of the file */
    char *name;     /* owned */
};

/* The axis and where it is from. */
struct import_axis {
    size_t n;
    double t0_s, dt_s;
    bool over_frequency; /* both are in Hz */
    char from[160];
};

/* Which channel holds the times of the record; IMPORT_NO_AXIS: none, the file or the user states a rate. BF_USAGE. */
enum bf_status import_choose_time(const struct import_file *file, const struct import_choice *choice, size_t *time,
                                  struct bf_error *err);

/* The axis of these columns (at least one), whose channels must be as long as it is. time: as import_choose_time() says. */
enum bf_status import_make_axis(const struct import_file *file, const struct import_choice *choice, size_t time,
                                size_t n_columns, const struct import_column columns[], struct import_axis *axis,
                                struct bf_error *err);

#endif
