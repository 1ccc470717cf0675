/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "maths.h"
#include "dense_tall.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool all_finite(size_t count, const double x[])
{
    double sum = 0.0;
    for (size_t i = 0; i < count; i++)
        sum += x[i] * 0.0;
    return sum == 0.0;
}

static double *copy_of(size_t count, const double x[])
{
    double *copy = bf_alloc(count ? count : 1, sizeof *copy);
    memcpy(copy, x, count * sizeof *copy);
    return copy;
}

static enum bf_status failed(struct bf_error *err, const char *routine, int info)
{
    return bf_fail(err, BF_NUMERIC, "dense algebra: %s failed (info %d)", routine, info);
}

static enum bf_status not_finite(struct bf_error *err)
{
    return bf_fail(err, BF_NUMERIC, "dense algebra: a matrix holds a number that is not finite");
}

/*
 * Our matrices are small and the program's threads take records and candidates: BLAS threads would only spin. What is not finite is found here, and LAPACKE need not look
 * for it element by element once more.
 */
__attribute__((constructor)) static void one_thread_each(void)
{
    openblas_set_num_threads(1);
    LAPACKE_set_nancheck(0);
}

enum bf_status dense_symmetric_eigen(size_t n, const double K[], const double M[], double values[], double vectors[],
                                     struct bf_error *err)
{
    if (n == 0)
        return BF_OK;
    if (!all_finite(n * n, K) || (M && !all_finite(n * n, M)))
        return not_finite(err);
    const int order = (int)n;
    const char job = vectors ? 'V' : 'N';
    double *a = copy_of(n * n, K);
    int info;
    if (M) {
        double *b = copy_of(n * n, M);
        info = LAPACKE_dsygvd(LAPACK_COL_MAJOR, 1, job, 'L', order, a, order, b, order, values);
        free(b);
    } else {
        info = LAPACKE_dsyevd(LAPACK_COL_MAJOR, job, 'L', order, a, order, values);
    }
    if (info == 0 && vectors)
        memcpy(vectors, a, n * n * sizeof *a);
    free(a);
    return info ? failed(err, M ? "symmetric eigenproblem (is the mass matrix positive definite?)" : "eigenproblem",
                         info)
                : BF_OK;
}

/* LAPACK stores a conjugate pair's vectors as real and imaginary columns. */
static void unpack_vectors(size_t n, const double imaginary[], const double packed[], double complex out[])
{
    for (size_t j = 0; j < n; j++) {
        const double *re = packed + j * n;
        if (imaginary[j] == 0.0) {
            for (size_t i = 0; i < n; i++)
                out[i + j * n] = re[i];
            continue;
        }
        for (size_t i = 0; i < n; i++) {
            out[i + j * n] = CMPLX(re[i], re[n + i]);
            out[i + (j + 1) * n] = CMPLX(re[i], -re[n + i]);
        }
        j++;
    }
}

enum bf_status dense_general_eigen(size_t n, const double A[], double complex values[], double complex left[],
                                   double complex right[], struct bf_error *err)
{
    if (n == 0)
        return BF_OK;
    if (!all_finite(n * n, A))
        return not_finite(err);
    const int order = (int)n;
    double *a = copy_of(n * n, A), *re = bf_alloc(n, sizeof *re), *im = bf_alloc(n, sizeof *im);
    double *vl = left ? bf_alloc(n * n, sizeof *vl) : NULL, *vr = right ? bf_alloc(n * n, sizeof *vr) : NULL;
    const int info = LAPACKE_dgeev(LAPACK_COL_MAJOR, left ? 'V' : 'N', right ? 'V' : 'N', order, a, order, re, im, vl,
                                   left ? order : 1, vr, right ? order : 1);
    if (info == 0) {
        for (size_t i = 0; i < n; i++)
            values[i] = CMPLX(re[i], im[i]);
        if (left)
            unpack_vectors(n, im, vl, left);
        if (right)
            unpack_vectors(n, im, vr, right);
    }
    free(a), free(re), free(im), free(vl), free(vr);
    return info ? failed(err, "general eigenproblem", info) : BF_OK;
}

enum bf_status dense_cholesky_solve(size_t n, size_t n_rhs, const double A[], double B[], struct bf_error *err)
{
    if (n == 0 || n_rhs == 0)
        return BF_OK;
    if (!all_finite(n * n, A) || !all_finite(n * n_rhs, B))
        return not_finite(err);
    double *a = copy_of(n * n, A);
    const int info = LAPACKE_dposv(LAPACK_COL_MAJOR, 'L', (int)n, (int)n_rhs, a, (int)n, B, (int)n);
    free(a);
    return info ? failed(err, "Cholesky (matrix is not positive definite)", info) : BF_OK;
}

