/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Peaks of spectra without phase as lists of frequencies: a fit of them is where a fit of the lines starts, because a resonance that is half its width off has no slope towards
 * where it should be.
 */
#include "line_peaks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double stands_out = 3.0; /* a peak over the lowest line on either side, up to the next higher line */
static const double widest = 0.2;     /* half-power width over frequency */
enum { MOST_PEAKS = 12, SURELY = 5 }; /* SURELY: times the noise that a peak stands above its sides */

/* Lowest of h from k on in direction d, up to a line higher than h[k]. */
static double lowest_beside(const double h[], size_t n, size_t k, int d)
{
    double low = h[k];
    for (size_t i = k + (size_t)d; i < n && h[i] <= h[k]; i += (size_t)d)
        low = fmin(low, h[i]);
    return low;
}

/* Lines from k on in direction d to half the power, between lines; 0: not reached. */
static double half_width(const double h[], size_t n, size_t k, int d)
{
    const double half = h[k] * M_SQRT1_2;
    size_t i = k;
    while (i < n && h[i] > half)
        i += (size_t)d;
    if (i >= n)
        return 0.0;
    const double inside = h[i - (size_t)d];
    return fabs((double)i - (double)k) - (half - h[i]) / (inside - h[i]);
}

/* Top of the parabola through ln h at three lines, in lines from k. */
static double top_of(const double h[], size_t k)
{
    const double a = log(h[k - 1]), b = log(h[k]), c = log(h[k + 1]), bend = a - 2.0 * b + c;
    return bend < 0.0 ? 0.5 * (a - c) / bend : 0.0;
}

static bool is_peak(const double h[], const double sd[], size_t n, size_t k)
{
    if (!(h[k] > h[k - 1] && h[k] >= h[k + 1] && h[k - 1] > 0.0 && h[k + 1] > 0.0))
        return false;
    const double beside = fmax(lowest_beside(h, n, k, -1), lowest_beside(h, n, k, 1));
    return h[k] > stands_out * beside && (sd == NULL || h[k] - beside > SURELY * sd[k]);
}

void line_peaks(const struct record *record, struct record *out)
{
    const double *h = record->columns[0].x, *sd = record->n_columns > 1 ? record->columns[1].x : NULL;
    struct frequency_list list = {.modes = bf_alloc(MOST_PEAKS, sizeof *list.modes)};
    for (size_t k = 1; k + 1 < record->n && list.n < MOST_PEAKS; k++) {
        if (!is_peak(h, sd, record->n, k))
            continue;
        const double width = half_width(h, record->n, k, -1) + half_width(h, record->n, k, 1);
        const double f_Hz = record->t0_s + ((double)k + top_of(h, k)) * record->dt_s;
        const double damping = 0.5 * width * record->dt_s / f_Hz - record_window_rate(record) / (2.0 * M_PI * f_Hz);
        list.modes[list.n++] = (struct measured_frequency){
            .frequency_Hz = f_Hz,
            .damping_ratio = width > 1.0 && damping > 0.0 && 2.0 * damping < widest ? damping : nan("")};
    }
    frequency_list_to_record(&list, record->path, out);
    free(list.modes);
}
