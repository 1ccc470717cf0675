/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reconstruct_force.h — a scalar force at one place of the beam and its history; private to estimate/. */
#ifndef BEAMFIT_RECONSTRUCT_FORCE_H
#define BEAMFIT_RECONSTRUCT_FORCE_H

#include "estimate.h"
#include "motion.h"

/* A scalar force at one place, on the Laplace line of every record. */
struct site_force {
    const struct motion *motion;
    double *g;                 /* [dimension] */
    struct motion_paths paths; /* of g */
    double complex **F;        /* [n_records][m] Wiener estimate */
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

#endif
