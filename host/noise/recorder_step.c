/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/*
 * Of the smallest difference between two ascending values, whose last digits a text file has rounded: over ever longer spans, in each of which the last step still
 * counts right.
 */
static double refine_step(const double sorted[], size_t n, double step)
{
    static const double spans[] = {50.0, 1e3, 2e4}; /* steps */
    for (size_t k = 0; k < sizeof spans / sizeof *spans; k++) {
        size_t last = n - 1;
        while (last > 0 && sorted[last] - sorted[0] > spans[k] * step)
            last--;
        const double steps = round((sorted[last] - sorted[0]) / step);
        step = steps >= 1.0 ? (sorted[last] - sorted[0]) / steps : step;
    }
    return step;
}

double recorder_step(const double *z, size_t n)
{
    double *sorted = bf_alloc(n, sizeof *sorted), step = INFINITY;
    memcpy(sorted, z, n * sizeof *sorted);
    sort_ascending(n, sorted);
    for (size_t i = 1; i < n; i++)
        if (sorted[i] > sorted[i - 1])
            step = fmin(step, sorted[i] - sorted[i - 1]);
    const double range = sorted[n - 1] - sorted[0];
    step = isfinite(step) ? refine_step(sorted, n, step) : step;
    bool whole = isfinite(step) && range < 1e5 * step && range > 8.0 * step; /* digits of a text file are no steps */
    for (size_t i = 0; i < n && whole; i++) {
        const double steps = (sorted[i] - sorted[0]) / step;
        whole = fabs(steps - round(steps)) < 0.02 + 1e-4 * steps;
    }
    free(sorted);
    return whole ? step : 0.0;
}
