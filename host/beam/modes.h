/* SPDX-License-Identifier: GPL-3.0-or-later */
/* modes.h — natural frequencies, damping and shapes of a model, and what smaller spaces make of them. */
#ifndef BEAMFIT_MODES_H
#define BEAMFIT_MODES_H

#include "model/model.h"

enum { DEPLOYED_DIMENSION = 10 };

struct mode {
    double frequency_Hz; /* |p|/2π of the damped pole */
    double undamped_Hz;
    double damping_ratio;  /* −Re p/|p| */
    double deployed_error; /* relative error of undamped_Hz in the space that goes on the target; NAN beyond it */
    double uniform_error;  /* the same for 10 equidistant cubic splines (the seed paper's space); NAN beyond them */
};

struct modes {
    size_t n;
    struct mode *mode;
    size_t in_band;                          /* modes that the deployed space must have right */
    size_t deployed_modes, deployed_statics; /* what spans the deployed space */
    double convergence; /* largest relative change of the modes' frequencies when the splines are doubled */
    size_t n_points;
    double *x_m;   /* [n_points] */
    double *shape; /* [n][n_points], largest value 1 */
};

/* n_modes lowest modes; band_Hz: modes up to this are 'in band' (0: as many as the deployed space spans). */
enum bf_status modes_compute(const struct model *model, size_t n_modes, double band_Hz, size_t n_points,
                             struct modes *out, struct bf_error *err);
void modes_free(struct modes *modes);

/* Undamped frequencies of n_modes modes with n_splines splines; uniform: equidistant knots. */
enum bf_status modes_frequencies(const struct model *model, size_t n_splines, bool uniform, size_t n_modes,
                                 double frequency_Hz[], struct bf_error *err);

#endif
