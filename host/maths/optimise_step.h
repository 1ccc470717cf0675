/* SPDX-License-Identifier: GPL-3.0-or-later */
/* optimise_step.h — the quadratic model min gᵀp + ½ pᵀHp within bounds and a ball; private to maths/. */
#ifndef BEAMFIT_OPTIMISE_STEP_H
#define BEAMFIT_OPTIMISE_STEP_H

#include "maths.h"

#define QUADRATIC_RANK 1e-13 /* unless options say otherwise */

struct quadratic {
    size_t n;
    const double *g, *H, *low, *high; /* low ≤ p ≤ high */
    double radius, rank;
};

/* p[n] of the least value: solve, hold what leaves its bounds at the bound, solve again; at most n rounds. */
enum bf_status quadratic_step(const struct quadratic *q, double p[], struct bf_error *err);
/* −gᵀp − ½ pᵀHp, or 0 where it rises. */
double quadratic_fall(size_t n, const double g[], const double H[], const double p[]);
/* Room to move: low = lower − x, high = upper − x. */
void quadratic_room(const struct least_squares *problem, const double x[], double low[], double high[]);

#endif