enum bf_status dense_lu_solve(size_t n, size_t n_rhs, const double A[], double B[], struct bf_error *err)
{
    if (n == 0 || n_rhs == 0)
        return BF_OK;
    if (!all_finite(n * n, A) || !all_finite(n * n_rhs, B))
        return not_finite(err);
    double *a = copy_of(n * n, A);
    lapack_int *pivot = bf_alloc(n, sizeof *pivot);
    const int info = LAPACKE_dgesv(LAPACK_COL_MAJOR, (int)n, (int)n_rhs, a, (int)n, pivot, B, (int)n);
    free(a);
    free(pivot);
    return info ? failed(err, "LU (matrix is singular)", info) : BF_OK;
}

void dense_gemm(bool transpose_A, bool transpose_B, size_t m, size_t n, size_t k, double alpha, const double A[],
                const double B[], double beta, double C[])
{
    if (m == 0 || n == 0)
        return;
    const int lda = (int)(transpose_A ? k : m), ldb = (int)(transpose_B ? n : k);
    cblas_dgemm(CblasColMajor, transpose_A ? CblasTrans : CblasNoTrans, transpose_B ? CblasTrans : CblasNoTrans, (int)m,
                (int)n, (int)k, alpha, A, lda > 0 ? lda : 1, B, ldb > 0 ? ldb : 1, beta, C, (int)m);
}

void dense_gemv(bool transpose, size_t m, size_t n, double alpha, const double A[], const double x[], double beta,
                double y[])
{
    if (m == 0 || n == 0)
        return;
    cblas_dgemv(CblasColMajor, transpose ? CblasTrans : CblasNoTrans, (int)m, (int)n, alpha, A, (int)m, x, 1, beta, y,
                1);
}

void dense_project_out(size_t n, size_t rank, const double complex Q[], double complex a[])
{
    static const double complex one = 1.0, minus_one = -1.0, zero = 0.0;
    double complex *c = bf_alloc(rank + 1, sizeof *c);
    if (n > 0 && rank > 0) {
        cblas_zgemv(CblasColMajor, CblasConjTrans, (int)n, (int)rank, &one, Q, (int)n, a, 1, &zero, c, 1);
        cblas_zgemv(CblasColMajor, CblasNoTrans, (int)n, (int)rank, &minus_one, Q, (int)n, c, 1, &one, a, 1);
    }
    free(c);
}

void dense_gram(size_t m, size_t n, const double A[], double G[])
{
    if (n == 0)
        return;
    if (m == 0) {
        memset(G, 0, n * n * sizeof *G);
        return;
    }
    cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, (int)n, (int)m, 1.0, A, (int)m, 0.0, G, (int)n);
    for (size_t j = 0; j < n; j++)
        for (size_t i = j + 1; i < n; i++)
            G[j + i * n] = G[i + j * n];
}

double dense_dot(size_t n, const double x[], const double y[])
{
    return cblas_ddot((int)n, x, 1, y, 1);
}

double dense_norm(size_t n, const double x[])
{
    return cblas_dnrm2((int)n, x, 1);
}

enum bf_status dense_svd(size_t m, size_t n, const double A[], double U[], double s[], double V[], struct bf_error *err)
{
    if (m == 0 || n == 0)
        return BF_OK;
    if (!all_finite(m * n, A))
        return not_finite(err);
    const size_t least = m < n ? m : n;
    double *a = copy_of(m * n, A), *vt = V ? bf_alloc(n * n, sizeof *vt) : NULL, *work = bf_alloc(least, sizeof *work);
    const int info = LAPACKE_dgesvd(LAPACK_COL_MAJOR, U ? 'S' : 'N', V ? 'A' : 'N', (int)m, (int)n, a, (int)m, s, U,
                                    (int)m, vt, (int)n, work);
    if (info == 0 && V)
        for (size_t j = 0; j < n; j++)
            for (size_t i = 0; i < n; i++)
                V[i + j * n] = vt[j + i * n];
    free(a), free(vt), free(work);
    return info ? failed(err, "singular values", info) : BF_OK;
}

