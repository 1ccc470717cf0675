/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * line_rows.h — rows of a fit that are no samples; private to estimate/.
 *
 * A list of measured frequencies gives a row a mode, (ln|p|/2π − ln f)/(sd/f), and one for each damping ratio, (ln ζ − ln ζ_m)/(sd/ζ_m). Rows are in
 * standard errors; where the file states none, 0.5 % of a frequency and 20 % of a damping ratio are taken, and the spread tells (line_statistics.c).
 *
 * A spectrum without phase gives a row a line (line_magnitudes.c).
 *
 * Each such record has a predictor of its own, of a record of silence whose band holds what was measured, or of the pulse of a response: poles and derivatives come from where all
 * predictions come from. Groups are rows of one record with one kind of error.
 */
#ifndef BEAMFIT_LINE_ROWS_H
#define BEAMFIT_LINE_ROWS_H

#include "estimate.h"

enum line_kind { LINE_FREQUENCY, LINE_DAMPING, LINE_MAGNITUDE };

struct line_group {
    size_t record; /* of all records of the fit */
    enum line_kind kind;
    char name[MODEL_NAME];
    size_t row, n; /* rows, from 0 */
    bool stated;   /* their standard errors are those of the file */
};

struct line_set; /* one record */

struct line_rows {
    size_t n_sets;
    struct line_set *sets;
    size_t n_groups;
    struct line_group *groups;
    size_t n_refs, n_rows;
    double *scale;    /* [n_rows] standard error of what was measured */
    double *measured; /* [n_rows] logarithm of a frequency or damping ratio; magnitude of a line */
    bool *used;       /* [n_rows] false: belongs to no mode of the model as it was when they were paired */
    /* last run */
    double *residual; /* [n_rows] in standard errors; 0 where not used */
    double *jacobian; /* [n_refs][n_rows] by θ, in standard errors */
};

/* Records that are no samples; they stand behind all others, else SIZE_MAX. */
size_t lines_behind(const struct record records[], size_t n_records);

/*
 * The records[first … n_records − 1]; refs: of all records. *out NULL where there are none. BF_USAGE: the model has an effect that no linear mode has.
 * Free with lines_free(). Everything else is borrowed.
 */
enum bf_status lines_new(const struct model *model, const struct record records[], size_t first, size_t n_records,
                         const struct parameter_ref refs[], size_t n_refs, const struct predict_options *options,
                         struct line_rows **out, struct bf_error *err);
void lines_free(struct line_rows *lines);

/* The reduced spaces at θ[n_refs] and, with pair, which mode each row belongs to from here on. NULL lines: nothing is done. */
enum bf_status lines_rebase(struct line_rows *lines, const double theta[], bool pair, struct bf_error *err);
/* Fills residual and, with want[n_refs], jacobian. */
enum bf_status lines_run(struct line_rows *lines, const double theta[], const bool want[], struct bf_error *err);

size_t lines_rows(const struct line_rows *lines); /* 0: NULL */
size_t lines_used(const struct line_rows *lines);
bool lines_stated(const struct line_rows *lines); /* all standard errors are known */

/* One error for each group: [n_groups]. */
void lines_errors(const struct line_rows *lines, struct fit_channel_error errors[]);

#endif
