/* SPDX-License-Identifier: GPL-3.0-or-later */
/* dense_tall.h — factors of matrices with many more rows than columns; private to maths/. */
#ifndef BEAMFIT_DENSE_TALL_H
#define BEAMFIT_DENSE_TALL_H

#include <stdbool.h>
#include <stddef.h>

/* So many more rows than columns that a triangle block by block is quicker than one of the whole matrix. */
bool tall_is(size_t m, size_t n);
/* R[columns²] of [A b], with columns = n + 1, or of A[m × n] where b is NULL. Returns LAPACK's info. Memory: a block of rows. */
int tall_triangle(size_t m, size_t n, const double A[], const double b[], double R[]);
/* dense_orthonormal() of a finite A. Returns LAPACK's info. */
int tall_orthonormal(size_t m, size_t n, const double A[], double tolerance, double Q[], double QA[], size_t *rank);
/* Columns of R[ld × n], of a factor with pivots, that depend on those before less than the tolerance. */
size_t pivots_rank(size_t n, size_t ld, const double R[], double tolerance);
/* A P = Q R, R upper in the corner of R[rows × n] -> QA[rank × n] in the order of A. */
void take_in_order(size_t n, size_t rows, const double R[], const int pivot[], size_t rank, double QA[]);

#endif
