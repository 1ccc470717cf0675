/* SPDX-License-Identifier: GPL-3.0-or-later */
/* motion.h — private to estimate/: what its files share of motion. */
#ifndef BEAMFIT_MOTION_PRIVATE_H
#define BEAMFIT_MOTION_PRIVATE_H

#include "estimate.h"

/* Sets the predictor's initial states to those nearest to the first instants that were measured. */
enum bf_status motion_solve_states(const struct motion *motion, struct bf_error *err);
/* q[modes][m] of a free decay, from y, the run at those states: how the motion's amplitudes change from window to window. */
enum bf_status motion_follow_decay(const struct motion *motion, const struct prediction *y, size_t record,
                                   double complex q[], struct bf_error *err);

/*
 * w = gᵀx of a record, its rate and its acceleration, [n · oversample] each on a grid of `oversample` points a sample, the
 * first at the record's first sample. Each may be NULL.
 */
enum bf_status motion_of(const struct motion *motion, size_t record, const double g[], int oversample, double w[],
                         double v[], double a[], struct bf_error *err);

/* F[m] of a force given on the oversampled grid, f[n · oversample · stride] read with that stride. */
enum bf_status motion_transform(const struct motion *motion, size_t record, const double f[], size_t stride,
                                int oversample, double complex F[], struct bf_error *err);

/* What forces at functionals g do to every channel. Transfer functions are kept, so that many forces cost little. */
struct motion_paths {
    size_t d;           /* functionals */
    double complex **H; /* [n_channels][d · m] before gain and filters; channels of one output may share it */
    bool *own;          /* [n_channels] */
};
void motion_paths_new(const struct motion *motion, const double g[], size_t d, struct motion_paths *out);
void motion_paths_free(const struct motion *motion, struct motion_paths *paths);

/* rows += −H F of a record; F: [d][m], rows: [n_rows] stacked as the prediction. */
enum bf_status motion_respond(const struct motion *motion, const struct motion_paths *paths, size_t record,
                              const double complex F[], double rows[], struct bf_error *err);

/*
 * The motion when forces F[record][d · m] at g[d] (left side of the weak form) are believed to act: their response is
 * taken off the residual, and only what is left asks for smallest modal forces. The Jacobian
 * follows with motion_update_jacobian().
 */
enum bf_status motion_assume(struct motion *motion, const double g[], const struct motion_paths *paths,
                             double complex *const F[], struct bf_error *err);
enum bf_status motion_update_jacobian(struct motion *motion, struct bf_error *err);

#endif
