/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linearity_pair.h — the test of one pair of records against one linear system. Private to noise/. */
#ifndef BEAMFIT_LINEARITY_PAIR_H
#define BEAMFIT_LINEARITY_PAIR_H

#include "noise.h"

/* Above this a pair is not linear; see docs/diagnose.md, 'Linearity', for the simulation that set it. */
extern const double linearity_threshold;

/* One channel of one record and the only input that moves in it. Views. */
struct linearity_signal {
    size_t record, output, input;
    size_t n;
    double dt_s;
    const double *u, *y; /* [n] */
    double *cleaned;     /* [n] y without what was found added to it */
    double level;        /* rms of y */
    const struct noise_estimate *noise;
};

/* Frequencies that are left out of ratio_broad: each takes the cells it leaks into. */
struct linearity_lines {
    size_t n;
    double frequency_Hz[32];
};

/* Fills everything of *pair from `same_shape` on, and nonlinear. weak->dt_s == strong->dt_s. */
enum bf_status linearity_pair_measure(const struct linearity_signal *weak, const struct linearity_signal *strong,
                                      const struct linearity_lines *lines, struct linearity_pair *pair,
                                      struct bf_error *err);

#endif
