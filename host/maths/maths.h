/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * maths.h — mathematics on plain arrays. Section by section:
 *
 *     DENSE, SPARSE    linear algebra: eigenpairs, solves, orthonormal bases
 *     SPLINE           cubic B-splines with edges where the second derivative may jump
 *     SPECTRUM         (maths_spectrum.h) Fourier transforms, amplitude and cross spectra, coherence
 *     LOCAL RATIONAL   (the same) what no linear system can have done, band by band
 *     RESIDUAL         (maths_residual.h) size, colour, whiteness of what a model leaves unexplained, and where it is
 *     OPTIMISE         (maths_optimise.h) least squares within bounds
 *     VECTOR           inner loops for processors with vectors
 */
#ifndef BEAMFIT_MATHS_H
#define BEAMFIT_MATHS_H

#include <complex.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "ground/ground.h"
#include "maths/maths_optimise.h"
#include "maths/maths_residual.h"
#include "maths/maths_spectrum.h"

/*
 * DENSE — dense linear algebra. Only dense.c sees LAPACKE and CBLAS.
 *
 * Every matrix is column-major and packed: A[m][n] (m rows, n columns) has element (i, j) at A[i + j·m].
 * A NULL output is not computed. Functions return BF_NUMERIC when a factorisation fails or an input is not finite
 * where LAPACK would not end or would answer wrongly; inputs are never changed unless marked in/out. Not for sizes above INT_MAX.
 */

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

/* A X = B by Cholesky, A symmetric positive definite (lower triangle read); B[n × n_rhs] in/out. */
enum bf_status dense_cholesky_solve(size_t n, size_t n_rhs, const double A[], double B[], struct bf_error *err);

/* A X = B by LU with pivoting, A any square matrix that is not singular; B[n × n_rhs] in/out. */
enum bf_status dense_lu_solve(size_t n, size_t n_rhs, const double A[], double B[], struct bf_error *err);

/* C[m × n] = α op(A) op(B) + β C, op(X) = X or Xᵀ; k is the inner dimension. β = 0 ignores what C holds. */
void dense_gemm(bool transpose_A, bool transpose_B, size_t m, size_t n, size_t k, double alpha, const double A[],
                const double B[], double beta, double C[]);

/* y = α op(A) x + β y for A[m × n]; x and y have the lengths that op(A) asks for. */
void dense_gemv(bool transpose, size_t m, size_t n, double alpha, const double A[], const double x[], double beta,
                double y[]);

/* a[n] −= Q Qᴴ a for orthonormal columns Q[n × rank]. */
void dense_project_out(size_t n, size_t rank, const double complex Q[], double complex a[]);

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
 * earlier ones to within `tolerance` (relative to the largest) are left out. *rank columns of Q are filled. QA: [n × n] room for
 * QᵀA[rank × n], which A = Q QᵀA is made of again; NULL: not wanted.
 */
enum bf_status dense_orthonormal(size_t m, size_t n, const double A[], double tolerance, double Q[], double QA[],
                                 size_t *rank, struct bf_error *err);

/*
 * Minimum-norm x[n] of min ‖A x − b‖₂ for A[m × n], b[m]; singular values below `tolerance` times the largest count as
 * zero. *rank may be NULL.
 */
enum bf_status dense_least_squares(size_t m, size_t n, const double A[], const double b[], double tolerance, double x[],
                                   size_t *rank, struct bf_error *err);

/*
 * Steady-state Kalman filter of x⁺ = A x + w, y = cᵀx + v with covariances Q[n × n] ≥ 0 and r > 0: P = A P Aᵀ − K s Kᵀ + Q is the prediction's
 * covariance, s = cᵀP c + r the innovation's variance, K = A P c/s the gain of x̂⁺ = A x̂ + K (y − cᵀx̂). A stable filter exists when what is not
 * stable is seen and every motion is shaken. covariance[n × n], gain[n]: the caller's. NUMERIC. O(n³) a step, a few dozen steps.
 */
struct kalman {
    double *covariance, *gain;
    double innovation_variance;
    int steps; /* doublings */
};
enum bf_status kalman_steady(size_t n, const double A[], const double c[], const double Q[], double r,
                             struct kalman *out, struct bf_error *err);

/* SPARSE — sparse factorisation, solves and lowest modes. Only sparse.c sees CHOLMOD and ARPACK. */

struct sparse_factor;

/*
 * Cholesky factor of the symmetric banded matrix A(i, i+d) = band[i·width + d], i = 0 … n−1, d = 0 … width−1.
 * BF_NUMERIC when A is not positive definite or not finite.
 */