enum bf_status dense_qr_triangle(size_t m, size_t n, const double A[], double R[], struct bf_error *err)
{
    if (m < n)
        return bf_fail(err, BF_NUMERIC, "dense algebra: QR needs as many rows (%zu) as columns (%zu)", m, n);
    if (n == 0)
        return BF_OK;
    if (!all_finite(m * n, A))
        return not_finite(err);
    if (tall_is(m, n)) {
        const int failure = tall_triangle(m, n, A, NULL, R);
        return failure ? failed(err, "QR", failure) : BF_OK;
    }
    double *a = copy_of(m * n, A), *tau = bf_alloc(n, sizeof *tau);
    const int info = LAPACKE_dgeqrf(LAPACK_COL_MAJOR, (int)m, (int)n, a, (int)m, tau);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            R[i + j * n] = i <= j ? a[i + j * m] : 0.0;
    free(a), free(tau);
    return info ? failed(err, "QR", info) : BF_OK;
}

enum bf_status dense_orthonormal(size_t m, size_t n, const double A[], double tolerance, double Q[], double QA[],
                                 size_t *rank, struct bf_error *err)
{
    *rank = 0;
    if (m < n)
        return bf_fail(err, BF_NUMERIC, "dense algebra: a basis needs as many rows (%zu) as columns (%zu)", m, n);
    if (n == 0)
        return BF_OK;
    if (!all_finite(m * n, A))
        return not_finite(err);
    if (tall_is(m, n)) {
        const int failure = tall_orthonormal(m, n, A, tolerance, Q, QA, rank);
        return failure ? failed(err, "QR with pivoting", failure) : BF_OK;
    }
    double *tau = bf_alloc(n, sizeof *tau);
    int *pivot = bf_alloc(n, sizeof *pivot);
    memset(pivot, 0, n * sizeof *pivot);
    memmove(Q, A, m * n * sizeof *Q);
    int info = LAPACKE_dgeqp3(LAPACK_COL_MAJOR, (int)m, (int)n, Q, (int)m, pivot, tau);
    if (info == 0) {
        *rank = pivots_rank(n, m, Q, tolerance);
        if (QA != NULL)
            take_in_order(n, m, Q, pivot, *rank, QA);
        if (*rank > 0)
            info = LAPACKE_dorgqr(LAPACK_COL_MAJOR, (int)m, (int)*rank, (int)*rank, Q, (int)m, tau);
    }
    free(tau), free(pivot);
    return info ? failed(err, "QR with pivoting", info) : BF_OK;
}

/* The triangle of a tall system has all that its rows tell of the unknowns. */
static enum bf_status tall_least_squares(size_t m, size_t n, const double A[], const double b[], double tolerance,
                                         double x[], size_t *rank, struct bf_error *err)
{
    const size_t columns = n + 1;
    double *R = bf_alloc(columns * columns, sizeof *R), *square = bf_alloc(n * n, sizeof *square);
    const int info = tall_triangle(m, n, A, b, R);
    for (size_t j = 0; j < n; j++)
        memcpy(square + j * n, R + j * columns, n * sizeof *R);
    const enum bf_status status = info ? failed(err, "least squares", info)
                                       : dense_least_squares(n, n, square, R + n * columns, tolerance, x, rank, err);
    free(R), free(square);
    return status;
}

enum bf_status dense_least_squares(size_t m, size_t n, const double A[], const double b[], double tolerance, double x[],
                                   size_t *rank, struct bf_error *err)
{
    if (rank)
        *rank = 0;
    memset(x, 0, n * sizeof *x);
    if (m == 0 || n == 0)
        return BF_OK;
    if (!all_finite(m * n, A) || !all_finite(m, b))
        return not_finite(err);
    if (tall_is(m, n))
        return tall_least_squares(m, n, A, b, tolerance, x, rank, err);
    const size_t most = m > n ? m : n;
    double *a = copy_of(m * n, A), *rhs = bf_alloc(most, sizeof *rhs), *s = bf_alloc(m < n ? m : n, sizeof *s);
    memcpy(rhs, b, m * sizeof *rhs);
    int found = 0;
    const int info =
        LAPACKE_dgelsd(LAPACK_COL_MAJOR, (int)m, (int)n, 1, a, (int)m, rhs, (int)most, s, tolerance, &found);
    if (info == 0)
        memcpy(x, rhs, n * sizeof *x);
    if (info == 0 && rank)
        *rank = (size_t)found;
    free(a), free(rhs), free(s);
    return info ? failed(err, "least squares", info) : BF_OK;
}
