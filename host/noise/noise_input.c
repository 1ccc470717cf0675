/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_input.h"
#include "linearity_plane.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* Noise over the peak of an input: above, the input never rests, or is random itself; below, its noise is that of a number written in a file. */
static const double rests = 0.1, seen = 1e-6;

/*
 * SEGMENT: samples of one transform; SKIPPED: bins next to 0 that a trend leaks into; LEAST_SEGMENTS: of a record that tells. ROUNDS: of a clipping that ends
 * after ten or so.
 */
enum { SEGMENT = 128, SKIPPED = 3, LEAST_SEGMENTS = 8, ROUNDS = 60 };
/* Cells of noise are below so many times its mean but for e^(−clip) of them; of the lowest cells a tenth begins the search. */
static const double clip = 4.0, begin = 0.1;
/* So many of the cells must be in a floor. */
static const double least_cells = 0.05;

/* The noise, where it can be that of a sensor; else 0. */
static double of_a_sensor(double noise, const double *u, size_t n, double middle)
{
    double peak = 0.0;
    for (size_t i = 0; i < n; i++)
        peak = fmax(peak, fabs(u[i] - middle));
    return noise > seen * peak && noise < rests * peak ? noise : 0.0;
}

/* Rms of the noise of an input that rests most of the time; 0: none that can be told. */
static double resting_noise(const double *u, size_t n)
{
    double middle;
    const double noise = robust_deviation(n, u, &middle);
    return of_a_sensor(noise, u, n, middle);
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
    const double noise = sqrt(floor_of_cells(cell, n_cells));
    free(cell);
    return of_a_sensor(noise, u, n, 0.0);
}

/* A drive that is on and off by turns rests too seldom for the spread of all its samples to be noise: where it is off says more. */
double noise_of_input(const double *u, size_t n)
{
    bool silent;
    const double floor = floor_noise(u, n, &silent);
    return floor > 0.0 || silent ? floor : resting_noise(u, n);
}

double noise_of_record_input(const struct record *record, const char *input, const struct column_noise **cells)
{
    const double *u = record_column(record, input);
    *cells = u != NULL ? record_column_noise(record, input) : NULL;
    return u == NULL ? 0.0 : *cells != NULL ? (*cells)->rms : noise_of_input(u, record->n);
}

/* ---- As it comes through the beam ---- */

/* |X|²[n/2 + 1] */
static enum bf_status powers(const double *x, size_t n, double **out, struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(n, &plan, err);
    *out = NULL;
    if (status)
        return status;
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    *out = bf_alloc(n / 2 + 1, sizeof **out);
    fft_forward(plan, x, X);
    for (size_t k = 0; k <= n / 2; k++)
        (*out)[k] = creal(X[k]) * creal(X[k]) + cimag(X[k]) * cimag(X[k]);
    free(X);
    return BF_OK;
}

static void add_bins(const struct noise_estimate *estimate, const struct noise_channel_input *input, double rms, size_t n,
                     double dt_s, const double Y[], const double U[], double added[])
{
    const double density = 2.0 * dt_s / (double)n, white = (double)n * rms * rms; /* E|transform|² of white noise */
    double *y = bf_alloc(estimate->n_bins, sizeof *y), *u = bf_alloc(estimate->n_bins, sizeof *u), *c = bf_alloc(estimate->n_bins, sizeof *u);
    for (size_t k = 1; k <= n / 2; k++) {
        const size_t bin = (size_t)lround((double)k / ((double)n * dt_s) / estimate->df_Hz);
        if (bin < estimate->n_bins) y[bin]+=density * Y[k] - estimate->psd[bin], u[bin]+=U[k], c[bin]+=1;
    }
    for (size_t bin = 0; bin < estimate->n_bins; bin++) {
        const double kept = input->cells != NULL ? input_noise_kept(input->cells, (double)bin / (double)(estimate->n_bins-1)) : 1.0;
        if (c[bin]>0 && u[bin] > 0.0)
            added[bin] += fmin(kept * white *c[bin]/ u[bin], 1.0) * y[bin];
    }
    free(y),free(u),free(c);
}

/* Periodogram's bins in each of the estimate's. */
static double bins_in_one(const struct noise_estimate *estimate, size_t n, double dt_s)
{
    return estimate->df_Hz * (double)n * dt_s;
}

static enum bf_status add_input(const struct noise_channel_input *input, size_t n, double dt_s, const double Y[],
                                const struct noise_estimate *estimate, double added[], struct bf_error *err)
{
    const double rms = input->cells != NULL ? input->cells->rms : noise_of_input(input->u, n);
    double *U;
    if (!(rms > 0.0))
        return BF_OK;
    const enum bf_status status = powers(input->u, n, &U, err);
    if (!status)
        add_bins(estimate, input, rms, n, dt_s, Y, U, added);
    free(U);
    return status;
}

/*
 * Takes what was added, never less than nothing in a bin. Behind a resonance noise is one amplitude and one phase, whatever the length of the record: where the power is in N bins, it
 * is known to √(1/N), the rms to half of that.
 */
static void take(struct noise_estimate *estimate, const double added[], double per_bin)
{
    double before = 0.0, sum = 0.0, square = 0.0;
    for (size_t k = 0; k < estimate->n_bins; k++) {
        const double one = fmax(added[k] / per_bin, 0.0);
        before += estimate->psd[k];
        estimate->psd[k] += one;
        sum += one, square += one * one;
    }
    if (!(sum > 0.0) || !(before > 0.0))
        return;
    const double grown = sqrt((before + sum) / before), share = sum / (before + sum);
    estimate->rms *= grown;
    estimate->rms_sd = hypot(estimate->rms_sd * grown, 0.5 * sqrt(square) / sum * share * estimate->rms);
}

enum bf_status noise_add_inputs(const double *z, const struct noise_channel_input inputs[], size_t n_inputs, size_t n,
                                double dt_s, struct noise_estimate *estimate, struct bf_error *err)
{
    double *Y, *added = bf_alloc(estimate->n_bins + 1, sizeof *added);
    enum bf_status status = n_inputs > 0 ? powers(z, n, &Y, err) : BF_OK;
    for (size_t i = 0; i < n_inputs && !status; i++)
        status = add_input(&inputs[i], n, dt_s, Y, estimate, added, err);
    if (n_inputs > 0 && !status)
        take(estimate, added, bins_in_one(estimate, n, dt_s));
    if (n_inputs > 0)
        free(Y);
    free(added);
    return status;
}
