/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * regression.h — the linear least-squares problem of a motion: W r ≈ W J Δθ + W S a with the priors as rows, where the
 * baseline's Δθ are projected out once, so that each further column costs one product with an orthonormal basis.
 */
#ifndef BEAMFIT_REGRESSION_H
#define BEAMFIT_REGRESSION_H

#include "estimate.h"
#include "motion.h"

struct regression {
    size_t n_rows, n_priors, m; /* m = n_rows + n_priors; priors of parameters, then one that holds the common scale */
    size_t n, rank;             /* unknowns: free parameters, then initial states; directions that the rows determine */
    size_t n_own;               /* free parameters */
    size_t *parameter;          /* [n_own] index into θ */
    double *scale;              /* [n] θ_j = scale_j x_j, columns of unit norm */
    double *A;                  /* [m][n] column-major, weighted */
    double *Q;                  /* [m][rank] orthonormal */
    double *to_x;               /* [n][rank] x = to_x Qᵀ(…) */
    double *b;                  /* [m] weighted residual, priors' distances last */
    double *left;               /* [m] b without its part in the span of A */
    double chi_square;          /* ‖left‖² */
    double *row_weight;         /* [n_rows] */
};

enum bf_status regression_new(const struct motion *motion, struct regression *out, struct bf_error *err);
void regression_free(struct regression *regression);
/* s[m] of a column of rows[n_rows]: weighted, without its part in the span of A. *norm: ‖s‖ before, NULL if not asked. */
void regression_project(const struct regression *regression, const double rows[], double s[], double *norm);
/* theta[] moved by Δθ that fits the residual less `rows` (NULL: nothing), within bounds and by at most a factor e^0.7. */
void regression_move(const struct regression *regression, const struct motion *motion, const double rows[],
                     double theta[]);
/* Number of independent samples in x[n_rows] (weighted rows), from its correlation at a lag of one sample. */
double regression_effective(const struct regression *regression, const struct motion *motion, const double x[]);

#endif
