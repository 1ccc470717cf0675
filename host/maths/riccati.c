/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * riccati.c — the steady-state Kalman filter of one sensor, by structure-preserving doubling (Chu, Fan, Lin, Wang 2004): in step k the matrices
 * hold 2^k steps of the Riccati recursion, so that a filter of any memory is found in a few dozen of them.
 */
#include "maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_STEPS = 60 };

struct doubling {
    size_t n;
    double *A, *G, *H;                  /* [n × n] each: transition, information, covariance */
    double *W, *solved, *part, *before; /* scratch of the same size */
};

/* W = I + G H; solved = W⁻¹ [A | G], columns side by side. */
static enum bf_status solve_both(struct doubling *d, struct bf_error *err)
{
    const size_t n = d->n, bytes = n * n * sizeof(double);
    dense_gemm(false, false, n, n, n, 1.0, d->G, d->H, 0.0, d->W);
    for (size_t i = 0; i < n; i++)
        d->W[i + i * n] += 1.0;
    memcpy(d->solved, d->A, bytes);
    memcpy(d->solved + n * n, d->G, bytes);
    return dense_lu_solve(n, 2 * n, d->W, d->solved, err);
}

static void make_symmetric(size_t n, double X[])
{
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < j; i++)
            X[i + j * n] = X[j + i * n] = 0.5 * (X[i + j * n] + X[j + i * n]);
}

/* One doubling; *change is the largest change of H against its largest element. */
static enum bf_status double_once(struct doubling *d, double *change, struct bf_error *err)
{
    const size_t n = d->n, count = n * n;
    if (solve_both(d, err) != BF_OK)
        return err->status;
    double *WA = d->solved, *WG = d->solved + count, size = 0.0;
    memcpy(d->before, d->H, count * sizeof *d->H);
    dense_gemm(false, false, n, n, n, 1.0, d->before, WA, 0.0, d->part); /* H ← H + Aᵀ H W⁻¹ A */
    dense_gemm(true, false, n, n, n, 1.0, d->A, d->part, 1.0, d->H);
    dense_gemm(false, true, n, n, n, 1.0, WG, d->A, 0.0, d->part); /* G ← G + A W⁻¹ G Aᵀ */
    dense_gemm(false, false, n, n, n, 1.0, d->A, d->part, 1.0, d->G);
    dense_gemm(false, false, n, n, n, 1.0, d->A, WA, 0.0, d->part); /* A ← A W⁻¹ A */
    memcpy(d->A, d->part, count * sizeof *d->A);
    make_symmetric(n, d->G);
    make_symmetric(n, d->H);
    *change = 0.0;
    for (size_t i = 0; i < count; i++) {
        *change = fmax(*change, fabs(d->H[i] - d->before[i]));
        size = fmax(size, fabs(d->H[i]));
    }
    *change = size > 0.0 ? *change / size : 0.0;
    return isfinite(*change) ? BF_OK : bf_fail(err, BF_NUMERIC, "the Riccati equation has no solution that is finite");
}

/* K = A P cᵀ / (c P cᵀ + r), A not transposed. */
static void gain_of(size_t n, const double A[], const double c[], double r, struct kalman *out)
{
    double *Pc = bf_alloc(n, sizeof *Pc);
    dense_gemv(false, n, n, 1.0, out->covariance, c, 0.0, Pc);
    out->innovation_variance = dense_dot(n, c, Pc) + r;
    dense_gemv(false, n, n, 1.0 / out->innovation_variance, A, Pc, 0.0, out->gain);
    free(Pc);
}

enum bf_status kalman_steady(size_t n, const double A[], const double c[], const double Q[], double r,
                             struct kalman *out, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    double change = 1.0, *room = bf_alloc(8 * n * n, sizeof *room);
    struct doubling d = {.n = n, .A = room, .G = room + n * n, .H = out->covariance, .W = room + 2 * n * n};
    d.solved = room + 3 * n * n;
    d.part = room + 5 * n * n;
    d.before = room + 6 * n * n;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) { /* the filter's equation is the regulator's of the transposed system */
            d.A[i + j * n] = A[j + i * n];
            d.G[i + j * n] = c[i] * c[j] / r;
        }
    memcpy(d.H, Q, n * n * sizeof *Q);
    for (out->steps = 0; status == BF_OK && change > 1e-15 && out->steps < MOST_STEPS; out->steps++)
        status = double_once(&d, &change, err);
    if (status == BF_OK && change > 1e-10)
        status =
            bf_fail(err, BF_NUMERIC, "the Riccati equation is not solved: the sensor does not see all of the motion");
    if (status == BF_OK)
        gain_of(n, A, c, r, out);
    free(room);
    return status;
}
