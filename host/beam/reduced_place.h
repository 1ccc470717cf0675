/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reduced_place.h — places and forms on the fine space: what blocks and basis vectors are made of. Private to beam/. */
#ifndef BEAMFIT_REDUCED_PLACE_H
#define BEAMFIT_REDUCED_PLACE_H

#include "beam.h"

/* A place as a sum of derivatives of the deflection: Σ scale · D^derivative y(at). */
struct place_points {
    int n, derivative;
    double at[2], scale[2];
};

struct place_points place_slope_difference(double from, double to);
/* n = 0 for a form over the span. */
struct place_points place_points(const struct beam_operator *place, const struct model *model);
/* Where the mass of an output's sensor is: at at_m. */
struct beam_operator sensor_place(double at_m);
/* g[space->n] += the functional on the fine space. */
void place_functional(const struct fine_space *space, const struct place_points *points, double g[]);

static inline bool is_place(enum beam_operator_kind kind)
{
    return kind >= BEAM_AT_POINT && kind <= BEAM_AT_POINT_TO_OWN;
}

/* The share of the effect's own coordinate in a place. */
static inline double own_share(enum beam_operator_kind kind)
{
    return kind == BEAM_AT_OWN ? 1.0 : kind == BEAM_AT_POINT_TO_OWN ? -1.0 : 0.0;
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

/* The terms of effect `e` at the model's parameters; zeros where it has none. BF_NUMERIC: a parameter is out of its range. */
enum bf_status effect_terms(const struct model *model, size_t e, struct beam_term out[BEAM_EFFECT_TERMS],
                            struct bf_error *err);

#endif
