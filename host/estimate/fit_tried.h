/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_tried.h — the points that a fit has passed, and what they are worth on whole records; inside the fit stage only. */
#ifndef BEAMFIT_FIT_TRIED_H
#define BEAMFIT_FIT_TRIED_H

#include "fit_problem.h"

struct tried {
    size_t n, n_refs;
    double *theta;       /* [n][n_refs] */
    double *half_square; /* [n] objective on whole records; NaN: not known yet; HUGE_VAL: there is none */
};

void tried_add(struct tried *tried, const struct fit_problem *p, const double theta[]);
/* The same of x. */
void tried_add_x(struct tried *tried, const struct fit_problem *p, const double x[]);
void tried_free(struct tried *tried);
/* θ[n_refs] of the problem at x, held parameters included. Caller frees. */
double *tried_theta(const struct fit_problem *p, const double x[]);

/*
 * Fills half_square where it is not known, over the rows that the problem uses. Cost: a reduced space and an evaluation each.
 * The problem is left in the stage of whole records, at the last of them.
 */
enum bf_status tried_value(struct tried *tried, struct fit_problem *p, struct bf_error *err);

#endif
