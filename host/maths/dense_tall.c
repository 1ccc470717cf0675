/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Householder's factors of a tall matrix, block by block (Demmel, Grigori, Hoemmen and Langou 2012): the triangle of [R; block] is that of all rows so far, and a block
 * stays in the cache while each of its columns is taken out of the others.
 */
#include "dense_tall.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths.h"

/* Rows at a time: with thirty columns a quarter of a megabyte. */
enum { BLOCK = 1024 };

/* A diagonal element below this share of the first: one pass leaves columns that are orthogonal to 1e-12 and less. */
static const double well_conditioned = 1e-3;

bool tall_is(size_t m, size_t n)
{
    return m > 2 * (size_t)BLOCK && m > 16 * (n + 1);
}

/* The upper triangle of a[rows × n] -> R[n²], zero below. */
static void take_triangle(size_t rows, size_t n, const double a[], double R[])
{
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            R[i + j * n] = i <= j ? a[i + j * rows] : 0.0;
}

int tall_triangle(size_t m, size_t n, const double A[], const double b[], double R[])
{
    const size_t columns = b != NULL ? n + 1 : n, most = columns + BLOCK;
    double *block = bf_alloc(most * columns + 1, sizeof *block), *tau = bf_alloc(columns + 1, sizeof *tau);
    int info = 0;
    memset(R, 0, columns * columns * sizeof *R);
    for (size_t first = 0; first < m && info == 0; first += BLOCK) {
        const size_t count = m - first < BLOCK ? m - first : BLOCK, rows = columns + count;
        for (size_t j = 0; j < columns; j++) {
            memcpy(block + j * rows, R + j * columns, columns * sizeof *R);
            memcpy(block + j * rows + columns, (j < n ? A + j * m : b) + first, count * sizeof *A);
        }
        info = LAPACKE_dgeqrf(LAPACK_COL_MAJOR, (int)rows, (int)columns, block, (int)rows, tau);
        take_triangle(rows, columns, block, R);
    }
    free(block), free(tau);
    return info;
}

size_t pivots_rank(size_t n, size_t ld, const double R[], double tolerance)
{
    size_t rank = 0;
    while (rank < n && fabs(R[rank + rank * ld]) > tolerance * fabs(R[0]))
        rank++;
    return rank;
}

/* Pivots of R[n²], whose factor takes its place; *rank: columns that depend on others less than the tolerance. */
static int pivot_triangle(size_t n, double tolerance, double R[], int pivot[], size_t *rank)
{
    double *tau = bf_alloc(n, sizeof *tau);
    memset(pivot, 0, n * sizeof *pivot);
    const int info = LAPACKE_dgeqp3(LAPACK_COL_MAJOR, (int)n, (int)n, R, (int)n, pivot, tau);
    for (size_t j = 0; j < n; j++)
        memset(R + j * n + j + 1, 0, (n - j - 1) * sizeof *R);
    *rank = info == 0 ? pivots_rank(n, n, R, tolerance) : 0;
    free(tau);
    return info;
}

/* Q ← Q R⁻¹, R[rank × rank] in the corner of n². */
static void divide(size_t m, size_t n, size_t rank, const double R[], double Q[])
{
    cblas_dtrsm(CblasColMajor, CblasRight, CblasUpper, CblasNoTrans, CblasNonUnit, (int)m, (int)rank, 1.0, R, (int)n, Q,
                (int)m);
}

/* Columns that are nearly orthogonal made so to rounding: the factor of Cholesky of their products (Yamamoto et al. 2015), which R[n²] takes. */
static int straighten(size_t m, size_t n, size_t rank, double Q[], double R[])
{
    double *G = bf_alloc(rank * rank, sizeof *G);
    cblas_dsyrk(CblasColMajor, CblasUpper, CblasTrans, (int)rank, (int)m, 1.0, Q, (int)m, 0.0, G, (int)rank);
    const int info = LAPACKE_dpotrf(LAPACK_COL_MAJOR, 'U', (int)rank, G, (int)rank);
    if (info == 0) {
        divide(m, rank, rank, G, Q);
        cblas_dtrmm(CblasColMajor, CblasLeft, CblasUpper, CblasNoTrans, CblasNonUnit, (int)rank, (int)n, 1.0, G,
                    (int)rank, R, (int)n);
    }
    free(G);
    return info;
}

void take_in_order(size_t n, size_t rows, const double R[], const int pivot[], size_t rank, double QA[])
{
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < rank; i++)
            QA[i + (size_t)(pivot[j] - 1) * rank] = i <= j ? R[i + j * rows] : 0.0;
}

int tall_orthonormal(size_t m, size_t n, const double A[], double tolerance, double Q[], double QA[], size_t *rank)
{
    double *R = bf_alloc(n * n, sizeof *R);
    int *pivot = bf_alloc(n, sizeof *pivot), info = tall_triangle(m, n, A, NULL, R);
    if (info == 0)
        info = pivot_triangle(n, tolerance, R, pivot, rank);
    for (size_t j = 0; j < *rank && info == 0; j++)
        memcpy(Q + j * m, A + (size_t)(pivot[j] - 1) * m, m * sizeof *Q);
    if (info == 0 && *rank > 0) {
        divide(m, n, *rank, R, Q);
        if (fabs(R[*rank - 1 + (*rank - 1) * n]) < well_conditioned * fabs(R[0]))
            info = straighten(m, n, *rank, Q, R);
    }
    if (info == 0 && QA != NULL)
        take_in_order(n, n, R, pivot, *rank, QA);
    free(R), free(pivot);
    return info;
}
