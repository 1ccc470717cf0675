/* SPDX-License-Identifier: GPL-3.0-or-later */
/* system_work.h — private to beam/: what its files share of system_work. */
#ifndef BEAMFIT_SYSTEM_WORK_PRIVATE_H
#define BEAMFIT_SYSTEM_WORK_PRIVATE_H

#include "beam.h"

static inline double complex block_coefficient(const double c[COEFFICIENTS], double complex s)
{
    double complex a = (s * c[OF_MASS] + c[OF_DAMPING]) * s + c[OF_STIFFNESS];
    if (c[OF_MEMORY] < 0.0 || c[OF_MEMORY] > 0.0)
        a += c[OF_MEMORY] * s * c[OF_RELAXATION] / (1.0 + s * c[OF_RELAXATION]);
    return a;
}

/* B[n × n] in undamped modes, out = ΦᵀBΦ; work[n × n]. */
void system_to_modal(const struct system *system, const double B[], double work[], double out[]);

/* Poles and vectors of the assembled system; derivatives for the parameters with want[i]. */
enum bf_status poles_compute(struct system *system, struct bf_error *err);
enum bf_status poles_differentiate(struct system *system, const bool want[], struct bf_error *err);

#endif
