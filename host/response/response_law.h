/* SPDX-License-Identifier: GPL-3.0-or-later */
/* response_law.h — one nonlinear effect on the reduced space; part of response.h */
#ifndef BEAMFIT_RESPONSE_LAW_H
#define BEAMFIT_RESPONSE_LAW_H

#include <stdbool.h>
#include <stddef.h>

#include "beam/beam.h"
#include "ground/ground.h"
#include "model/model.h"

/*
 * LAW — one nonlinear effect on the reduced space: its contact coordinates and the force on each of them.
 *
 * A law at a point has one coordinate w = gᵀx. A law over the span is evaluated at Gauss points; its coordinates are
 * the amplitudes of the modes in the band (the first columns of the reduced basis), so that the implicit equation of a
 * step stays small. Forces stand on the left side of the weak form and belong to the coordinates by virtual work.
 */

enum {
    LAW_COORDINATES = 8,                          /* of one law, at most */
    LAW_DEPENDENCIES = BEAM_EFFECT_PARAMETERS + 8 /* own parameters, and weights EI and ρ of up to 4 materials */
};

struct law {
    const struct beam_effect *effect;
    size_t effect_index;
    size_t d;               /* coordinates; 0: the effect has no law */
    double *g;              /* [d][n] functionals of the coordinates */
    double *g_at, *g_width; /* [n] derivative of a point law's functional; NULL when its place is no parameter */
    size_t at_parameter, width_parameter; /* in the parameter vector; SIZE_MAX: none */
    bool uses_w, uses_v, uses_w_old;      /* the force depends on the coordinate, its rate, its value a step ago */
    bool resists;                         /* on the rate, by itself: friction, drag */
    bool smooth;                          /* no internal state, and tangents without jumps */
    size_t n_points, width;
    size_t stride;      /* n_points rounded up to the length of vectors */
    double *psi;        /* [width][d][stride], zero beyond n_points */
    double *quadrature; /* [n_points] */
    size_t *material;   /* [n_points] */
    double *
        shortening; /* [d][d][stride] ∫₀ˣ φ_i' φ_j' ds at the points, see law_axial.h; NULL: no inertia along the beam */
    enum beam_weight weight;
    size_t n_dependencies; /* parameters the force depends on at given coordinates */
    size_t dependency[LAW_DEPENDENCIES];
};

/* Force, tangents and derivatives at one instant. Arrays have d (or d × d, row i by column j at [i·d + j]) entries. */
struct law_force {
    double f[LAW_COORDINATES];
    double by_w[LAW_COORDINATES * LAW_COORDINATES], by_v[LAW_COORDINATES * LAW_COORDINATES];
    double by_w_old[LAW_COORDINATES * LAW_COORDINATES];
    double by_a[LAW_COORDINATES * LAW_COORDINATES]; /* where the law has `shortening` */
    double by_parameter[LAW_DEPENDENCIES][LAW_COORDINATES];
    /* internal states: point laws only */
    double by_z[BEAM_LAW_STATES], z[BEAM_LAW_STATES];
    double z_by_w[BEAM_LAW_STATES], z_by_v[BEAM_LAW_STATES], z_by_w_old[BEAM_LAW_STATES];
    double z_by_z[BEAM_LAW_STATES][BEAM_LAW_STATES], z_by_parameter[BEAM_LAW_STATES][LAW_DEPENDENCIES];
};

struct law_motion {
    const double *w, *v, *w_old; /* [d] */
    const double *a;             /* [d] acceleration, read where the law has `shortening` */
    const double *z;             /* [BEAM_LAW_STATES] at the beginning of the step */
    double t_s, dt_s;
};

enum bf_status law_new(const struct model *model, const struct reduced *reduced, const struct parameter_map *map,
                       size_t effect_index, double top_rad, struct law *out, struct bf_error *err);
void law_free(struct law *law);

/* A point law follows its place: g, g_at, g_width at the effect's parameters p. Nothing to do for a law over the span. */
enum bf_status law_move(struct law *law, const struct model *model, const struct reduced *reduced, const double p[],
                        struct bf_error *err);

/* A law at given parameters. Free with law_prepared_free(). */
struct law_prepared {
    const struct law *law; /* NULL: the effect has none */
    double p[BEAM_EFFECT_PARAMETERS];
    size_t slot[BEAM_EFFECT_PARAMETERS]; /* index of each into by_parameter; SIZE_MAX: none */
    double zero[4];                      /* 0: what an effect's answer is cleared with */
    double *weight;                      /* [n_points] quadrature times the weight's material value */
    size_t *by_weight;                   /* [n_points] index of that value into by_parameter; SIZE_MAX: none */
    double *mass;                        /* [stride], [n_points] the same of ρ, where the law has `shortening` */
    size_t *by_mass;
};

void law_prepare(const struct law *law, const struct parameter_map *map, const double theta[],
                 struct law_prepared *out);
void law_prepared_free(struct law_prepared *prepared);

/* tangents: also by_w, by_v, by_w_old, by_a; derivatives: also by_parameter and the z_* members. 0, or −1 out of range. */
int law_force(const struct law_prepared *prepared, const struct law_motion *motion, bool tangents, bool derivatives,
              struct law_force *out);

#endif
