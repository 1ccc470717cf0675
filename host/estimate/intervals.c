/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "intervals.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"

/*
 * With r_t = Σ a_i r_{t−i} + e_t the covariance is C = σ² L⁻¹ L⁻ᵀ, L unit lower triangular with −a_i on its ith
 * subdiagonal: vᵀ C v = σ² ‖u‖², u = L⁻ᵀ v, a recursion from the last sample backwards. In place. later[order]: the first u behind
 * these rows, and then the first of these.
 */
static void colour(const struct ar_model *noise, size_t n, double v[], double later[])
{
    const size_t order = (size_t)noise->order;
    for (size_t k = n; k-- > 0;) {
        double sum = v[k];
        for (size_t i = 0; i < order; i++)
            sum += noise->a[i] * (k + i + 1 < n ? v[k + i + 1] : later[k + i + 1 - n]);
        v[k] = sum;
    }
    for (size_t i = order; i-- > 0;)
        later[i] = i < n ? v[i] : later[i - n];
    for (size_t k = 0; k < n; k++)
        v[k] *= noise->sigma;
}

void intervals_add_block(const struct ar_model *noise, size_t some, size_t n, double V[], double later[], double B[])
{
    double *G = bf_alloc(n * n, sizeof *G);
    for (size_t j = 0; j < n; j++)
        colour(noise, some, V + j * some, later + j * (size_t)noise->order);
    dense_gram(some, n, V, G);
    for (size_t i = 0; i < n * n; i++)
        B[i] += G[i];
    free(G);
}

/* B[n × n] += Jᵀ W C W J of one channel. */
static void add_channel(size_t n_rows, size_t n, const double J[], const double weight[],
                        const struct interval_channel *channel, double B[])
{
    double *V = bf_alloc(channel->n * n, sizeof *V);
    double *later = bf_alloc((size_t)channel->noise.order * n, sizeof *later);
    for (size_t j = 0; j < n; j++) {
        double *v = V + j * channel->n;
        for (size_t k = 0; k < channel->n; k++)
            v[k] = weight[channel->row + k] * J[channel->row + k + j * n_rows];
    }
    intervals_add_block(&channel->noise, channel->n, n, V, later, B);
    free(V), free(later);
}

void intervals_add_coloured(size_t n_rows, size_t n, const double J[], const double weight[], size_t n_channels,
                            const struct interval_channel channels[], double B[])
{
    for (size_t c = 0; c < n_channels; c++)
        add_channel(n_rows, n, J, weight, &channels[c], B);
}

/* X ← basisᵀ X basis, [kept × kept]. */
static void restrict_to(size_t n, size_t kept, const double basis[], const double X[], double out[])
{
    double *half = bf_alloc(n * kept, sizeof *half);
    dense_gemm(false, false, n, kept, n, 1.0, X, basis, 0.0, half);
    dense_gemm(true, false, kept, kept, n, 1.0, basis, half, 0.0, out);
    free(half);
}

/* cov = T (A_k⁻¹ B_k A_k⁻¹) Tᵀ with T = basis. */
static enum bf_status sandwich(size_t n, size_t kept, const double basis[], const double A[], const double B[],
                               double covariance[], struct bf_error *err)
{
    double *Ak = bf_alloc(kept * kept, sizeof *Ak), *X = bf_alloc(kept * kept, sizeof *X);
    double *half = bf_alloc(n * kept, sizeof *half);
    restrict_to(n, kept, basis, A, Ak);
    restrict_to(n, kept, basis, B, X);
    enum bf_status status = dense_cholesky_solve(kept, kept, Ak, X, err); /* A⁻¹ B */
    for (size_t i = 0; i < kept && !status; i++)
        for (size_t j = 0; j < i; j++) {
            const double upper = X[j + i * kept];
            X[j + i * kept] = X[i + j * kept], X[i + j * kept] = upper;
        }
    if (!status)
        status = dense_cholesky_solve(kept, kept, Ak, X, err); /* A⁻¹ (A⁻¹ B)ᵀ */
    if (!status) {
        dense_gemm(false, false, n, kept, kept, 1.0, basis, X, 0.0, half);
        dense_gemm(false, true, n, n, kept, 1.0, half, basis, 0.0, covariance);
    }
    free(Ak), free(X), free(half);
    return status;
}

