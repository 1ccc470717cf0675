/* SPDX-License-Identifier: GPL-3.0-or-later */
/* dense_solve.h — A x = b by LU factors (LAPACK): what tests of other ways to solve compare with. Matrices are column-major. */
#ifndef BEAMFIT_DENSE_SOLVE_H
#define BEAMFIT_DENSE_SOLVE_H

#include <complex.h>
#include <lapacke.h>
#include <stdlib.h>
#include <string.h>

/* x[n] in/out: b before, the solution afterwards. Fails the test when A[n × n] is singular. */
static inline void dense_solve(size_t n, const double A[], double x[])
{
    double *a = malloc(n * n * sizeof *a);
    lapack_int *pivot = malloc(n * sizeof *pivot);
    memcpy(a, A, n * n * sizeof *a);
    assert_int_equal(LAPACKE_dgesv(LAPACK_COL_MAJOR, (int)n, 1, a, (int)n, pivot, x, (int)n), 0);
    free(a);
    free(pivot);
}

static inline void dense_solve_complex(size_t n, const double complex A[], double complex x[])
{
    double complex *a = malloc(n * n * sizeof *a);
    lapack_int *pivot = malloc(n * sizeof *pivot);
    memcpy(a, A, n * n * sizeof *a);
    assert_int_equal(LAPACKE_zgesv(LAPACK_COL_MAJOR, (int)n, 1, a, (int)n, pivot, x, (int)n), 0);
    free(a);
    free(pivot);
}

#endif
