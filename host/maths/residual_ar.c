/* SPDX-License-Identifier: GPL-3.0-or-later */
/* residual_ar.c — autoregressive models of residuals: Burg (1975), Levinson's recursion up and down. */
#include "maths.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* a of order m from a of order m − 1 and the reflection coefficient k: a_i −= k a_{m−i}, a_m = k. a: [AR_MAX]. */
static void levinson_up(double *a, int m, double k)
{
    double old[AR_MAX];
    memcpy(old, a, (size_t)(m - 1) * sizeof *old);
    for (int i = 0; i < m - 1; i++)
        a[i] = old[i] - k * old[m - 2 - i];
    a[m - 1] = k;
}

/* The inverse step. Returns k. */
static double levinson_down(double *a, int m)
{
    const double k = a[m - 1], scale = 1.0 / (1.0 - k * k);
    double old[AR_MAX];
    memcpy(old, a, (size_t)m * sizeof *old);
    for (int i = 0; i < m - 1; i++)
        a[i] = scale * (old[i] + k * old[m - 2 - i]);
    return k;
}

/* One order of Burg's lattice: the reflection coefficient that minimises forward and backward errors together. */
static double burg_step(double *forward, double *backward, size_t n, size_t m)
{
    double top = 0.0, bottom = 0.0;
    for (size_t t = m; t < n; t++) {
        top += forward[t] * backward[t - 1];
        bottom += forward[t] * forward[t] + backward[t - 1] * backward[t - 1];
    }
    const double k = bottom > 0.0 ? 2.0 * top / bottom : 0.0;
    for (size_t t = n - 1; t >= m; t--) {
        const double f = forward[t], b = backward[t - 1];
        forward[t] = f - k * b;
        backward[t] = b - k * f;
    }
    return k;
}

/* Of the variance: a line without noise has no stationary model, and what predicts it better than this is made of rounding errors. */
static const double least_left = 1e-12;

void ar_fit(const double *r, size_t n, struct ar_model *out)
{
    *out = (struct ar_model){0};
    double variance = n > 0 ? root_mean_square(r, n) : 0.0;
    variance *= variance;
    out->sigma = sqrt(variance);
    if (!(variance > 0.0) || !isfinite(variance))
        return;
    const int highest = n / 10 < AR_MAX ? (int)(n / 10) : AR_MAX;
    double *forward = bf_alloc(n, sizeof *forward), *backward = bf_alloc(n, sizeof *backward);
    memcpy(forward, r, n * sizeof *forward);
    memcpy(backward, r, n * sizeof *backward);
    double a[AR_MAX] = {0}, best = (double)n * log(variance);
    const double least = least_left * variance;
    for (int m = 1; m <= highest; m++) {
        const double k = burg_step(forward, backward, n, (size_t)m);
        variance *= 1.0 - k * k;
        if (!(variance > least))
            break;
        levinson_up(a, m, k);
        const double criterion = (double)n * log(variance) + m * log((double)n);
        if (criterion < best) {
            best = criterion;
            out->order = m;
            out->sigma = sqrt(variance);
            memcpy(out->a, a, sizeof a);
        }
    }
    for (int i = out->order; i < AR_MAX; i++)
        out->a[i] = 0.0;
    free(forward);
    free(backward);
}

double ar_psd(const struct ar_model *model, double dt_s, double f_Hz)
{
    double complex sum = 1.0;
    const double w = 2.0 * M_PI * f_Hz * dt_s;
    for (int i = 0; i < model->order; i++)
        sum -= model->a[i] * CMPLX(cos(w * (i + 1)), -sin(w * (i + 1)));
    return 2.0 * dt_s * model->sigma * model->sigma / creal(sum * conj(sum));
}

/* Predictors of every lower order m: a[m] of m coefficients and the standard deviation of their errors. */
struct predictors {
    double a[AR_MAX + 1][AR_MAX], sigma[AR_MAX + 1];
};

static void lower_orders(const struct ar_model *model, struct predictors *p)
{
    double a[AR_MAX], sigma = model->sigma;
    memcpy(a, model->a, sizeof a);
    for (int m = model->order; m >= 0; m--) {
        memcpy(p->a[m], a, (size_t)m * sizeof *a);
        p->sigma[m] = sigma;
        if (m > 0) {
            const double k = levinson_down(a, m);
            sigma /= sqrt(1.0 - k * k);
        }
    }
}

void ar_whiten(const struct ar_model *model, const double *x, size_t n, double *w)
{
    if (!(model->sigma > 0.0)) {
        memmove(w, x, n * sizeof *w);
        return;
    }
    struct predictors p;
    lower_orders(model, &p);
    for (size_t t = n; t-- > 0;) { /* backwards: w may be x */
        const size_t m = t < (size_t)model->order ? t : (size_t)model->order;
        double e = x[t];
        for (size_t i = 0; i < m; i++)
            e -= p.a[m][i] * x[t - 1 - i];
        w[t] = e / p.sigma[m];
    }
}
