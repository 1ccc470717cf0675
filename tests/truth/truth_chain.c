/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From what a sensor sees to samples: sensor and line effects, anti-alias filter, decimation. */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* τ v̇ + v = w with w a line between fine samples, exact; y becomes v, or w − v. At rest before the grid begins. */
static void first_order(double tau_s, double dt_s, size_t n, bool highpass, double *y)
{
    if (!(tau_s > 0))
        return;
    double h = dt_s / tau_s, decay = exp(-h);
    double late = 1 + expm1(-h) / h; /* weight of w at the step's end */
    double v = y[0], before = y[0];
    for (size_t i = 0; i < n; i++) {
        double w = y[i];
        v = decay * v + (1 - decay - late) * before + late * w;
        before = w;
        y[i] = highpass ? w - v : v;
    }
}

/* w(t − d): polynomial of degree 7 through the eight nearest fine samples. */
static void delay(double delay_s, double dt_s, size_t n, double *y)
{
    double shift = delay_s / dt_s, *w = truth_array(n);
    memcpy(w, y, n * sizeof *w);
    for (size_t i = 0; i < n; i++) {
        double position = fmin(fmax((double)i - shift, 0), (double)(n - 1));
        size_t first = position < 4 ? 0 : (size_t)position - 3;
        first = first + 8 > n ? n - 8 : first;
        y[i] = 0;
        for (size_t a = 0; a < 8; a++) {
            double weight = 1;
            for (size_t b = 0; b < 8; b++)
                if (b != a)
                    weight *= (position - (double)(first + b)) / ((double)a - (double)b);
            y[i] += weight * w[first + a];
        }
    }
    free(w);
}

static void apply(const struct truth_effect *effect, const struct truth_grid *grid, const double *drive, double *y)
{
    const double *p = effect->parameter;
    switch (effect->kind) {
    case TRUTH_SENSOR_HIGHPASS:
        first_order(p[0], grid->dt_s, grid->n, true, y);
        break;
    case TRUTH_SENSOR_LAG:
        first_order(p[0], grid->dt_s, grid->n, false, y);
        break;
    case TRUTH_SENSOR_DELAY:
        delay(p[0], grid->dt_s, grid->n, y);
        break;
    default:
        for (size_t i = 0; i < grid->n; i++) {
            double t_s = grid->t0_s + (double)i * grid->dt_s;
            switch (effect->kind) {
            case TRUTH_SENSOR_SATURATION:
                y[i] = isfinite(p[0]) ? p[0] * tanh(y[i] / p[0]) : y[i];
                break;
            case TRUTH_SENSOR_OFFSET:
                y[i] += p[0] + p[1] * t_s;
                break;
            case TRUTH_FEEDTHROUGH:
                y[i] += drive ? p[0] * drive[2 * i] : 0;
                break;
            case TRUTH_MAINS_HUM:
                y[i] += p[0] * sin(2 * TRUTH_PI * p[2] * t_s + p[1]);
                break;
            case TRUTH_SENSOR_QUADRATIC:
                y[i] += p[0] * y[i] * y[i];
                break;
            default:
                break;
            }
        }
    }
}

void truth_chain_apply(const struct truth_spec *spec, size_t output, const struct truth_grid *grid, const double *drive,
                       double *y)
{
    for (size_t e = 0; e < spec->n_effects; e++) {
        const struct truth_effect *effect = &spec->effect[e];
        if (effect->output == TRUTH_ALL_CHANNELS || effect->output == (int)output)
            apply(effect, grid, drive, y);
    }
}

/* One second-order section of a Butterworth low-pass (bilinear, prewarped), pole angle θ: s² + 2 sinθ s + 1. */
static void section(double corner, double theta, size_t n, double *x)
{
    double w = tan(TRUTH_PI * corner); /* corner / rate */
    double d = 1 + 2 * sin(theta) * w + w * w;
    double b = w * w / d, a1 = 2 * (w * w - 1) / d, a2 = (1 - 2 * sin(theta) * w + w * w) / d;
    double s1 = 0, s2 = 0;
    for (size_t i = 0; i < n; i++) {
        double in = x[i], out = b * in + s1;
        s1 = 2 * b * in - a1 * out + s2;
        s2 = b * in - a2 * out;
        x[i] = out;
    }
}

static void reverse(size_t n, double *x)
{
    for (size_t i = 0; i < n / 2; i++) {
        double swap = x[i];
        x[i] = x[n - 1 - i];
        x[n - 1 - i] = swap;
    }
}

void truth_acquire(const struct truth_spec *spec, const struct truth_grid *grid, double *fine, double *record)
{
    double corner = spec->filter_ratio / (double)grid->oversampling;
    for (int pass = 0; pass < 2; pass++) {
        for (size_t k = 0; k < spec->filter_order / 2; k++)
            section(corner, TRUTH_PI * (2 * (double)k + 1) / (2 * (double)spec->filter_order), grid->n, fine);
        if (spec->filter_causal || spec->filter_order == 0)
            break;
        reverse(grid->n, fine);
    }
    for (size_t i = 0; i < grid->n_record; i++)
        record[i] = fine[grid->lead + i * grid->oversampling];
}
