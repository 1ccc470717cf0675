/* SPDX-License-Identifier: GPL-3.0-or-later */
/* resample.c — band-limited signals moved from one set of times to another, by a windowed sinc. */
#include "maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { HALF_WIDTH = 16, MOST_ITERATIONS = 400 };

static const double window_shape = 9.0; /* Kaiser's β: side lobes below 1e-4, transition of 0.12 of the rate */
static const double converged = 1e-9;   /* of the gradient's norm, from its start */
static const double restraint = 1e-6;   /* of a unit row: what no sample determines stays small */

/* I₀, Abramowitz & Stegun 9.6.12 */
static double bessel(double x)
{
    double term = 1.0, sum = 1.0;
    for (int k = 1; term > 1e-17 * sum; k++) {
        term *= x * x / (4.0 * k * k);
        sum += term;
    }
    return sum;
}

/* u in steps of the uniform signal. */
static double kernel(double u)
{
    const double share = u / HALF_WIDTH;
    if (fabs(share) >= 1.0)
        return 0.0;
    const double sinc = fabs(u) < 1e-9 ? 1.0 : sin(M_PI * u) / (M_PI * u);
    return sinc * bessel(window_shape * sqrt(1.0 - share * share)) / bessel(window_shape);
}

void resample_uniform(const double y[], size_t m, double t0, double dt, const double t[], size_t n, double band,
                      double x[])
{
    const double squeeze = band < 1.0 ? band : 1.0, reach = HALF_WIDTH / squeeze;
    for (size_t j = 0; j < n; j++) {
        const double at = (t[j] - t0) / dt, low = ceil(at - reach), high = floor(at + reach);
        x[j] = 0.0;
        const size_t from = low > 0.0 ? (size_t)low : 0;
        const size_t to = high < 0.0 ? 0 : high < (double)m ? (size_t)high + 1 : m; /* one beyond */
        for (size_t k = from; k < to; k++)
            x[j] += squeeze * kernel(squeeze * (at - (double)k)) * y[k];
    }
}

/* ---- Times that are not uniform ---- */

/* y_j = Σ_k a_jk x_k; grid k = −HALF_WIDTH … n − 1 + HALF_WIDTH, so that the ends are as free as the middle. */
struct rows {
    size_t m, n;   /* samples; points of the grid with its margins */
    size_t *first; /* [m] */
    double *a;     /* [m][2 HALF_WIDTH] */
};

static void rows_new(const double t[], size_t m, double t0, double dt, size_t n, struct rows *out)
{
    enum { WIDTH = 2 * HALF_WIDTH };
    *out = (struct rows){.m = m, .n = n + WIDTH};
    out->first = bf_alloc(m, sizeof *out->first);
    out->a = bf_alloc(m * WIDTH, sizeof *out->a);
    for (size_t j = 0; j < m; j++) {
        const double at = (t[j] - t0) / dt + HALF_WIDTH;
        const double low = fmin(fmax(floor(at) - HALF_WIDTH + 1.0, 0.0), (double)(out->n - WIDTH));
        out->first[j] = (size_t)low;
        for (size_t i = 0; i < WIDTH; i++)
            out->a[j * WIDTH + i] = kernel(at - low - (double)i);
    }
}

static double row_times(const struct rows *r, size_t j, const double x[])
{
    double sum = 0.0;
    for (size_t i = 0; i < 2 * HALF_WIDTH; i++)
        sum += r->a[j * 2 * HALF_WIDTH + i] * x[r->first[j] + i];
    return sum;
}

static void add_row(const struct rows *r, size_t j, double factor, double x[])
{
    for (size_t i = 0; i < 2 * HALF_WIDTH; i++)
        x[r->first[j] + i] += factor * r->a[j * 2 * HALF_WIDTH + i];
}

/* q = (AᵀA + λ) p */
static void normal_times(const struct rows *r, const double p[], double q[])
{
    for (size_t k = 0; k < r->n; k++)
        q[k] = restraint * p[k];
    for (size_t j = 0; j < r->m; j++)
        add_row(r, j, row_times(r, j, p), q);
}

static double dot(size_t n, const double a[], const double b[])
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Conjugate gradients on the normal equations; g: Aᵀy on entry. */
static void solve(const struct rows *r, double g[], double x[])
{
    double *p = bf_alloc(r->n, sizeof *p), *q = bf_alloc(r->n, sizeof *q);
    double size = dot(r->n, g, g);
    const double enough = converged * converged * size;
    memcpy(p, g, r->n * sizeof *p);
    for (int i = 0; i < MOST_ITERATIONS && size > enough; i++) {
        normal_times(r, p, q);
        const double step = size / dot(r->n, p, q), before = size;
        for (size_t k = 0; k < r->n; k++)
            x[k] += step * p[k], g[k] -= step * q[k];
        size = dot(r->n, g, g);
        for (size_t k = 0; k < r->n; k++)
            p[k] = g[k] + size / before * p[k];
    }
    free(p), free(q);
}

double resample_jittered(const double t[], const double y[], size_t m, double t0, double dt, size_t n, double x[])
{
    struct rows r;
    double square = 0.0;
    rows_new(t, m, t0, dt, n, &r);
    double *g = bf_alloc(r.n, sizeof *g), *wide = bf_alloc(r.n, sizeof *wide);
    for (size_t j = 0; j < m; j++)
        add_row(&r, j, y[j], g);
    solve(&r, g, wide);
    for (size_t j = 0; j < m; j++)
        square += pow(y[j] - row_times(&r, j, wide), 2.0);
    memcpy(x, wide + HALF_WIDTH, n * sizeof *x);
    free(g), free(wide), free(r.first), free(r.a);
    return sqrt(square / (double)m);
}
