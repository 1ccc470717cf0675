/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_estimate.h"
#include "noise_input.h"
#include "spectrogram.h"

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
    struct spectrogram plane = {.segment = SEGMENT,
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
    spectrogram_power(&plane, u, n, cell);
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

/*
 * A drive that is on and off by turns rests too seldom for the spread of all its samples to be noise: where it is off says more. One that rests
 * exactly has the noise of the recorder's steps while it moves, if there are steps to be seen.
 */
double noise_of_input(const double *u, size_t n)
{
    bool silent;
    const double floor = floor_noise(u, n, &silent);
    if (floor > 0.0)
        return floor;
    return silent ? of_a_sensor(recorder_step(u, n) / sqrt(12.0), u, n, 0.0) : resting_noise(u, n);
}

double noise_of_record_input(const struct record *record, const char *input, const struct column_noise **cells)
{
    const double *u = record_column(record, input);
    *cells = u != NULL ? record_column_noise(record, input) : NULL;
    return u == NULL ? 0.0 : *cells != NULL ? (*cells)->rms : noise_of_input(u, record->n);
}
