/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reduced_work.h — what reduced.c (blocks), reduced_basis.c and reduced_place.c share; for nobody else. */
#ifndef BEAMFIT_REDUCED_WORK_H
#define BEAMFIT_REDUCED_WORK_H

#include "beam.h"
#include "reduced.h"
#include "maths/maths.h"

/* A place as a sum of derivatives of the deflection: Σ scale · D^derivative y(at). */
struct place_points {
    int n, derivative;
    double at[2], scale[2];
};

struct place_points place_slope_difference(double from, double to);
/* n = 0 for a form over the span. */
struct place_points place_points(const struct beam_operator *place, const struct model *model);
/* g[space->n] += the functional. */
void place_functional(const struct fine_space *space, const struct place_points *points, double g[]);

static inline bool is_place(enum beam_operator_kind kind)
{
    return kind >= BEAM_AT_POINT && kind <= BEAM_AT_ROOT;
}

static inline bool is_form(enum beam_operator_kind kind)
{
    return kind >= BEAM_OVER_DEFLECTION && kind <= BEAM_OVER_CURVATURE;
}

static inline int form_derivative(enum beam_operator_kind kind)
{
    return (int)kind - (int)BEAM_OVER_DEFLECTION;
}

/* Adds scale · ∫ D^k φ_i D^k φ_j over every region of a material to band[space->n][FINE_BAND]. */
void reduced_material_form(const struct fine_space *space, const struct model *model, size_t material, int derivative,
                           double scale, double band[]);

struct basis {
    const struct fine_space *space;
    double *M; /* band */
    struct sparse_factor *factor;
    double *V, *work; /* V[N × capacity], work[N] */
    size_t n, limit;
    int corrections;
};

/* Modes and static responses of the model into b->V; fills b->M, b->factor and the modes of *out. */
enum bf_status reduced_basis(struct basis *b, const struct model *model, const struct reduced_options *options,
                             struct reduced *out, struct bf_error *err);

#endif
