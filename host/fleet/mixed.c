/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Mean and covariance of a population from estimates with errors of their own: restricted maximum likelihood by EM. */
#include "fleet.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

enum { MOST_STEPS = 2000 };
static const double still = 1e-8; /* relative change of a variance that ends the steps */

/* Of one unit: W = (H Σ Hᵀ + S)⁻¹ spread out to [p × p], rows of what it does not estimate 0. */
static enum bf_status precision_of(const struct fleet_estimates *est, const double spread[], size_t i, double W[],
                                   struct bf_error *err)
{
    const size_t p = est->p;
    const double *x = est->x + i * p, *S = est->S + i * p * p;
    double *V = bf_alloc(p * p, sizeof *V), *inverse = bf_alloc(p * p, sizeof *inverse);
    size_t *at = bf_alloc(p, sizeof *at), q = 0;
    for (size_t k = 0; k < p; k++)
        if (isfinite(x[k]))
            at[q++] = k;
    for (size_t b = 0; b < q; b++) {
        for (size_t a = 0; a < q; a++)
            V[a + b * q] = spread[at[a] + at[b] * p] + S[at[a] + at[b] * p];
        inverse[b + b * q] = 1.0;
    }
    memset(W, 0, p * p * sizeof *W);
    const enum bf_status status = q > 0 ? dense_cholesky_solve(q, q, V, inverse, err) : BF_OK;
    for (size_t b = 0; b < q && status == BF_OK; b++)
        for (size_t a = 0; a < q; a++)
            W[at[a] + at[b] * p] = inverse[a + b * q];
    free(V), free(inverse), free(at);
    return status;
}

static double value_or(double x, double otherwise)
{
    return isfinite(x) ? x : otherwise;
}

/* μ = (Σ W)⁻¹ Σ W x, C = (Σ W)⁻¹ */
static enum bf_status find_mean(const struct fleet_estimates *est, const bool use[], struct fleet_mixed *m,
                                struct bf_error *err)
{
    const size_t p = est->p;
    double *W = bf_alloc(p * p, sizeof *W), *sum = bf_alloc(p * p, sizeof *sum), *right = bf_alloc(p, sizeof *right);
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < est->n && status == BF_OK; i++) {
        if (!use[i])
            continue;
        status = precision_of(est, m->spread, i, W, err);
        for (size_t b = 0; b < p && status == BF_OK; b++)
            for (size_t a = 0; a < p; a++) {
                sum[a + b * p] += W[a + b * p];
                right[a] += W[a + b * p] * value_or(est->x[i * p + b], 0.0);
            }
    }
    memset(m->mean_covariance, 0, p * p * sizeof *m->mean_covariance);
    for (size_t a = 0; a < p; a++)
        m->mean_covariance[a + a * p] = 1.0;
    if (status == BF_OK)
        status = dense_cholesky_solve(p, p, sum, m->mean_covariance, err);
    if (status == BF_OK)
        dense_gemv(false, p, p, 1.0, m->mean_covariance, right, 0.0, m->mean);
    free(W), free(sum), free(right);
    return status;
}

/* sum += u uᵀ − W + W C W with u = W (x − μ) */
static void add_score(const struct fleet_estimates *est, const struct fleet_mixed *m, size_t i, const double W[],
                      double work[], double sum[])
{
    const size_t p = est->p;
    double *e = work, *u = work + p, *CW = work + 2 * p;
    for (size_t a = 0; a < p; a++)
        e[a] = isfinite(est->x[i * p + a]) ? est->x[i * p + a] - m->mean[a] : 0.0;
    dense_gemv(false, p, p, 1.0, W, e, 0.0, u);
    dense_gemm(false, false, p, p, p, 1.0, m->mean_covariance, W, 0.0, CW);
    dense_gemm(false, false, p, p, p, 1.0, W, CW, 1.0, sum);
    for (size_t b = 0; b < p; b++)
        for (size_t a = 0; a < p; a++)
            sum[a + b * p] += u[a] * u[b] - W[a + b * p];
}

/* Σ ← Σ + Σ (1/n Σ_i (u uᵀ − W + W C W)) Σ; *change: the largest relative one of a variance. */
static enum bf_status step_spread(const struct fleet_estimates *est, const bool use[], struct fleet_mixed *m,
                                  double *change, struct bf_error *err)
{
    const size_t p = est->p;
    double *W = bf_alloc(p * p, sizeof *W), *sum = bf_alloc(p * p, sizeof *sum), *half = bf_alloc(p * p, sizeof *half);
    double *work = bf_alloc(2 * p + p * p, sizeof *work);
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < est->n && status == BF_OK; i++) {
        if (!use[i])
            continue;
        status = precision_of(est, m->spread, i, W, err);
        if (status == BF_OK)
            add_score(est, m, i, W, work, sum);
    }
    *change = 0.0;
    dense_gemm(false, false, p, p, p, 1.0 / (double)m->n, sum, m->spread, 0.0, half);
    dense_gemm(false, false, p, p, p, 1.0, m->spread, half, 0.0, W);
    for (size_t b = 0; b < p; b++) {
        *change = fmax(*change, fabs(W[b + b * p]) / m->spread[b + b * p]);
        for (size_t a = 0; a < p; a++)
            half[a + b * p] = m->spread[a + b * p] + 0.5 * (W[a + b * p] + W[b + a * p]);
    }
    memcpy(m->spread, half, p * p * sizeof *half);
    free(W), free(sum), free(half), free(work);
    return status;
}

