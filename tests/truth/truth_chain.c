/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From what a sensor sees to samples: sensor and line effects, anti-alias filter, decimation. */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* τ v̇ + v = w with w a line between fine samples, exact; gives v, or w − v. */
static double first_order(double tau_s, double dt_s, bool highpass, struct truth_link *link, double w)
{
    if (!(tau_s > 0))
        return w;
    double h = dt_s / tau_s, decay = exp(-h);
    double late = 1 + expm1(-h) / h; /* weight of w at the step's end */
    link->v = decay * link->v + (1 - decay - late) * link->before + late * w;
    link->before = w;
    return highpass ? w - link->v : link->v;
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

double truth_link_step(const struct truth_effect *effect, struct truth_link *link, double dt_s, double t_s,
                       double drive, double w)
{
    const double *p = effect->parameter;
    switch (effect->kind) {
    case TRUTH_SENSOR_HIGHPASS:
        return first_order(p[0], dt_s, true, link, w);
    case TRUTH_SENSOR_LAG:
        return first_order(p[0], dt_s, false, link, w);
    case TRUTH_SENSOR_SATURATION:
        return isfinite(p[0]) ? p[0] * truth_curve(p[1], w / p[0]) : w;
    case TRUTH_SENSOR_OFFSET:
        return w + (p[0] + p[1] * t_s);
    case TRUTH_FEEDTHROUGH:
        return w + p[0] * drive;
    case TRUTH_MAINS_HUM:
        return w + p[0] * sin(2 * TRUTH_PI * p[2] * t_s + p[1]);
    case TRUTH_SENSOR_QUADRATIC:
        return w + p[0] * w * w;
    default:
        return w;
    }
}

static void apply(const struct truth_effect *effect, const struct truth_grid *grid, const double *drive, double *y)
{
    struct truth_link link = {y[0], y[0]}; /* at rest before the grid begins */
    if (effect->kind == TRUTH_SENSOR_DELAY) {
        delay(effect->parameter[0], grid->dt_s, grid->n, y);
        return;
    }
    for (size_t i = 0; i < grid->n; i++)
        y[i] = truth_link_step(effect, &link, grid->dt_s, grid->t0_s + (double)i * grid->dt_s, drive ? drive[2 * i] : 0,
                               y[i]);
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

double truth_section_step(struct truth_section *s, double in)
{
    double out = s->b * in + s->s1;
    s->s1 = 2 * s->b * in - s->a1 * out + s->s2;
    s->s2 = s->b * in - s->a2 * out;
    return out;
}

/* Butterworth by the bilinear transform, prewarped. */
size_t truth_filter_make(const struct truth_spec *spec, size_t oversampling,
                         struct truth_section section[TRUTH_SECTIONS])
{
    double corner = spec->filter_ratio / (double)oversampling, w = tan(TRUTH_PI * corner);
    size_t n = spec->filter_order / 2;
    for (size_t k = 0; k < n; k++) {
        double theta = TRUTH_PI * (2 * (double)k + 1) / (2 * (double)spec->filter_order);
        double d = 1 + 2 * sin(theta) * w + w * w;
        section[k] = (struct truth_section){
            .b = w * w / d, .a1 = 2 * (w * w - 1) / d, .a2 = (1 - 2 * sin(theta) * w + w * w) / d};
    }
    return n;
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
    for (int pass = 0; pass < 2; pass++) {
        struct truth_section section[TRUTH_SECTIONS];
        size_t sections = truth_filter_make(spec, grid->oversampling, section);
        for (size_t k = 0; k < sections; k++)
            for (size_t i = 0; i < grid->n; i++)
                fine[i] = truth_section_step(&section[k], fine[i]);
        if (spec->filter_causal || spec->filter_order == 0)
            break;
        reverse(grid->n, fine);
    }
    for (size_t i = 0; i < grid->n_record; i++)
        record[i] = fine[grid->lead + i * grid->oversampling];
}
