/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "maths.h"
#include "residual_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

double root_mean_square(const double *x, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return n > 0 ? sqrt(sum / (double)n) : 0.0;
}

double residual_nrmse(const double *z, const double *y, size_t n)
{
    double miss = 0.0, size = 0.0;
    for (size_t i = 0; i < n; i++) {
        miss += (z[i] - y[i]) * (z[i] - y[i]);
        size += z[i] * z[i];
    }
    if (size > 0.0)
        return sqrt(miss / size);
    return miss > 0.0 ? HUGE_VAL : 0.0;
}

/* Of the next frequency: so far below it stands the rounding of a free beam's rigid motions, which have no band of their own. */
static const double rigid_motion = 1e-3;

static size_t first_elastic(const double *frequency_Hz, size_t n)
{
    size_t first = 0;
    for (size_t i = 0; i + 1 < n; i++)
        if (frequency_Hz[i] < rigid_motion * frequency_Hz[i + 1])
            first = i + 1;
    return first;
}

size_t residual_band_edges(const double *frequency_Hz, size_t n_frequencies, double dt_s, double *edge_Hz)
{
    const double nyquist = 0.5 / dt_s;
    size_t n = 0;
    edge_Hz[n++] = 0.0;
    for (size_t i = first_elastic(frequency_Hz, n_frequencies); i + 1 < n_frequencies; i++) {
        const double edge = sqrt(frequency_Hz[i] * frequency_Hz[i + 1]);
        if (edge > edge_Hz[n - 1] && frequency_Hz[i + 1] < nyquist)
            edge_Hz[n++] = edge;
    }
    for (int octave = 8; n_frequencies == 0 && octave > 0; octave--)
        edge_Hz[n++] = ldexp(nyquist, -octave);
    edge_Hz[n++] = nyquist;
    return n;
}

void residual_power_bands(const double power[], size_t n, double dt_s, const double *edge_Hz, size_t n_edges,
                          double *share)
{
    double total = 0.0;
    size_t band = 0;
    memset(share, 0, (n_edges - 1) * sizeof *share);
    for (size_t k = 0; k <= n / 2; k++) {
        const double f = (double)k / ((double)n * dt_s);
        const double both = (k == 0 || 2 * k == n ? 1.0 : 2.0) * power[k];
        while (band + 2 < n_edges && f >= edge_Hz[band + 1])
            band++;
        share[band] += both;
        total += both;
    }
    for (size_t i = 0; i + 1 < n_edges && total > 0.0; i++)
        share[i] /= total;
}

enum bf_status residual_power(const double *r, size_t n, double power[], struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(n, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *R = bf_alloc(n / 2 + 1, sizeof *R);
    fft_forward(plan, r, R);
    for (size_t k = 0; k <= n / 2; k++)
        power[k] = creal(R[k] * conj(R[k]));
    free(R);
    return BF_OK;
}

enum bf_status residual_band_shares(const double *r, size_t n, double dt_s, const double *edge_Hz, size_t n_edges,
                                    double *share, struct bf_error *err)
{
    double *power = bf_alloc(n / 2 + 1, sizeof *power);
    const enum bf_status status = residual_power(r, n, power, err);
    if (status == BF_OK)
        residual_power_bands(power, n, dt_s, edge_Hz, n_edges, share);
    free(power);
    return status;
}

void residual_time_shares(const double *r, size_t n, double share[3])
{
    double total = 0.0;
    share[0] = share[1] = share[2] = 0.0;
    for (size_t i = 0; i < n; i++) {
        share[3 * i / n] += r[i] * r[i];
        total += r[i] * r[i];
    }
    for (int i = 0; i < 3 && total > 0.0; i++)
        share[i] /= total;
}

void residual_running_power(const double *z, size_t n, size_t window, double *power)
{
    const size_t half = window / 2;
    double *sum = bf_alloc(n + 1, sizeof *sum);
    for (size_t i = 0; i < n; i++)
        sum[i + 1] = sum[i] + z[i] * z[i];
    for (size_t i = 0; i < n; i++) {
        const size_t from = i > half ? i - half : 0, to = i + half + 1 < n ? i + half + 1 : n;
        power[i] = (sum[to] - sum[from]) / (double)(to - from);
    }
    free(sum);
}

struct ranked {
    double power;
    size_t sample;
};

static int by_power(const void *a, const void *b)
{
    const struct ranked *x = a, *y = b;
    if (x->power > y->power || x->power < y->power)
        return x->power > y->power ? 1 : -1;
    return (x->sample > y->sample) - (x->sample < y->sample);
}

enum bf_status residual_amplitude_shares(const double *z, const double *r, size_t n, size_t window_n,
                                         struct amplitude_shares *out, struct bf_error *err)
{
    *out = (struct amplitude_shares){0};
    if (n < 3)
        return bf_fail(err, BF_NUMERIC, "three amplitudes need at least three samples; got %zu", n);
    double *power = bf_alloc(n, sizeof *power), total = 0.0;
    struct ranked *ranks = bf_alloc(n, sizeof *ranks);
    residual_running_power(z, n, window_n, power);
    for (size_t i = 0; i < n; i++)
        ranks[i] = (struct ranked){power[i], i};
    qsort(ranks, n, sizeof *ranks, by_power);
    double size[3] = {0};
    for (size_t i = 0; i < n; i++) {
        const size_t group = 3 * i / n, t = ranks[i].sample;
        out->share[group] += r[t] * r[t];
        size[group] += z[t] * z[t];
        total += r[t] * r[t];
    }
    for (int i = 0; i < 3; i++) {
        out->relative[i] = size[i] > 0.0 ? sqrt(out->share[i] / size[i]) : 0.0;
        out->share[i] = total > 0.0 ? out->share[i] / total : 0.0;
    }
    free(power);
    free(ranks);
    return BF_OK;
}
