/* SPDX-License-Identifier: GPL-3.0-or-later */
/* stabilisation_sums.c — spectra of records -> normal equations of a common denominator; the band, and the mean spectrum. */
#include "maths/maths.h"
#include "stabilisation.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    PARTS = 64,          /* of the spectrum up to Nyquist: where the band ends is told part by part */
    PICTURE_LINES = 1200 /* of the mean spectrum */
};
static const double above_noise = 4.0; /* power of a part over its noise, for the band to reach it */
static const double ridge = 1e-11;     /* of the largest diagonal: input and transient can span the same */

/* ---- The band ---- */

/* Power of the lines [from, to) in the unit of a one-sided density, mean over them. */
static double mean_density(const double complex Y[], size_t from, size_t to, size_t n, double dt_s)
{
    double sum = 0.0;
    for (size_t k = from; k < to; k++)
        sum += creal(Y[k]) * creal(Y[k]) + cimag(Y[k]) * cimag(Y[k]);
    return to > from ? sum / (double)(to - from) * 2.0 * dt_s / (double)n : 0.0;
}

/* The upper edge of the highest part of a channel's spectrum that stands above its noise; Nyquist's when that is not known. */
static enum bf_status channel_top(const struct comparison_channel *c, double *top_Hz, struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(c->n, &plan, err);
    const double nyquist_Hz = 0.5 / c->dt_s;
    *top_Hz = nyquist_Hz;
    if (status != BF_OK || c->noise.n_bins < 2)
        return status;
    const size_t half = c->n / 2;
    double complex *Y = bf_alloc(half + 1, sizeof *Y);
    fft_forward(plan, c->measured, Y);
    for (size_t part = PARTS; part > 1; part--) {
        const double from_Hz = nyquist_Hz * (double)(part - 1) / PARTS, to_Hz = nyquist_Hz * (double)part / PARTS;
        const double noise = noise_power(&c->noise, from_Hz, to_Hz) / (to_Hz - from_Hz);
        *top_Hz = to_Hz;
        if (mean_density(Y, half * (part - 1) / PARTS, half * part / PARTS, c->n, c->dt_s) > above_noise * noise)
            break;
    }
    free(Y);
    return status;
}

/* Of all channels the highest top, which no channel's Nyquist frequency is below. */
static enum bf_status find_band(const struct comparison *all, double *to_Hz, struct bf_error *err)
{
    double top_Hz = 0.0, limit_Hz = HUGE_VAL, own_Hz;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < all->n_channels && status == BF_OK; i++)
        if (stabilisation_uses(all, &all->channels[i])) {
            status = channel_top(&all->channels[i], &own_Hz, err);
            top_Hz = fmax(top_Hz, own_Hz);
            limit_Hz = fmin(limit_Hz, 0.5 / all->channels[i].dt_s);
        }
    *to_Hz = fmin(top_Hz, limit_Hz);
    return status;
}

/* ---- Sums ---- */

/* Of one pair of signals, all lags; v^lag by repeated products. The sum of (b, a) at a lag is that of (a, b) at its negative. */
static void sum_pair(const struct stabilisation_lines *l, double to_Hz, const double complex a[],
                     const double complex b[], double sum[2 * STABILISATION_LAGS + 1])
{
    for (size_t k = 1; k <= l->n_lines; k++) {
        const double re = l->weight[k] * (creal(a[k]) * creal(b[k]) + cimag(a[k]) * cimag(b[k]));
        const double im = l->weight[k] * (creal(a[k]) * cimag(b[k]) - cimag(a[k]) * creal(b[k]));
        const double angle = M_PI * (double)k * l->df_Hz / to_Hz, c1 = cos(angle), s1 = sin(angle);
        double c = 1.0, s = 0.0; /* v^lag = c − i s */
        for (size_t lag = 0; lag <= STABILISATION_LAGS; lag++) {
            sum[STABILISATION_LAGS + lag] += re * c + im * s;
            if (lag > 0)
                sum[STABILISATION_LAGS - lag] += re * c - im * s;
            const double next = c * c1 - s * s1;
            s = s * c1 + c * s1;
            c = next;
        }
    }
}

static void sum_channel(const struct stabilisation_lines *l, double to_Hz, struct stabilisation_channel *out)
{
    out->n_signals = l->n_signals;
    for (size_t a = 0; a < l->n_signals; a++)
        for (size_t b = a; b < l->n_signals; b++) {
            sum_pair(l, to_Hz, l->signal[a], l->signal[b], out->sum[a][b]);
            for (size_t lag = 0; b > a && lag <= 2 * STABILISATION_LAGS; lag++)
                out->sum[b][a][lag] = out->sum[a][b][2 * STABILISATION_LAGS - lag];
        }
}

