/* SPDX-License-Identifier: GPL-3.0-or-later */
/* motion_work.h — what motion.c, motion_jacobian.c and motion_paths.c share; for nobody else. */
#ifndef BEAMFIT_MOTION_WORK_H
#define BEAMFIT_MOTION_WORK_H

#include "estimate.h"
#include "motion.h"

static inline double cabs2(double complex z)
{
    return creal(z) * creal(z) + cimag(z) * cimag(z);
}

/* G[modes.n][m]: 1/(s² + C_kk s + ω_k²). */
void motion_resonances(const struct motion *motion, const struct response_grid *grid, double complex G[]);
/* ψ_k(g) of a functional. */
double motion_shape(const struct motion *motion, size_t mode, const double g[]);

#endif
