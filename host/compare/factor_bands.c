/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "factor_pair.h"

#include <math.h>
#include <stdlib.h>

#include "maths/maths.h"

enum { BANDS = 60 };

static const double band_ratio = 1.2599210498948732; /* a third of an octave */
static const double part = 0.01,
                    part_of_peak = 0.001; /* shares of the signal's power with which a band, a peak counts */
/* Correlations of measured and fitted in a band; the last in one without a part, which says as much when it is as good. */
static const double opposed = -0.5, agreed = 0.7, agreed_well = 0.9;
enum { LEAST_BINS = 8 };              /* of a band without a part */
static const double evenness = 1.25;  /* largest over smallest factor of bands that agree */
static const double line_width = 6.0; /* bins; a single line has four under the window, and bands round that up */
static const double least_half_period = 6.0; /* samples: a shorter one is within reach of a delay */

/* One band, from the Nyquist frequency downwards. */
struct band {
    double zz, yy, zy; /* power of measured, of fitted, real part of the cross power */
    double centre;     /* cycles a sample */
    size_t bins;
};

static size_t sum_bands(const double complex *Z, const double complex *Y, size_t bins, struct band band[BANDS])
{
    double high = 0.5;
    size_t n = 0, top = bins;
    for (; n < BANDS && top > 1; n++) {
        const double low = high / band_ratio;
        const size_t from = (size_t)ceil(low / 0.5 * (double)(bins - 1));
        band[n] = (struct band){.centre = sqrt(low * high), .bins = top - (from > 1 ? from : 1)};
        for (size_t k = from > 1 ? from : 1; k < top; k++) {
            band[n].zz += creal(Z[k] * conj(Z[k]));
            band[n].yy += creal(Y[k] * conj(Y[k]));
            band[n].zy += creal(Z[k] * conj(Y[k]));
        }
        top = from > 1 ? from : 1;
        high = low;
    }
    return n;
}

static bool counts(const struct band band[], size_t n, size_t b, double zz, double yy)
{
    const double share = band[b].zz / zz, below = b + 1 < n ? band[b + 1].zz : 0.0,
                 above = b > 0 ? band[b - 1].zz : 0.0;
    const bool peak = band[b].zz > below && band[b].zz > above && share >= part_of_peak;
    return (share >= part || peak) && band[b].yy >= part_of_peak * yy;
}

static void judge(const struct band band[], size_t n, struct factor_bands *out)
{
    double zz = 0.0, yy = 0.0, low = HUGE_VAL, high = 0.0, least = HUGE_VAL, most = 0.0;
    for (size_t b = 0; b < n; b++)
        zz += band[b].zz, yy += band[b].yy;
    for (size_t b = 0; b < n; b++) {
        const bool part_of_it = counts(band, n, b, zz, yy);
        const double correlation = band[b].zy / sqrt(band[b].zz * band[b].yy), factor = band[b].zy / band[b].yy;
        out->turned = out->turned || (part_of_it && correlation < opposed);
        if (!(correlation >= (part_of_it ? agreed : agreed_well)) || (!part_of_it && band[b].bins < LEAST_BINS))
            continue;
        low = fmin(low, band[b].centre), high = fmax(high, band[b].centre);
        least = fmin(least, factor), most = fmax(most, factor);
    }
    out->early = !(low < 0.5 / least_half_period);
    out->even = high >= 2.0 * low && most <= evenness * least;
}

static enum bf_status is_wide(const double u[], size_t n, bool *wide, struct bf_error *err)
{
    const struct fft *plan;
    struct band band[BANDS];
    const size_t size = fft_good_size(n), bins = size / 2 + 1;
    double all = 0.0, low = HUGE_VAL, high = 0.0;
    const enum bf_status status = fft_get(size, &plan, err);
    if (status)
        return status;
    double *x = bf_alloc(size, sizeof *x);
    double complex *U = bf_alloc(bins, sizeof *U);
    window_fill(WINDOW_HANN, n, x); /* a line that does not end with the record would reach octaves without one */
    for (size_t k = 0; k < n; k++)
        x[k] *= u[k];
    fft_forward(plan, x, U);
    const size_t count = sum_bands(U, U, bins, band);
    for (size_t b = 0; b < count; b++)
        all += band[b].zz;
    for (size_t b = 0; b < count; b++)
        if (band[b].zz >= part * all)
            low = fmin(low, band[b].centre), high = fmax(high, band[b].centre);
    *wide = high >= 2.0 * low && high - low > line_width / (double)n;
    free(x), free(U);
    return BF_OK;
}

enum bf_status factor_drive_wide(const struct model *model, const struct record *record, size_t input, bool *wide,
                                 struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *wide = false;
    for (size_t i = 0; i < model->n_inputs && !status && !*wide; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        if (u != NULL && (input == SIZE_MAX || input == i))
            status = is_wide(u, record->n, wide, err);
    }
    return status;
}

enum bf_status factor_bands_judge(const double measured[], const double fitted[], size_t n, struct factor_bands *out,
                                  struct bf_error *err)
{
    const struct fft *plan;
    struct band band[BANDS];
    const size_t size = fft_good_size(2 * n), bins = size / 2 + 1;
    *out = (struct factor_bands){0};
    const enum bf_status status = fft_get(size, &plan, err);
    if (status)
        return status;
    double *x = bf_alloc(size, sizeof *x);
    double complex *Z = bf_alloc(bins, sizeof *Z), *Y = bf_alloc(bins, sizeof *Y);
    for (size_t k = 0; k < n; k++)
        x[k] = measured[k];
    fft_forward(plan, x, Z);
    for (size_t k = 0; k < n; k++)
        x[k] = fitted[k];
    fft_forward(plan, x, Y);
    judge(band, sum_bands(Z, Y, bins, band), out);
    free(x), free(Z), free(Y);
    return BF_OK;
}