/* The units' own scatter, parameter by parameter. */
static enum bf_status start(const struct fleet_estimates *est, const bool use[], struct fleet_mixed *m,
                            struct bf_error *err)
{
    const size_t p = est->p;
    for (size_t k = 0; k < p; k++) {
        double sum = 0.0, square = 0.0;
        size_t n = 0;
        for (size_t i = 0; i < est->n; i++)
            if (use[i] && isfinite(est->x[i * p + k]))
                sum += est->x[i * p + k], n++;
        for (size_t i = 0; i < est->n; i++)
            if (use[i] && isfinite(est->x[i * p + k]))
                square += (est->x[i * p + k] - sum / (double)n) * (est->x[i * p + k] - sum / (double)n);
        if (n < 3 || !(square > 0.0))
            return bf_fail(err, BF_NUMERIC, "%s is the same in all units, or known of fewer than 3",
                           est->parameters[k]);
        m->spread[k + k * p] = square / (double)(n - 1);
    }
    return BF_OK;
}

enum bf_status fleet_mixed_fit(const struct fleet_estimates *est, const bool use[], struct fleet_mixed *out,
                               struct bf_error *err)
{
    const size_t p = est->p;
    bool *used = bf_alloc(est->n, sizeof *used);
    *out = (struct fleet_mixed){.mean = bf_alloc(p, sizeof *out->mean),
                                .mean_covariance = bf_alloc(p * p, sizeof *out->mean_covariance),
                                .spread = bf_alloc(p * p, sizeof *out->spread)};
    for (size_t i = 0; i < est->n; i++) {
        for (size_t k = 0; k < p; k++)
            used[i] = used[i] || ((use == NULL || use[i]) && isfinite(est->x[i * p + k]));
        out->n += used[i];
    }
    enum bf_status status = BF_OK;
    if (p == 0 || out->n < p + 2)
        status = bf_fail(err, BF_NUMERIC, "%zu units with estimates are too few for the spread of %zu parameters",
                         out->n, p);
    if (status == BF_OK)
        status = start(est, used, out, err);
    double change = 1.0;
    for (out->iterations = 0; status == BF_OK && out->iterations < MOST_STEPS && change > still; out->iterations++) {
        status = find_mean(est, used, out, err);
        if (status == BF_OK)
            status = step_spread(est, used, out, &change, err);
    }
    if (status == BF_OK)
        status = find_mean(est, used, out, err);
    free(used);
    return status;
}

void fleet_mixed_free(struct fleet_mixed *m)
{
    free(m->mean), free(m->mean_covariance), free(m->spread);
    *m = (struct fleet_mixed){0};
}

enum bf_status fleet_mixed_unit(const struct fleet_estimates *est, const struct fleet_mixed *m, size_t i, double best[],
                                double sd[], double borrowed[], struct bf_error *err)
{
    const size_t p = est->p;
    double *W = bf_alloc(p * p, sizeof *W), *gain = bf_alloc(p * p, sizeof *gain),
           *rest = bf_alloc(p * p, sizeof *rest);
    double *e = bf_alloc(p, sizeof *e);
    const enum bf_status status = precision_of(est, m->spread, i, W, err);
    for (size_t a = 0; a < p; a++)
        e[a] = isfinite(est->x[i * p + a]) ? est->x[i * p + a] - m->mean[a] : 0.0;
    dense_gemm(false, false, p, p, p, 1.0, m->spread, W, 0.0, gain); /* θ = μ + Σ W (x − μ) */
    dense_gemv(false, p, p, 1.0, gain, e, 0.0, best);
    memcpy(rest, m->spread, p * p * sizeof *rest);
    dense_gemm(false, false, p, p, p, -1.0, gain, m->spread, 1.0, rest); /* Σ − Σ W Σ */
    for (size_t a = 0; a < p; a++) {
        best[a] += m->mean[a];
        sd[a] = sqrt(fmax(rest[a + a * p], 0.0));
        borrowed[a] = fmin(fmax(rest[a + a * p] / m->spread[a + a * p], 0.0), 1.0);
    }
    free(W), free(gain), free(rest), free(e);
    return status;
}
