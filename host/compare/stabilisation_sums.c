/* SPDX-License-Identifier: GPL-3.0-or-later */
/* stabilisation_sums.c — spectra of records -> normal equations of a common denominator; the band, and the mean spectrum. */
#include "maths/maths.h"
#include "stabilisation.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    FEWEST_LINES = 64,   /* of a channel in the band */
    PARTS = 64,          /* of the spectrum up to Nyquist: where the band ends is told part by part */
    SMOOTHED = 50,       /* the mean about a line is over a fiftieth of the band */
    PICTURE_LINES = 1200 /* of the mean spectrum */
};
static const double above_noise = 4.0;    /* power of a part over its noise, for the band to reach it */
static const double form_error = 1e-3;    /* of the lines about one: what keeps a channel without noise finite */
static const double never_driven = 1e-12; /* of an input's power in the record, relative to the largest: no input */
static const double ridge = 1e-11;        /* of the largest diagonal: input and transient can span the same */

/* One channel in the frequency domain. lines: 1 … n_lines, without the offset. */
struct channel_lines {
    size_t n_lines, n_signals;
    double df_Hz;
    double complex *signal[STABILISATION_SIGNALS]; /* [n_lines + 1]; [1] is 1 */
    double *weight;                                /* [n_lines + 1] */
};

static void channel_lines_free(struct channel_lines *l)
{
    for (size_t s = 0; s < l->n_signals; s++)
        free(l->signal[s]);
    free(l->weight);
}

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

static bool is_used(const struct comparison *all, const struct comparison_channel *c)
{
    return c->record < all->n_records - all->n_held_out && c->n >= 2 * FEWEST_LINES && c->rms > 0.0;
}

/* Of all channels the highest top, which no channel's Nyquist frequency is below. */
static enum bf_status find_band(const struct comparison *all, double *to_Hz, struct bf_error *err)
{
    double top_Hz = 0.0, limit_Hz = HUGE_VAL, own_Hz;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < all->n_channels && status == BF_OK; i++)
        if (is_used(all, &all->channels[i])) {
            status = channel_top(&all->channels[i], &own_Hz, err);
            top_Hz = fmax(top_Hz, own_Hz);
            limit_Hz = fmin(limit_Hz, 0.5 / all->channels[i].dt_s);
        }
    *to_Hz = fmin(top_Hz, limit_Hz);
    return status;
}

/* ---- Spectra of one channel ---- */

static double complex *spectrum_of(const struct fft *plan, const double x[], size_t n)
{
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    fft_forward(plan, x, X);
    return X;
}

static void add_inputs(const struct comparison *all, const struct comparison_channel *c, const struct fft *plan,
                       struct channel_lines *l)
{
    const struct record *record = &all->records[c->record];
    const char *excitation = record_meta(record, "excitation");
    const size_t first = (size_t)(c->measured - record_column(record, c->name));
    const double *input[COMPARE_INPUTS] = {0};
    double power[COMPARE_INPUTS] = {0}, most = 0.0;
    if (excitation != NULL && strcmp(excitation, "free_decay") == 0)
        return;
    for (size_t i = 0; i < all->model->n_inputs && i < COMPARE_INPUTS; i++) {
        input[i] = record_column(record, all->model->inputs[i].name);
        power[i] = input[i] != NULL ? dense_dot(c->n, input[i] + first, input[i] + first) : 0.0;
        most = fmax(most, power[i]);
    }
    for (size_t i = 0; i < COMPARE_INPUTS; i++)
        if (power[i] > never_driven * most)
            l->signal[l->n_signals++] = spectrum_of(plan, input[i] + first, c->n);
}

/* Σ |Y|² of the lines below k at [k]. */
static double *running_power(const double complex Y[], size_t n_lines)
{
    double *sum = bf_alloc(n_lines + 2, sizeof *sum);
    for (size_t k = 1; k <= n_lines; k++)
        sum[k + 1] = sum[k] + creal(Y[k]) * creal(Y[k]) + cimag(Y[k]) * cimag(Y[k]);
    return sum;
}