enum bf_status intervals_covariance(size_t n_rows, size_t n, const double J[], const double weight[],
                                    const double prior_precision[], double form_scale, size_t n_channels,
                                    const struct interval_channel channels[], const double basis[], size_t kept,
                                    double covariance[], struct bf_error *err)
{
    double *coloured = bf_alloc(n * n + 1, sizeof *coloured);
    intervals_add_coloured(n_rows, n, J, weight, n_channels, channels, coloured);
    const enum bf_status status =
        intervals_from_coloured(n_rows, n, J, prior_precision, form_scale, coloured, basis, kept, covariance, err);
    free(coloured);
    return status;
}

enum bf_status intervals_from_coloured(size_t n_rows, size_t n, const double J[], const double prior_precision[],
                                       double form_scale, const double coloured[], const double basis[], size_t kept,
                                       double covariance[], struct bf_error *err)
{
    if (n == 0)
        return BF_OK;
    memset(covariance, 0, n * n * sizeof *covariance);
    double *A = bf_alloc(n * n, sizeof *A), *B = bf_alloc(n * n, sizeof *B), *unit = bf_alloc(n * n, sizeof *unit);
    dense_gram(n_rows, n, J, A);
    for (size_t i = 0; i < n * n; i++)
        B[i] = (form_scale - 1.0) * A[i] + coloured[i];
    for (size_t i = 0; i < n; i++) {
        A[i + i * n] += form_scale * prior_precision[i];
        B[i + i * n] += form_scale * form_scale * prior_precision[i];
        unit[i + i * n] = 1.0;
    }
    const enum bf_status status = sandwich(n, basis ? kept : n, basis ? basis : unit, A, B, covariance, err);
    free(A), free(B), free(unit);
    return status;
}

/* Hill, G. W. (1970), Algorithm 396: Student's t-quantiles, for the tail area 0.05. */
double intervals_student95(double dof)
{
    const double tail = 0.05;
    if (dof < 1.5)
        return 1.0 / tan(tail * M_PI / 2.0);
    if (dof < 2.5)
        return sqrt(2.0 / (tail * (2.0 - tail)) - 2.0);
    const double a = 1.0 / (dof - 0.5), b = 48.0 / (a * a);
    double c = ((20700.0 * a / b - 98.0) * a - 16.0) * a + 96.36;
    const double d = ((94.5 / (b + c) - 3.0) / b + 1.0) * sqrt(a * M_PI / 2.0) * dof;
    double x, y = pow(d * tail, 2.0 / dof);
    if (y > 0.05 + a) {
        x = -1.9599639845400545; /* normal deviate of tail/2 */
        y = x * x;
        if (dof < 5.0)
            c += 0.3 * (dof - 4.5) * (x + 0.6);
        c = (((0.05 * d * x - 5.0) * x - 7.0) * x - 2.0) * x + b + c;
        y = (((((0.4 * y + 6.3) * y + 36.0) * y + 94.5) / c - y - 3.0) / b + 1.0) * x;
        y = expm1(a * y * y);
    } else {
        y = ((1.0 / (((dof + 6.0) / (dof * y) - 0.089 * d - 0.822) * (dof + 2.0) * 3.0) + 0.5 / (dof + 4.0)) * y -
             1.0) *
                (dof + 1.0) / (dof + 2.0) +
            1.0 / y;
    }
    return sqrt(dof * y);
}

void intervals_95(double value, double s, bool logarithmic, double dof, double min, double max, double ci[2])
{
    const double q = intervals_student95(dof);
    ci[0] = logarithmic ? value * exp(-q * s) : value - q * s;
    ci[1] = logarithmic ? value * exp(q * s) : value + q * s;
    ci[0] = fmin(fmax(ci[0], min), value);
    ci[1] = fmax(fmin(ci[1], max), value);
}
