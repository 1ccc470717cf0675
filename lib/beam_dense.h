/* SPDX-License-Identifier: MIT */
/* beam_dense.h — small dense algebra of fixed leading dimension BEAM_STATES. Private to lib/. */
#ifndef BEAM_DENSE_H
#define BEAM_DENSE_H

#include "beam.h"

#ifdef BEAM_FLOAT
#define BEAM_EPSILON BEAM_K(1.1920929e-7)
#else
#define BEAM_EPSILON BEAM_K(2.220446049250313e-16)
#endif

typedef beam_real beam_matrix[BEAM_STATES][BEAM_STATES];

#define beam_cholesky               BEAM_NAME(cholesky)
#define beam_lower_solve            BEAM_NAME(lower_solve)
#define beam_lower_transposed_solve BEAM_NAME(lower_transposed_solve)
#define beam_symmetric_eigen        BEAM_NAME(symmetric_eigen)
#define beam_eigenvalues            BEAM_NAME(eigenvalues)
#define beam_complex_solve          BEAM_NAME(complex_solve)
#define beam_real_solve             BEAM_NAME(real_solve)

/* A = LLᵀ in place (lower triangle). 0, or −1 when a pivot is ≤ n ε times its diagonal: not positive definite. */
int beam_cholesky(int n, int stride, beam_real *a);
void beam_lower_solve(int n, int stride, const beam_real *l, beam_real x[]);            /* x ← L⁻¹x */
void beam_lower_transposed_solve(int n, int stride, const beam_real *l, beam_real x[]); /* x ← L⁻ᵀx */

/*
 * Cyclic Jacobi: A = V diag(d) Vᵀ, d ascending; A is destroyed. Relative to √(aᵢᵢaⱼⱼ), so that small eigenvalues of a
 * graded definite matrix are accurate. ≤ 40 sweeps; 0, or −1 when they do not suffice.
 */
int beam_symmetric_eigen(int n, int stride, beam_real *a, beam_real *v, beam_real d[]);

/* Eigenvalues of a real matrix (balancing, Hessenberg form, shifted QR); A is destroyed. 0, or −1. */
int beam_eigenvalues(int n, beam_matrix a, beam_real re[], beam_real im[]);

/* x ← A⁻¹x by Gauss elimination with pivoting; a singular pivot is replaced by ε|A|. A is destroyed. n ≤ BEAM_N. */
void beam_complex_solve(int n, beam_real a_re[BEAM_N][BEAM_N], beam_real a_im[BEAM_N][BEAM_N], beam_real x_re[],
                        beam_real x_im[]);

/* The same for real A of n ≤ BEAM_PORTS; 0, or −1 when singular. */
int beam_real_solve(int n, beam_real a[BEAM_PORTS][BEAM_PORTS], beam_real x[BEAM_PORTS]);

#endif
