/* SPDX-License-Identifier: GPL-3.0-or-later */
/* poles.h — poles and vectors of the assembled system, and their derivatives. Private to beam/; see SYSTEM in beam.h. */
#ifndef BEAMFIT_POLES_H
#define BEAMFIT_POLES_H

#include "beam.h"

enum { BLOCK_DEPENDENCIES = BEAM_EFFECT_PARAMETERS + 3 };

/* How a block enters at the current parameters: a(s) = s²m + sd + k + E τs/(1+τs), and da by each parameter. */
struct block_use {
    double value[COEFFICIENTS];
    size_t n_dependencies;
    struct {
        size_t parameter;
        double d[COEFFICIENTS];
    } dependency[BLOCK_DEPENDENCIES];
    size_t position; /* the parameter that moves the block's place; SIZE_MAX: none */
    const double *B; /* [n × n] current matrix: the base's, or `own` */
    double *own;     /* [n × n] moved place, or X of BLOCK_MODES */
    double *B_at;    /* [n × n] dB/d(at_m) when position is not SIZE_MAX */
};

/* a(s) of a block: what its matrix is multiplied by in A(s). */
static inline double complex block_coefficient(const double c[COEFFICIENTS], double complex s)
{
    double complex a = (s * c[OF_MASS] + c[OF_DAMPING]) * s + c[OF_STIFFNESS];
    if (c[OF_MEMORY] < 0.0 || c[OF_MEMORY] > 0.0)
        a += c[OF_MEMORY] * s * c[OF_RELAXATION] / (1.0 + s * c[OF_RELAXATION]);
    return a;
}

/* B[n × n] in undamped modes, out = ΦᵀBΦ; work[n × n]. */
void system_to_modal(const struct system *system, const double B[], double work[], double out[]);

/* p and phi of the assembled system. BF_NUMERIC: two poles coincide. */
enum bf_status poles_compute(struct system *system, struct bf_error *err);
/* Their derivatives by the parameters with want[i], [map->n]; after poles_compute(). */
enum bf_status poles_differentiate(struct system *system, const bool want[], struct bf_error *err);

#endif
