/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_resample.h — columns with jittered or polled time stamps brought to a uniform axis. Private to import/. */
#ifndef BEAMFIT_IMPORT_RESAMPLE_H
#define BEAMFIT_IMPORT_RESAMPLE_H

#include "import_axis.h"

/* times_s[n] of a channel of times, in seconds. BF_USAGE, BF_BAD_FILE (with the line): they do not increase. */
enum bf_status import_times(const struct import_file *file, const struct import_choice *choice, size_t time,
                            double **times_s, size_t *n, struct bf_error *err);

/*
 * The uniform axis that choice->resample_Hz asks for, and columns x[n_columns][axis->n] (caller frees each) over it. said: what was
 * done, for the metadata. BF_USAGE: too high a rate; BF_BAD_FILE: a gap, a value that is no number.
 */
enum bf_status import_resample(const struct import_file *file, const struct import_choice *choice, size_t time,
                               size_t n_columns, const struct import_column columns[], struct import_axis *axis,
                               double *x[], char said[400], struct bf_error *err);

/* A rate that stamps of this mean rate carry. */
double import_safe_rate(double mean_Hz);

#endif
