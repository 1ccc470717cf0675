/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reconstruct_law.h — a force that is a function of displacement and velocity at its place; private to estimate/. */
#ifndef BEAMFIT_RECONSTRUCT_LAW_H
#define BEAMFIT_RECONSTRUCT_LAW_H

#include "reconstruct_force.h"
#include "regression.h"

/*
 * Features of (w, v) over their largest values in all records: odd in w (w, w³, w⁵, a step, hinges), even in w (|w|, w²,
 * w⁴, hinges), odd in v (v, v|v|, v³, steps). Hinges open at, and steps in v turn within, a ladder of parts of the largest.
 */
enum {
    LADDER = 3,
    ODD_W = 4 + LADDER,
    EVEN_W = 3 + LADDER,
    ODD_V = 3 + LADDER,
    FEATURES = ODD_W + EVEN_W + ODD_V,
    FEATURE_W = 0,              /* w itself */
    FEATURE_V = ODD_W + EVEN_W, /* v itself */
    FEATURE_DRAG = FEATURE_V + 1,
    FEATURE_STEPS = FEATURE_V + 3 /* LADDER of them */
};
void reconstruct_features(double w, double v, double out[FEATURES]);

/* The regression of the residual on the features at a place, the baseline's parameters projected out. */
struct site_law {
    double w, v;                                         /* largest of all records */
    double gram[FEATURES * FEATURES], product[FEATURES]; /* of unit columns */
    double norm[FEATURES];
    double chi_square; /* before */
};
enum bf_status site_law_fit(const struct site_force *force, const struct regression *regression, struct site_law *out,
                            struct bf_error *err);
/* χ² that the features with use[i] take away, 0 … law->chi_square; c[FEATURES]: their coefficients (NULL: not asked). */
double site_law_fall(const struct site_law *law, const bool use[FEATURES], double c[FEATURES]);
/* rows[n_rows]: the response to the law's force Σ c_i feature_i. */
enum bf_status site_law_rows(const struct site_force *force, const struct site_law *law, const double c[FEATURES],
                             double rows[], struct bf_error *err);

#endif