/* Of |Y|² at line k. */
static double noise_of_line(const struct comparison_channel *c, size_t k, double df_Hz)
{
    if (c->noise.n_bins < 2)
        return 0.0;
    const size_t bin = (size_t)((double)k * df_Hz / c->noise.df_Hz + 0.5);
    return c->noise.psd[bin < c->noise.n_bins ? bin : c->noise.n_bins - 1] * (double)c->n / (2.0 * c->dt_s);
}

/* 1/(noise² + form²) of each line, over their number; form: a share of the mean about the line and a smaller one of all. */
static void find_weights(const struct comparison_channel *c, struct channel_lines *l)
{
    const size_t reach = l->n_lines / SMOOTHED / 2 + 1;
    double *sum = running_power(l->signal[0], l->n_lines);
    const double all = sum[l->n_lines + 1] / (double)l->n_lines;
    l->weight = bf_alloc(l->n_lines + 1, sizeof *l->weight);
    for (size_t k = 1; k <= l->n_lines; k++) {
        const size_t from = k > reach ? k - reach : 1, to = k + reach < l->n_lines ? k + reach : l->n_lines;
        const double near = (sum[to + 1] - sum[from]) / (double)(to + 1 - from);
        const double error = noise_of_line(c, k, l->df_Hz) + form_error * form_error * (near + form_error * all);
        l->weight[k] = 1.0 / (error * (double)l->n_lines);
    }
    free(sum);
}

/* Signals of about the same size, so that one ridge serves all. */
static void scale_signals(struct channel_lines *l)
{
    for (size_t s = 1; s < l->n_signals; s++) {
        double sum = 0.0;
        for (size_t k = 1; k <= l->n_lines; k++)
            sum += l->weight[k] *
                   (creal(l->signal[s][k]) * creal(l->signal[s][k]) + cimag(l->signal[s][k]) * cimag(l->signal[s][k]));
        const double scale = sum > 0.0 ? 1.0 / sqrt(sum) : 0.0;
        for (size_t k = 1; k <= l->n_lines; k++)
            l->signal[s][k] *= scale;
    }
}

static enum bf_status take_lines(const struct comparison *all, const struct comparison_channel *c, double to_Hz,
                                 struct channel_lines *l, struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(c->n, &plan, err);
    *l = (struct channel_lines){.df_Hz = 1.0 / ((double)c->n * c->dt_s)};
    if (status != BF_OK)
        return status;
    const size_t top = (size_t)(to_Hz / l->df_Hz + 1e-9), half = (c->n - 1) / 2;
    l->n_lines = top < half ? top : half;
    l->signal[l->n_signals++] = spectrum_of(plan, c->measured, c->n);
    l->signal[l->n_signals++] = bf_alloc(c->n / 2 + 1, sizeof **l->signal);
    for (size_t k = 0; k <= l->n_lines; k++)
        l->signal[1][k] = 1.0;
    add_inputs(all, c, plan, l);
    find_weights(c, l);
    scale_signals(l);
    return status;
}

/* ---- Sums ---- */

/* Of one pair of signals, all lags; v^lag by repeated products. The sum of (b, a) at a lag is that of (a, b) at its negative. */
static void sum_pair(const struct channel_lines *l, double to_Hz, const double complex a[], const double complex b[],
                     double sum[2 * STABILISATION_LAGS + 1])
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

static void sum_channel(const struct channel_lines *l, double to_Hz, struct stabilisation_channel *out)
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
static void add_to_spectrum(const struct channel_lines *l, struct stabilisation *out)
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
    struct channel_lines l;
    enum bf_status status = find_band(all, &out->to_Hz, err);
    *sums = (struct stabilisation_sums){.channels = bf_alloc(all->n_channels + 1, sizeof *sums->channels)};
    for (size_t i = 0; i < all->n_channels && status == BF_OK; i++) {
        if (!is_used(all, &all->channels[i]))
            continue;
        status = take_lines(all, &all->channels[i], out->to_Hz, &l, err);
        if (status == BF_OK && l.n_lines >= FEWEST_LINES) {
            if (sums->n == 0)
                lay_spectrum(l.n_lines, out);
            add_to_spectrum(&l, out);
            sum_channel(&l, out->to_Hz, &sums->channels[sums->n++]);
        }
        channel_lines_free(&l);
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
