/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_search.h — the global search of a fit, for when the staircase misses the noise floor; private to estimate/. */
#ifndef BEAMFIT_FIT_SEARCH_H
#define BEAMFIT_FIT_SEARCH_H

#include "fit_stages.h"

/* Minima found by a search, best first; x of each is [n_unknowns]. */
struct minima {
    size_t n, room;
    double *half_square;
    double *x; /* [room][n_unknowns] */
};
/* Keeps the best `room` distinct ones: two are the same when ½χ² agrees to 1 % (or 1) and x to 0.1. */
void minima_add(struct minima *minima, size_t n_unknowns, const double x[], double half_square);
void minima_free(struct minima *minima);

/*
 * Global stage: scales, signs and places of effect parameters, and a controlled random search (NLopt) over what sets the
 * frequencies, all at the cheapest window; the best few go through the staircase. minima holds all that came out.
 */
enum bf_status search_run(struct fit_problem *p, const struct model *model, const struct staircase *stairs,
                          struct progress *bar, const double start[], struct minima *minima, struct bf_error *err);

#endif
