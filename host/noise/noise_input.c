/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_input.h"
#include "linearity_plane.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* Noise over the peak of an input: above, the input never rests; below, its noise is that of a number written in a file. */
static const double rests = 0.1, seen = 1e-6;

/*
 * SEGMENT: samples of one transform; SKIPPED: bins next to 0 that a trend leaks into; LEAST_SEGMENTS: of a record that tells. ROUNDS: of a clipping that ends
 * after ten or so.
 */
enum { SEGMENT = 128, SKIPPED = 3, LEAST_SEGMENTS = 8, ROUNDS = 60 };
/* Cells of noise are below so many times its mean but for e^(−clip) of them; of the lowest cells a tenth begins the search. */
static const double clip = 4.0, begin = 0.1;
/* A floor that is more than this part of the input's rms may be an input that is random itself; so many of the cells must be in it. */
static const double most_floor = 0.03, least_cells = 0.05;

/* Rms of the noise of an input that rests most of the time; 0: none that can be told. */
static double resting_noise(const double *u, size_t n)
{
    double middle, peak = 0.0;
    const double noise = robust_deviation(n, u, &middle);
    for (size_t i = 0; i < n; i++)
        peak = fmax(peak, fabs(u[i] - middle));
    return noise > seen * peak && noise < rests * peak ? noise : 0.0;
}

/* ---- Floor of a spectrogram ---- */

/*
 * cell[*n_cells]: powers of pieces that overlap by half; their mean is the variance of white noise. Hann's window squared: what a drive leaks far is below
 * the noise of any sensor. NULL: there is no plan.
 */
static double *spectrogram_cells(const double *u, size_t n, size_t *n_cells)
{
    struct bf_error ignored;
    double window[SEGMENT], square = 0.0;
    struct linearity_plane plane = {.segment = SEGMENT,
                                    .hop = SEGMENT / 2,
                                    .n_times = 2 * n / SEGMENT,
                                    .n_bins = SEGMENT / 2 + 1,
                                    .window = window};
    if (fft_get(SEGMENT, &plane.plan, &ignored) != BF_OK)
        return NULL;
    window_fill(WINDOW_HANN, SEGMENT, window);
    for (size_t i = 0; i < SEGMENT; i++) {
        window[i] *= window[i];
        square += window[i] * window[i];
    }
    double *cell = bf_alloc(plane.n_times * plane.n_bins, sizeof *cell);
    linearity_spectrogram(&plane, u, n, cell);
    *n_cells = 0;
    for (size_t t = 1; t < plane.n_times; t++) /* the first one begins before the record */
        for (size_t k = SKIPPED; k < SEGMENT / 2; k++)
            cell[(*n_cells)++] = cell[t * plane.n_bins + k] / square;
    return cell;
}

/* Mean of the cells (ascending) that are noise: those below clip times it, whose mean is known too. 0: none. */
static double floor_of_cells(const double cell[], size_t n)
{
    const double kept = 1.0 - clip * exp(-clip) / (1.0 - exp(-clip)); /* mean of an exponential variable below clip */
    double variance = cell[(size_t)(begin * (double)n)] / -log1p(-begin), before = 0.0;
    size_t used = 0;
    for (int k = 0; k < ROUNDS && variance > 0.0 && fabs(variance - before) > 1e-6 * variance; k++) {
        double sum = 0.0;
        for (used = 0; used < n && cell[used] < clip * variance; used++)
            sum += cell[used];
        before = variance;
        variance = used > 0 ? sum / (double)used / kept : 0.0;
    }
    return (double)used >= least_cells * (double)n ? variance : 0.0;
}

/*
 * Rms of the white noise that is seen where a drive is not: a chirp is at one frequency at a time, a multisine leaves bands free, a hammer rests. 0: the
 * record is too short, or all of it is drive. *silent: a tenth of the cells is zero, so that there the input has no noise at all.
 */
