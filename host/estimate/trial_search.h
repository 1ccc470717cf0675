/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * trial_search.h — the search of one effect's parameters along one motion; private to estimate/.
 *
 *     W r ≈ W (J Δθ + a S(p)),   S(p) = −H f(ŵ, ŵ_t; p),   priors as rows
 *
 * Parameters in which the force is not linear (flag INNER: place, gap, threshold, rate) are scanned: places along the span,
 * levels (enum beam_level) of the coordinate, its rate, or strength × either on the scale of the measured motion,
 * others on a logarithmic grid about the catalogue's start. Then refined, the motion and θ renewed, and again.
 */
#ifndef BEAMFIT_TRIAL_SEARCH_H
#define BEAMFIT_TRIAL_SEARCH_H

#include "regression.h"
#include "trial_roles.h"

/* One trial point: parameters with the strength estimated. */
struct trial_point {
    double p[BEAM_EFFECT_PARAMETERS];
    double factor; /* estimated strength over the one that the force was computed with */
    double fall;   /* of χ²; 0 where the force is nothing new, or its sign is against the range */
    double norm2;  /* ‖S̃‖² */
};

struct trial_search {
    const struct motion *motion;
    const struct regression *regression;
    struct trial_force force;
    struct trial_roles roles;
    const struct parameter *info; /* [n_parameters] of the effect, in the model */
    double *rows, *s;             /* [n_rows], [m] */
    const double *measure;        /* [n_channels] weights of the χ² that is reported, the same for all candidates */
    struct trial_point best;
};

/* regression NULL: bound later, with trial_search_bind(). */
enum bf_status trial_search_new(const struct motion *motion, const struct regression *regression,
                                const struct beam_effect *effect, struct trial_search *out, struct bf_error *err);
void trial_search_bind(struct trial_search *search, const struct regression *regression);
void trial_search_free(struct trial_search *search);
/* From nothing: thresholds and places on grids, then refined. */
void trial_search_scan(struct trial_search *search, const struct trial_options *options, struct bf_error *err);
/* From parameters that are nearly right. */
void trial_search_resume(struct trial_search *search, const double p[BEAM_EFFECT_PARAMETERS],
                         const struct trial_options *options);
/* The best point into *out, whose theta[] is there; possible is false when nothing helped. */
enum bf_status trial_search_answer(struct trial_search *search, struct trial *out, struct bf_error *err);

#endif
