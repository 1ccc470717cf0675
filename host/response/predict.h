/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * predict.h — model + inputs of records -> prediction of the outputs, with exact derivatives by every parameter.
 *
 * A predictor is built once for a model's structure and a list of records; then predictor_run() evaluates it at a
 * parameter vector in the order of model_parameters(model, record names). Rows of a prediction are stacked channel by
 * channel: all samples of record 0's first recorded output, then its second, …, then record 1's.
 *
 * Linear models are solved band-limited in the Laplace domain (exact for zero-phase band-limited sampling); laws,
 * drives and other nonlinear slots by the implicit step on an oversampled grid. See docs/model.md.
 */
#ifndef BEAMFIT_PREDICT_H
#define BEAMFIT_PREDICT_H

#include "model/model.h"
#include "record/record.h"

enum intersample { INTERSAMPLE_BAND_LIMITED, INTERSAMPLE_ZERO_ORDER_HOLD, INTERSAMPLE_FIRST_ORDER_HOLD };

/* What --intersample of the commands can be: bl, foh, zoh. BF_USAGE for anything else. */
enum bf_status intersample_from_text(const char *text, enum intersample *out, struct bf_error *err);

struct predict_options {
    enum intersample intersample; /* 0: band limited */
    int oversample;               /* of the nonlinear grid; 0: 8, checked by predict_convergence() */
    int threads;                  /* for nonlinear records; 0: one a processor */
    bool quiet;                   /* no warnings (the same records were seen before) */
    bool uniform_splines; /* equidistant knots, not on the region edges: the seed paper's space, for comparison */
    size_t fine_splines;  /* dimension of the fine spline space; 0: 160 */
    size_t modes;         /* modes of the reduced space; 0: enough for 4 × the band */
};

/* What --splines of the commands can be: N or N,uniform; into fine_splines and uniform_splines. BF_USAGE for anything else. */
enum bf_status splines_from_text(const char *text, struct predict_options *out, struct bf_error *err);

/* One output of one record. */
struct predict_channel {
    size_t record, output; /* indices into the record list and model->outputs */
    size_t row, n;         /* its rows in the stacked vectors */
    double dt_s;
    const double *measured; /* [n], the record's column */
};

/*
 * y leaves the linear unknowns out: the whole prediction is y + Σ amplitude · column. The Jacobian holds
 * d(y + Σ amplitude · column) at the amplitudes of the last predictor_set_nuisance() (0 before).
 */
struct prediction {
    size_t n_rows;       /* of the current window */
    size_t n_parameters; /* of model_parameters(); fixed ones included (their columns are filled too) */
    size_t n_nuisance;   /* linear unknowns of free-decay records: initial states of modes, filters */
    double *y;           /* [n_rows] */
    double *jacobian;    /* [n_parameters][n_rows], d y/d parameter (physical, not logarithmic); NULL unless asked */
    double *nuisance;    /* [n_nuisance][n_rows], columns of the linear unknowns (zero outside their record) */
};

struct predictor;

enum bf_status predictor_new(const struct model *model, const struct record records[], size_t n_records,
                             const struct predict_options *options, struct predictor **out, struct bf_error *err);
void predictor_free(struct predictor *predictor);

size_t predictor_channels(const struct predictor *predictor, const struct predict_channel **out);
/* Modes of the reduced space at the last base; static responses are not counted. */
size_t predictor_modes(const struct predictor *predictor);

/*
 * Restrict to the first t_end_s of every record (counted from its first sample, or from free_from_s for a free decay);
 * INFINITY: whole records. Changes rows. Short windows cost proportionally less.
 */
enum bf_status predictor_window(struct predictor *predictor, double t_end_s, struct bf_error *err);

/*
 * Rebuild the reduced space at these parameters. The prediction is then exact at them and in error of second order
 * in the distance from them; call after every larger move and at the end of a fit.
 */
enum bf_status predictor_rebase(struct predictor *predictor, const double parameters[], struct bf_error *err);

/*
 * want_jacobian: bool per parameter (NULL: none). Arrays in *out belong to the predictor and live until the next call.
 * BF_NUMERIC when the model cannot be evaluated there (negative mass, unstable step).
 */
enum bf_status predictor_run(struct predictor *predictor, const double parameters[], const bool want_jacobian[],
                             struct prediction *out, struct bf_error *err);

/* amplitude[n_nuisance]: the linear unknowns as last solved; kept until changed or until the window or base moves. */
void predictor_set_nuisance(struct predictor *predictor, const double amplitude[]);

/* Independent copy for another thread (shares nothing mutable). */
enum bf_status predictor_clone(const struct predictor *from, struct predictor **out, struct bf_error *err);

#endif
