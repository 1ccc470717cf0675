/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * identifiability.h — which combinations of parameters the records determine, from the singular values of the weighted
 * Jacobian J (rows in units of the noise, columns by ln θ or θ/scale): a direction v with ‖J v‖ < 1 can move by 100 %
 * without leaving the noise. Computed from the data alone, and again with the priors.
 */
#ifndef BEAMFIT_IDENTIFIABILITY_H
#define BEAMFIT_IDENTIFIABILITY_H

#include <stdbool.h>
#include <stdio.h>
#include "ground/error.h"

struct null_direction {
    double ratio;   /* singular value over the largest one; below 1e-9 it is zero to rounding */
    double *weight; /* [n] unit 2-norm, largest element positive; d ln θ (or dθ/scale) along the direction */
    bool pinned;    /* a prior determines it to better than 100 % */
};

struct identifiability {
    size_t n;
    double *singular;  /* [n] descending, of the data rows */
    double *posterior; /* [n] descending, of data and prior rows */
    double *V;         /* [n × n] right singular vectors of data and prior rows, columns */
    size_t kept;       /* leading columns of V that are above rounding: the space in which covariances exist */
    bool *determined;  /* [n] by data and priors, to better than 100 % */
    size_t n_null;
    struct null_direction *null;
};

/*
 * J: [n_rows × n] column-major. prior_precision: [n] diagonal 1/sd², 0 where there is no prior. extent: [n] the move of
 * each unknown that counts as 100 % (1 for logarithms). inflation ≥ 1: how many times larger than the noise the residual
 * is. n_rows < n is allowed. O(n_rows n²). Free with identifiability_free().
 */
enum bf_status identifiability_compute(size_t n_rows, size_t n, const double J[], const double prior_precision[],
                                       const double extent[], double inflation, struct identifiability *out,
                                       struct bf_error *err);
void identifiability_free(struct identifiability *identifiability);

/*
 * One direction in words for a person: which parameters move together or against each other, and what would fix it.
 * labels: [n]. Returns a string to free().
 */
char *identifiability_text(size_t n, const char *const labels[], const struct null_direction *direction);

#endif