static double floor_noise(const double *u, size_t n, bool *silent)
{
    size_t n_cells;
    *silent = false;
    if (n < LEAST_SEGMENTS * SEGMENT)
        return 0.0;
    double *cell = spectrogram_cells(u, n, &n_cells);
    if (cell == NULL)
        return 0.0;
    sort_ascending(n_cells, cell);
    *silent = !(cell[(size_t)(begin * (double)n_cells)] > 0.0);
    const double noise = sqrt(floor_of_cells(cell, n_cells)), rms = root_mean_square(u, n);
    free(cell);
    return noise > seen * rms && noise < most_floor * rms ? noise : 0.0;
}

/* A drive that is on and off by turns rests too seldom for the spread of all its samples to be noise: where it is off says more. */
double noise_of_input(const double *u, size_t n)
{
    bool silent;
    const double floor = floor_noise(u, n, &silent);
    return floor > 0.0 || silent ? floor : resting_noise(u, n);
}

/* psd[n_bins] at 0, df, 2 df …: one-sided, each the mean over the periodogram's bins that are nearest to it. */
static enum bf_status periodogram(const double *x, size_t n, double dt_s, double df_Hz, size_t n_bins, double psd[],
                                  struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(n, &plan, err);
    if (status)
        return status;
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    double *count = bf_alloc(n_bins, sizeof *count);
    fft_forward(plan, x, X);
    for (size_t k = 0; k < n_bins; k++)
        psd[k] = 0.0;
    for (size_t k = 1; k <= n / 2; k++) {
        const size_t bin = (size_t)lround((double)k / ((double)n * dt_s) / df_Hz);
        if (bin >= n_bins)
            continue;
        psd[bin] += 2.0 * dt_s / (double)n * (creal(X[k]) * creal(X[k]) + cimag(X[k]) * cimag(X[k]));
        count[bin] += 1.0;
    }
    for (size_t k = 0; k < n_bins; k++)
        psd[k] = count[k] > 0.0 ? psd[k] / count[k] : k > 0 ? psd[k - 1] : 0.0;
    free(X), free(count);
    return BF_OK;
}

static enum bf_status add_input(const double *u, double noise, size_t n, double dt_s, const double output[],
                                struct noise_estimate *estimate, struct bf_error *err)
{
    double *input = bf_alloc(estimate->n_bins, sizeof *input);
    const enum bf_status status = periodogram(u, n, dt_s, estimate->df_Hz, estimate->n_bins, input, err);
    for (size_t k = 0; k < estimate->n_bins && !status; k++) {
        const double share = input[k] > 0.0 ? fmin(2.0 * dt_s * noise * noise / input[k], 1.0) : 0.0;
        estimate->psd[k] += share * fmax(output[k] - estimate->psd[k], 0.0);
    }
    free(input);
    return status;
}

/*
 * Behind a resonance noise is one amplitude and one phase, whatever the length of the record: of some four resonances, eight numbers, the power is known to
 * √(2/8), the rms to half of that.
 */
static const double resonant_sd = 0.25;

enum bf_status noise_add_inputs(const double *z, const double *const u[], size_t n_inputs, size_t n, double dt_s,
                                struct noise_estimate *estimate, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    double *output = NULL, before = 0.0, after = 0.0;
    for (size_t k = 0; k < estimate->n_bins; k++)
        before += estimate->psd[k];
    for (size_t i = 0; i < n_inputs && before > 0.0 && !status; i++) {
        const double noise = noise_of_input(u[i], n);
        if (!(noise > 0.0))
            continue;
        if (output == NULL) {
            output = bf_alloc(estimate->n_bins, sizeof *output);
            status = periodogram(z, n, dt_s, estimate->df_Hz, estimate->n_bins, output, err);
        }
        if (!status)
            status = add_input(u[i], noise, n, dt_s, output, estimate, err);
    }
    for (size_t k = 0; k < estimate->n_bins && output != NULL; k++)
        after += estimate->psd[k];
    if (output != NULL && !status && after > before) {
        const double share = 1.0 - before / after;
        estimate->rms *= sqrt(after / before);
        estimate->rms_sd = hypot(estimate->rms_sd * sqrt(after / before), resonant_sd * share * estimate->rms);
    }
    free(output);
    return status;
}
