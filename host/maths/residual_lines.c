/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include "ground/ground.h"
#include "maths.h"

enum {
    PADDING = 4, /* bins per resolution */
    AROUND = 40, /* bins to each side that make the background of a bin */
    APART = 8    /* bins between two lines, and between a line and its background */
};

/* power[m/2 + 1] of the windowed residual in units of its scale; *m: of the padded transform. */
static enum bf_status padded_power(const struct residual_channel *c, double **power, size_t *m, struct bf_error *err)
{
    const struct fft *plan;
    *m = fft_good_size(PADDING * c->n);
    *power = NULL;
    const enum bf_status status = fft_get(*m, &plan, err);
    if (status)
        return status;
    double *x = bf_alloc(*m, sizeof *x);
    double complex *X = bf_alloc(*m / 2 + 1, sizeof *X);
    *power = bf_alloc(*m / 2 + 1, sizeof **power);
    window_fill(WINDOW_HANN, c->n, x);
    for (size_t k = 0; k < c->n; k++)
        x[k] *= c->r[k] / c->scale;
    fft_forward(plan, x, X);
    for (size_t k = 0; k <= *m / 2; k++)
        (*power)[k] = creal(X[k] * conj(X[k]));
    free(x), free(X);
    return BF_OK;
}

/* Mean power about bin k of power[n]; 0: nothing is about it. */
static double background(const double power[], size_t n, size_t k)
{
    double around = 0.0, count = 0.0;
    for (size_t i = k > AROUND ? k - AROUND : 0; i <= k + AROUND && i < n; i++) {
        if (i + APART > k && i < k + APART)
            continue;
        around += power[i];
        count += 1.0;
    }
    return count > 0.0 ? around / count : 0.0;
}

/* prominence[k] += how far the residual of a channel stands out of its surroundings at k·df; size[k] += its power there. */
static enum bf_status add_spectrum(const struct residual_channel *c, double df_Hz, size_t bins, double prominence[],
                                   double size[], struct bf_error *err)
{
    size_t m;
    double *power;
    const enum bf_status status = padded_power(c, &power, &m, err);
    for (size_t b = 0; b < bins && !status; b++) {
        const size_t k = (size_t)((double)b * df_Hz * (double)m * c->dt_s + 0.5);
        if (k > m / 2)
            break;
        const double about = background(power, m / 2 + 1, k);
        prominence[b] += about > 0.0 ? power[k] / about : 0.0;
        size[b] += power[k];
    }
    free(power);
    return status;
}

/* The largest bin from `first` on, whose neighbours are not looked at again; 0: there is none. */
static size_t take_peak(size_t first, size_t bins, double score[], double other[])
{
    size_t best = 0;
    for (size_t b = first; b < bins; b++)
        if (score[b] > 0.0 && (best == 0 || score[b] > score[best]))
            best = b;
    for (size_t b = best > APART ? best - APART : 0; best > 0 && b <= best + APART && b < bins; b++)
        score[b] = other[b] = 0.0;
    return best;
}

enum bf_status residual_lines(const struct residual_channel channels[], size_t n_channels, double low_Hz,
                              double high_Hz, size_t most, double lines_Hz[], size_t *n, struct bf_error *err)
{
    double longest_s = 0.0, top_Hz = 0.0;
    *n = 0;
    for (size_t c = 0; c < n_channels; c++) {
        longest_s = fmax(longest_s, (double)channels[c].n * channels[c].dt_s);
        top_Hz = fmax(top_Hz, 0.5 / channels[c].dt_s);
    }
    if (!(longest_s > 0.0))
        return BF_OK;
    const double df_Hz = 1.0 / (PADDING * longest_s);
    const size_t bins = (size_t)(fmin(top_Hz, high_Hz) / df_Hz) + 1;
    const size_t first = (size_t)ceil(fmax(low_Hz, APART * df_Hz) / df_Hz);
    double *score[2] = {bf_alloc(bins, sizeof **score), bf_alloc(bins, sizeof **score)};
    enum bf_status status = BF_OK;
    for (size_t c = 0; c < n_channels && !status; c++)
        status = add_spectrum(&channels[c], df_Hz, bins, score[0], score[1], err);
    while (*n < most && !status) {
        const size_t best = take_peak(first, bins, score[*n % 2], score[(*n + 1) % 2]);
        if (best == 0)
            break;
        lines_Hz[(*n)++] = (double)best * df_Hz;
    }
    free(score[0]), free(score[1]);
    return status;
}