/* The strongest of the lines that fall on each line of the picture, of a channel of power 1, added. */
static void add_to_spectrum(const struct stabilisation_lines *l, struct stabilisation *out)
{
    double total = 0.0;
    for (size_t k = 1; k <= l->n_lines; k++)
        total += pow(cabs(l->signal[0][k]), 2.0);
    double *most = bf_alloc(out->n_lines, sizeof *most);
    for (size_t i = 0; i < out->n_lines; i++) {
        size_t from = (size_t)fmax(1.0, ceil((out->line_Hz[i] - 0.5 * out->line_Hz[0]) / l->df_Hz));
        const size_t to = (size_t)((out->line_Hz[i] + 0.5 * out->line_Hz[0]) / l->df_Hz);
        do
            most[i] = fmax(most[i], from <= l->n_lines ? pow(cabs(l->signal[0][from]), 2.0) / total : 0.0);
        while (++from <= to);
    }
    for (size_t i = 0; i < out->n_lines; i++)
        out->magnitude[i] += most[i];
    free(most);
}

static void lay_spectrum(size_t longest, struct stabilisation *out)
{
    out->n_lines = longest < PICTURE_LINES ? longest : PICTURE_LINES;
    out->line_Hz = bf_alloc(out->n_lines, sizeof *out->line_Hz);
    out->magnitude = bf_alloc(out->n_lines, sizeof *out->magnitude);
    for (size_t i = 0; i < out->n_lines; i++)
        out->line_Hz[i] = out->to_Hz * (double)(i + 1) / (double)out->n_lines;
}

static void finish_spectrum(struct stabilisation *out)
{
    double most = 0.0;
    for (size_t i = 0; i < out->n_lines; i++)
        most = fmax(most, out->magnitude[i]);
    for (size_t i = 0; i < out->n_lines; i++)
        out->magnitude[i] = most > 0.0 ? sqrt(out->magnitude[i] / most) : 0.0;
}

enum bf_status stabilisation_sum(const struct comparison *all, struct stabilisation_sums *sums,
                                 struct stabilisation *out, struct bf_error *err)
{
    struct stabilisation_lines l;
    enum bf_status status = find_band(all, &out->to_Hz, err);
    *sums = (struct stabilisation_sums){.channels = bf_alloc(all->n_channels + 1, sizeof *sums->channels)};
    for (size_t i = 0; i < all->n_channels && status == BF_OK; i++) {
        if (!stabilisation_uses(all, &all->channels[i]))
            continue;
        status = stabilisation_lines_take(all, &all->channels[i], out->to_Hz, &l, err);
        if (status == BF_OK && l.n_lines >= STABILISATION_FEWEST_LINES) {
            if (sums->n == 0)
                lay_spectrum(l.n_lines, out);
            add_to_spectrum(&l, out);
            sum_channel(&l, out->to_Hz, &sums->channels[sums->n++]);
        }
        stabilisation_lines_free(&l);
    }
    finish_spectrum(out);
    return status;
}

void stabilisation_sums_free(struct stabilisation_sums *sums)
{
    free(sums->channels);
    *sums = (struct stabilisation_sums){0};
}

/* ---- Elimination ---- */

/* Gᵢⱼ = sum at lag j − i of the signals that rows and columns are multiples of: Toeplitz blocks of n + 1. */
static double entry(const struct stabilisation_channel *c, size_t n, size_t row, size_t column)
{
    const size_t own = n + 1; /* > 0: NOLINTNEXTLINE(clang-analyzer-core.DivideZero) */
    const size_t a = row / own, b = column / own, i = row % own, j = column % own;
    return c->sum[a][b][STABILISATION_LAGS + j - i];
}

/* M += R_yy − R_yx (R_xx + ridge)⁻¹ R_xy. */
static enum bf_status add_channel(const struct stabilisation_channel *c, size_t n, double M[], struct bf_error *err)
{
    const size_t own = n + 1, others = own * (c->n_signals - 1);
    double *R = bf_alloc(others * others, sizeof *R), *X = bf_alloc(others * own, sizeof *X),
           *S = bf_alloc(others * own, sizeof *S), most = 0.0;
    for (size_t i = 0; i < others; i++) {
        for (size_t j = 0; j < others; j++)
            R[i * others + j] = entry(c, n, own + i, own + j);
        for (size_t j = 0; j < own; j++)
            S[i + j * others] = X[i + j * others] = entry(c, n, own + i, j);
        most = fmax(most, R[i * others + i]);
    }
    for (size_t i = 0; i < others; i++)
        R[i * others + i] += ridge * most;
    const enum bf_status status = dense_cholesky_solve(others, own, R, S, err);
    for (size_t i = 0; i < own; i++)
        for (size_t j = 0; j < own; j++)
            M[i * own + j] += entry(c, n, i, j);
    if (status == BF_OK)
        dense_gemm(true, false, own, own, others, -1.0, X, S, 1.0, M);
    free(R), free(X), free(S);
    return status;
}

enum bf_status stabilisation_reduce(const struct stabilisation_sums *sums, size_t n, double M[], struct bf_error *err)
{
    enum bf_status status = BF_OK;
    memset(M, 0, (n + 1) * (n + 1) * sizeof *M);
    for (size_t i = 0; i < sums->n && status == BF_OK; i++)
        status = add_channel(&sums->channels[i], n, M, err);
    return status;
}
