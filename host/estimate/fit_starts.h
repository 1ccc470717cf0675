/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_starts.h — where a search may begin: a list of the best starts, and grids over what an effect is unsure of. */
#ifndef BEAMFIT_FIT_STARTS_H
#define BEAMFIT_FIT_STARTS_H

#include "fit_problem.h"

/* Starts, best first, each a whole θ[n_refs]: scales of x may change between them. */
struct starts {
    size_t n, room, n_refs;
    bool *compared;      /* [n_refs] parameters of the effects searched for */
    double *half_square; /* [room] what they are ranked by */
    double *theta;       /* [room][n_refs] */
};
struct starts starts_new(size_t room, size_t n_refs, const struct parameter_ref refs[], size_t first_effect);
void starts_free(struct starts *starts);
/* Kept when among the best `room`; of two that agree to 5 % in rank and in the effects' parameters the better stays. */
void starts_add(struct starts *starts, const double theta[], double half_square);
/* Drops what is ranked at more than factor times the best. */
void starts_prune(struct starts *starts, double factor);
/* θ -> x with scales that suit it. */
void starts_to_x(struct fit_problem *p, const double theta[], double x[]);

/*
 * A fit of a model that lacks something may have driven a positive parameter to where it changes nothing; its logarithm has no
 * gradient there, so a search would leave it. Such elements of theta[n_refs] are set to where they change the signals by about 1 %;
 * parameters of effects are left alone. Cost: one Jacobian.
 */
enum bf_status starts_restore_vanished(struct fit_problem *p, double theta[], struct bf_error *err);
/* The problem, in the stage of whole records, has a Jacobian at x[n_unknowns] that says that nothing would be restored. */
bool starts_none_vanished(const struct fit_problem *p, const double x[]);

enum { GRID_VALUES = 26 };

/* The product of the values worth a start of the unknowns of some effects; per-record values of one parameter move together. */
struct start_grid {
    size_t n_unknowns, n; /* n: starts in all */
    size_t *count;        /* [n_unknowns] 0: stays */
    size_t *same;         /* [n_unknowns] the unknown it moves with (itself: it leads) */
    double (*theta)[GRID_VALUES];
};

/* What is known about an effect's parameter; NULL when the unknown is none of an effect. */
const struct beam_parameter_info *effect_parameter(const struct fit_problem *p, size_t unknown);
/* Neutral is 0 (or ∞), no threshold and no place: the amount of the effect. */
bool is_strength(const struct beam_parameter_info *info);
bool is_position(const struct beam_parameter_info *info);

/*
 * density 1: a few values per parameter (strengths 0.1, 1, 10 of the start in both signs, thresholds likewise, six places);
 * 2: half decades, 0.01 … 1000 for strengths, 0.03 … 30 for thresholds, twelve places; strengths only where `strengths`.
 * Effects before first_effect and from end_effect on stay.
 */
struct start_grid start_grid_new(const struct fit_problem *p, size_t first_effect, size_t end_effect, int density,
                                 bool strengths);
/* Writes start k into theta[n_refs]. */
void start_grid_at(const struct start_grid *grid, const struct fit_problem *p, size_t k, double theta[]);
void start_grid_free(struct start_grid *grid);

#endif