enum bf_status sparse_factorise(size_t n, size_t width, const double band[], struct sparse_factor **out,
                                struct bf_error *err);

/* x[n] = A⁻¹ b[n]; x may be b. */
enum bf_status sparse_solve(struct sparse_factor *factor, const double b[], double x[], struct bf_error *err);
void sparse_free(struct sparse_factor *factor);

/*
 * The n_modes lowest eigenpairs of K v = λ M v by shift-invert Lanczos (ARPACK) about `shift` < λ_1: factor holds
 * K − shift·M. values[n_modes] ascend, vectors[n_modes][n] with vᵀMv = 1, largest entry positive. n_modes ≤ n − 2.
 * multiply(context, x, y): y = M x.
 */
enum bf_status sparse_modes(struct sparse_factor *factor, size_t n, size_t n_modes, double shift,
                            void (*multiply)(const void *context, const double x[], double y[]), const void *context,
                            double values[], double vectors[], struct bf_error *err);

/*
 * SPLINE — cubic B-splines on [0, ℓ] whose second derivative may jump at given edges (double knots there).
 * Basis functions are numbered 0 … n−1; at any x at most four of them are not zero.
 */

enum { SPLINE_ORDER = 4 };

struct spline {
    size_t n;       /* basis functions, before any boundary condition */
    size_t n_knots; /* n + 4 */
    double *knots;  /* non-decreasing; 4-fold at both ends, 2-fold at the edges */
};

/* Values and derivatives of the four functions first … first+3 at x: d[k][j] = k-th derivative of function first+j. */
struct spline_values {
    size_t first;
    double d[4][SPLINE_ORDER];
};

/*
 * edges[n_edges]: strictly increasing, inside (0, length_m). About n functions: elements of nearly equal length, at
 * least two between neighbouring edges.
 */
enum bf_status spline_new(double length_m, const double edges[], size_t n_edges, size_t n, struct spline *out,
                          struct bf_error *err);
void spline_free(struct spline *spline);

/* x in [0, ℓ]; at an edge the limit from the right (from the left at ℓ). Cost: about 40 flops. */
void spline_evaluate(const struct spline *spline, double x, struct spline_values *out);

/*
 * VECTOR — inner loops compiled three times, for processors with vectors of 512 bits, of 256 bits and others, chosen when the
 * program starts. Off under the address sanitizer, which must be running before any choice of that kind.
 */

#if defined __x86_64__ && defined __gnu_linux__ && !defined __SANITIZE_ADDRESS__ && !defined __clang__
#define VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define VECTOR_CLONES
#endif
#define VECTOR_INLINE static inline __attribute__((always_inline))

/*
 * Four numbers at once, in functions with VECTOR_CLONES and what is inlined into them; without 256-bit vectors the
 * compiler makes two or four instructions of each. Arrays need no alignment, but a length that is a multiple.
 */
enum { VECTOR_LENGTH = 4 };
typedef double vector_real __attribute__((vector_size(32)));

VECTOR_INLINE size_t vector_round(size_t n)
{
    return (n + VECTOR_LENGTH - 1) / VECTOR_LENGTH * VECTOR_LENGTH;
}

VECTOR_INLINE void vector_load(vector_real *out, const double x[VECTOR_LENGTH])
{
    memcpy(out, x, sizeof *out);
}

VECTOR_INLINE void vector_store(double x[VECTOR_LENGTH], const vector_real *in)
{
    memcpy(x, in, sizeof *in);
}

VECTOR_INLINE double vector_sum(const vector_real *x)
{
    return ((*x)[0] + (*x)[2]) + ((*x)[1] + (*x)[3]);
}

/* Σ a_i b_i; n is a multiple of the length. */
VECTOR_INLINE double vector_dot(size_t n, const double a[], const double b[])
{
    vector_real sum = {0.0};
    for (size_t i = 0; i < n; i += VECTOR_LENGTH) {
        vector_real x, y;
        vector_load(&x, a + i);
        vector_load(&y, b + i);
        sum += x * y;
    }
    return vector_sum(&sum);
}

/*
 * ALIGNMENT — which measured value belongs to which of a model's, when all may be off by one factor (up to 4.5 either way): two ascending lists of
 * positive numbers, in order, values left out on either side. pair[n]: index into model, SIZE_MAX: none is within 10 % once the factor is off.
 * O(n · n_model).
 */
void alignment_find(const double measured[], size_t n, const double model[], size_t n_model, size_t pair[]);
/* Geometric mean of measured/model over the pairs; 1 where there is none. */
double alignment_factor(const double measured[], size_t n, const double model[], const size_t pair[]);

#endif
