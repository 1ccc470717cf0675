/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * dense.h — dense linear algebra. Only dense.c sees LAPACKE and CBLAS.
 *
 * Every matrix is column-major and packed: A[m][n] (m rows, n columns) has element (i, j) at A[i + j·m].
 * A NULL output is not computed. Functions return BF_NUMERIC when a factorisation fails or an input is not finite
 * where LAPACK would hang or lie; inputs are never changed unless marked in/out. Not for sizes above INT_MAX.
 */
#ifndef BEAMFIT_DENSE_H
#define BEAMFIT_DENSE_H

#include <complex.h>
#include <stdbool.h>
#include "ground/error.h"

/*
 * K v = λ M v, K symmetric, M symmetric positive definite (NULL: identity); lower triangles are read. values[n]
 * ascend; vectors[n × n] stand in columns with vᵀ M v = 1. O(n³).
 */
enum bf_status dense_symmetric_eigen(size_t n, const double K[], const double M[], double values[], double vectors[],
                                     struct bf_error *err);

/*
 * A v = λ v, uᴴ A = λ uᴴ for a square real A. values[n], left[n × n], right[n × n] in columns, each column of unit
 * 2-norm; conjugate pairs are adjacent, positive imaginary part first. O(n³).
 */
enum bf_status dense_general_eigen(size_t n, const double A[], double complex values[], double complex left[],
                                   double complex right[], struct bf_error *err);

/* A X = B by LU with partial pivoting; B[n × n_rhs] in/out. BF_NUMERIC when A is exactly singular. */
enum bf_status dense_solve(size_t n, size_t n_rhs, const double A[], double B[], struct bf_error *err);
enum bf_status dense_solve_complex(size_t n, size_t n_rhs, const double complex A[], double complex B[],
                                   struct bf_error *err);

/* A X = B by Cholesky, A symmetric positive definite (lower triangle read); B[n × n_rhs] in/out. */
enum bf_status dense_cholesky_solve(size_t n, size_t n_rhs, const double A[], double B[], struct bf_error *err);

/* C[m × n] = α op(A) op(B) + β C, op(X) = X or Xᵀ; k is the inner dimension. β = 0 ignores what C holds. */
void dense_gemm(bool transpose_A, bool transpose_B, size_t m, size_t n, size_t k, double alpha, const double A[],
                const double B[], double beta, double C[]);

/* y = α op(A) x + β y for A[m × n]; x and y have the lengths that op(A) asks for. */
void dense_gemv(bool transpose, size_t m, size_t n, double alpha, const double A[], const double x[], double beta,
                double y[]);

/* G[n × n] = Aᵀ A for A[m × n], both triangles filled. */
void dense_gram(size_t m, size_t n, const double A[], double G[]);

double dense_dot(size_t n, const double x[], const double y[]);
double dense_norm(size_t n, const double x[]); /* 2-norm, safe against overflow */

/*
 * A[m × n] = U diag(s) Vᵀ with s descending. s[min(m, n)], V[n × n] (columns; all n of them, so that those beyond
 * min(m, n) span the null space), U[m × min(m, n)]; U and V may be NULL. O(m n²).
 */
enum bf_status dense_svd(size_t m, size_t n, const double A[], double U[], double s[], double V[],
                         struct bf_error *err);

/* Upper triangle R[n × n] of A = Q R, m ≥ n, zeros below the diagonal. The Gram matrix without squaring: RᵀR = AᵀA. */
enum bf_status dense_qr_triangle(size_t m, size_t n, const double A[], double R[], struct bf_error *err);

/*
 * Orthonormal basis Q[m × n] of the columns of A[m × n], m ≥ n, by QR with column pivoting; columns that depend on
 * earlier ones to within `tolerance` (relative to the largest) are left out. *rank columns of Q are filled.
 */
enum bf_status dense_orthonormal(size_t m, size_t n, const double A[], double tolerance, double Q[], size_t *rank,
                                 struct bf_error *err);

/*
 * Minimum-norm x[n] of min ‖A x − b‖₂ for A[m × n], b[m]; singular values below `tolerance` times the largest count as
 * zero. *rank may be NULL.
 */
enum bf_status dense_least_squares(size_t m, size_t n, const double A[], const double b[], double tolerance, double x[],
                                   size_t *rank, struct bf_error *err);

#endif
