/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Dense linear algebra: the one file that sees LAPACKE and CBLAS. */
#include <complex.h>
#define lapack_complex_double double _Complex
#define lapack_complex_float  float _Complex
#include <cblas.h>
#include <lapacke.h>

#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* M φ = (1/(ω² + σ)) (K + σM) φ rather than K φ = ω² M φ: the largest eigenvalues are the accurate ones, and those
 * are now the lowest modes. σ = 1 rad²/s² makes free beams solvable. */
int truth_normal_modes(size_t n, const double *K, const double *M, size_t count, double *omega_radps, double *shape,
                       char message[TRUTH_MESSAGE])
{
    const double shift = 1, rigid = 1e-2;
    double *a = truth_array(n * n), *b = truth_array(n * n), *w = truth_array(n);
    bool buckled = false;
    memcpy(a, M, n * n * sizeof *a);
    for (size_t i = 0; i < n * n; i++)
        b[i] = K[i] + shift * M[i];
    lapack_int size = (lapack_int)n;
    lapack_int info = LAPACKE_dsygvd(LAPACK_ROW_MAJOR, 1, 'V', 'U', size, a, size, b, size, w);
    for (size_t j = 0; info == 0 && j < count; j++) {
        double inverse = w[n - 1 - j]; /* φᵀ(K + σM)φ = 1, φᵀMφ = 1/(ω² + σ) */
        double omega2 = 1 / inverse - shift;
        buckled = buckled || omega2 < -rigid;
        omega_radps[j] = omega2 > rigid ? sqrt(omega2) : 0;
        for (size_t i = 0; i < n; i++)
            shape[i * count + j] = a[i * n + n - 1 - j] / sqrt(inverse);
    }
    free(a);
    free(b);
    free(w);
    if (info != 0 || buckled)
        return truth_fail(message, "normal modes: the stiffness is not positive (dsygvd %d)", (int)info);
    return 0;
}

/* V from the packed real form of dgeev: a conjugate pair is (re, im) in two columns. */
static void unpack(size_t n, const double *imaginary, const double *packed, double complex *V)
{
    for (size_t j = 0; j < n; j++) {
        bool pair = imaginary[j] > 0 && j + 1 < n;
        for (size_t i = 0; i < n; i++) {
            if (!pair) {
                V[i * n + j] = packed[i * n + j];
            } else {
                V[i * n + j] = CMPLX(packed[i * n + j], packed[i * n + j + 1]);
                V[i * n + j + 1] = conj(V[i * n + j]);
            }
        }
        j += pair ? 1 : 0;
    }
}

int truth_diagonalise(size_t n, const double *A, double complex *lambda, double complex *V, double complex *W,
                      char message[TRUTH_MESSAGE])
{
    double *a = truth_array(n * n), *re = truth_array(n), *im = truth_array(n), *packed = truth_array(n * n);
    double complex *lu = calloc(n * n, sizeof *lu);
    lapack_int *pivot = calloc(n, sizeof *pivot), size = (lapack_int)n, info = -1;
    if (!lu || !pivot)
        abort();
    memcpy(a, A, n * n * sizeof *a);
    info = LAPACKE_dgeev(LAPACK_ROW_MAJOR, 'N', 'V', size, a, size, re, im, NULL, size, packed, size);
    if (info == 0) {
        unpack(n, im, packed, V);
        for (size_t i = 0; i < n; i++) {
            lambda[i] = CMPLX(re[i], im[i]);
            W[i * n + i] = 1;
        }
        memcpy(lu, V, n * n * sizeof *lu);
        info = LAPACKE_zgesv(LAPACK_ROW_MAJOR, size, size, lu, size, pivot, W, size);
    }
    free(a);
    free(re);
    free(im);
    free(packed);
    free(lu);
    free(pivot);
    return info == 0 ? 0 : truth_fail(message, "complex modes: LAPACK reports %d", (int)info);
}

void truth_multiply_add(size_t rows, size_t columns, const double *A, const double *x, double *y)
{
    if (rows > 0 && columns > 0)
        cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)rows, (int)columns, 1, A, (int)columns, x, 1, 1, y, 1);
}

void truth_multiply_add_transposed(size_t rows, size_t columns, const double *A, const double *x, double *y)
{
    if (rows > 0 && columns > 0)
        cblas_dgemv(CblasRowMajor, CblasTrans, (int)rows, (int)columns, 1, A, (int)columns, x, 1, 1, y, 1);
}

int truth_solve_spd(size_t n, double *S, double *b)
{
    return LAPACKE_dposv(LAPACK_ROW_MAJOR, 'U', (lapack_int)n, 1, S, (lapack_int)n, b, 1) == 0 ? 0 : -1;
}
