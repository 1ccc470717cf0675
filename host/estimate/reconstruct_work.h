/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reconstruct_work.h — what reconstruct.c (places), reconstruct_shape.c (what it looks like) and reconstruct_text.c share. */
#ifndef BEAMFIT_RECONSTRUCT_WORK_H
#define BEAMFIT_RECONSTRUCT_WORK_H

#include "estimate.h"
#include "regression.h"

/* A scalar force at one place, on the Laplace line of every record. */
struct site_force {
    const struct motion *motion;
    double *g;                 /* [dimension] */
    struct motion_paths paths; /* of g */
    double complex **F;        /* [n_records][m] Wiener estimate; NULL for free decays */
    double **seen; /* [n_records][m] Φ|h|²/(1 + Φ|h|²): how much of a force the channels show, 0 … 1 */
};

static inline double square(double complex z)
{
    return creal(z) * creal(z) + cimag(z) * cimag(z);
}

void site_force_new(const struct motion *motion, const struct reconstruct_site *site, struct site_force *out);
void site_force_free(struct site_force *force);
/* F and seen from residual[n_rows]. */
enum bf_status site_force_estimate(struct site_force *force, const double residual[], struct bf_error *err);

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

/* Shares, curves, amplitude and frequency of *out from the force and law at its best place. */
enum bf_status reconstruct_shape(const struct site_force *force, const struct site_law *law, struct reconstruction *out,
                                 struct bf_error *err);
/* sensor_like and channel. */
void reconstruct_channels(const struct motion *motion, struct reconstruction *out);
/* out->text. */
void reconstruct_text(struct reconstruction *out);

#endif
