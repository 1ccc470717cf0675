/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_search.h — the global search of a fit, for when the staircase misses the noise floor; private to estimate/. */
#ifndef BEAMFIT_FIT_SEARCH_H
#define BEAMFIT_FIT_SEARCH_H

#include "fit_stages.h"

/* Minima found by a search, best first, each a whole θ[n_refs]: scales of x change between them. */
struct minima {
    size_t n, room;
    double *half_square;
    double *theta; /* [room][n_refs] */
};
struct minima minima_new(size_t room, const struct fit_problem *p);
/* Keeps the best `room` distinct ones: two are the same when ½χ² agrees to 1 % (or 1) and x to 0.1. */
void minima_add(struct minima *minima, const struct fit_problem *p, const double theta[], double half_square);
void minima_free(struct minima *minima);

/*
 * Global stage: scales, signs and places of effect parameters, and a controlled random search (NLopt) over what sets the
 * frequencies, all at the cheapest window; the best few go through the staircase. start: θ[n_refs]. What comes out is added to
 * minima.
 */
enum bf_status search_run(struct fit_problem *p, const struct model *model, const struct staircase *stairs,
                          struct progress *bar, const double start[], struct minima *minima, struct bf_error *err);

#endif
