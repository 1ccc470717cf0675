/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Input signals on the doubled fine grid, and what the drive chain does to them. */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>

static double raised_cosine_ends(double t, double width, double taper)
{
    double edge = fmin(t, width - t);
    if (edge < 0)
        return 0;
    return taper > 0 && edge < taper ? (1 - cos(TRUTH_PI * edge / taper)) / 2 : 1;
}

/* The ramp max(t, 0) smoothed by a raised cosine of half width a. */
static double smooth_ramp(double t, double a)
{
    if (!(a > 0) || fabs(t) >= a)
        return t > 0 ? t : 0;
    return (t + a) * (t + a) / (4 * a) - a / (2 * TRUTH_PI * TRUTH_PI) * (1 + cos(TRUTH_PI * t / a));
}

/* t counts from the signal's start, 0 ≤ t ≤ width */
static double pulse(const struct truth_signal *signal, double t, double width)
{
    double s = t / width;
    switch (signal->kind) {
    case TRUTH_RAISED_COSINE:
        return signal->level * (1 - cos(2 * TRUTH_PI * s)) / 2;
    case TRUTH_HALF_SINE:
        return signal->level * sin(TRUTH_PI * s);
    case TRUTH_TRIANGLE: {
        double a = signal->taper_s / 2, from = t - a; /* three ramps; the smoothing reaches a beyond each end */
        return signal->level * 2 / width *
               (smooth_ramp(from, a) - 2 * smooth_ramp(from - width / 2, a) + smooth_ramp(from - width, a));
    }
    case TRUTH_BURST:
        return signal->level * sin(2 * TRUTH_PI * signal->from_Hz * t + signal->phase_rad) *
               (1 - cos(2 * TRUTH_PI * s)) / 2;
    case TRUTH_CHIRP: {
        double sweep = (signal->to_Hz - signal->from_Hz) / width;
        return signal->level * sin(2 * TRUTH_PI * (signal->from_Hz * t + sweep * t * t / 2) + signal->phase_rad) *
               raised_cosine_ends(t, width, signal->taper_s);
    }
    default:
        return signal->level * sin(2 * TRUTH_PI * signal->from_Hz * t + signal->phase_rad) *
               raised_cosine_ends(t, width, signal->taper_s);
    }
}

/* Equal lines at equal steps with random phases; rms = level. Each line runs as a rotation, renewed now and then. */
static void multisine(const struct truth_signal *signal, double width, double t0, double dt, size_t n, double *x)
{
    enum { RENEW = 1024 };
    struct truth_random random;
    truth_random_seed(&random, signal->seed, 0);
    double amplitude = signal->level * sqrt(2 / (double)signal->count);
    double step_Hz = signal->count > 1 ? (signal->to_Hz - signal->from_Hz) / (double)(signal->count - 1) : 0;
    double *sum = truth_array(n);
    for (size_t line = 0; line < signal->count; line++) {
        double w = 2 * TRUTH_PI * (signal->from_Hz + step_Hz * (double)line);
        double phase = 2 * TRUTH_PI * truth_random_uniform(&random);
        double cs = cos(w * dt), sn = sin(w * dt), c = 0, s = 0;
        for (size_t i = 0; i < n; i++) {
            if (i % RENEW == 0) {
                c = cos(w * (t0 + (double)i * dt) + phase);
                s = sin(w * (t0 + (double)i * dt) + phase);
            }
            sum[i] += amplitude * s;
            double turned = c * cs - s * sn;
            s = s * cs + c * sn;
            c = turned;
        }
    }
    for (size_t i = 0; i < n; i++)
        x[i] += sum[i] * raised_cosine_ends(t0 + (double)i * dt, width, signal->taper_s);
    free(sum);
}

static double bessel_I0(double x)
{
    double sum = 1, term = 1;
    for (int k = 1; k < 60; k++) {
        term *= (x / (2 * k)) * (x / (2 * k));
        sum += term;
    }
    return sum;
}

enum { SINC_HALF = 48 };

/* Kaiser-windowed sinc over ±48 samples, β = 12: flat to −110 dB up to 0.45 of the sample rate. */
static void sinc_kernel(double fraction, double kernel[2 * SINC_HALF])
{
    const double beta = 12, norm = bessel_I0(beta);
    for (int k = 0; k < 2 * SINC_HALF; k++) {
        double d = fraction - (double)(k - SINC_HALF + 1), u = d / SINC_HALF;
        double sinc = fabs(d) < 1e-12 ? 1 : sin(TRUTH_PI * d) / (TRUTH_PI * d);
        kernel[k] = fabs(u) < 1 ? sinc * bessel_I0(beta * sqrt(1 - u * u)) / norm : 0;
    }
}

/* Beyond its ends a recording is continued by its odd reflection, as if it had been recorded longer. */
static double reflected(const struct truth_signal *signal, long k)
{
    long last = (long)signal->n_samples - 1;
    if (k < 0)
        return -k <= last ? 2 * signal->samples[0] - signal->samples[-k] : 0;
    if (k > last)
        return 2 * last - k >= 0 ? 2 * signal->samples[last] - signal->samples[2 * last - k] : 0;
    return signal->samples[k];
}

/* The kernels repeat every `phases` fine samples when the grid divides the sample interval evenly. */
static void recorded(const struct truth_signal *signal, double rate_Hz, size_t phases, double t0, double dt, size_t n,
                     double *x)
{
    double *table = truth_array(phases * 2 * SINC_HALF), *held = truth_array(phases);
    for (size_t i = 0; i < n; i++) {
        double position = (t0 + (double)i * dt) * rate_Hz;
        long centre = (long)floor(position + 1e-9);
        double fraction = position - (double)centre, *kernel = table + (i % phases) * 2 * SINC_HALF;
        if (i < phases || fabs(fraction - held[i % phases]) > 1e-7) {
            sinc_kernel(fraction, kernel);
            held[i % phases] = fraction;
        }
        for (long k = 0; k < 2 * SINC_HALF; k++)
            x[i] += signal->level * kernel[k] * reflected(signal, centre - SINC_HALF + 1 + k);
    }
    free(table);
    free(held);
}

static void held(const struct truth_signal *signal, const struct truth_grid *grid, double *x)
{
    size_t first = 2 * grid->lead, step = 2 * grid->oversampling;
    for (size_t i = first; i < 2 * grid->n - 1 && (i - first) / step < signal->n_samples; i++)
        x[i] += signal->level * signal->samples[(i - first) / step];
}

void truth_signal_add(const struct truth_signal *signal, const struct truth_spec *spec, const struct truth_grid *grid,
                      double *x)
{
    if (signal->kind == TRUTH_HELD) {
        held(signal, grid, x);
        return;
    }
    double dt = grid->dt_s / 2, t0 = grid->t0_s - signal->start_s;
    double end = grid->t0_s + (double)grid->n * grid->dt_s - signal->start_s;
    double width = signal->width_s > 0 ? signal->width_s : 2 * end;
    size_t n = 2 * grid->n - 1, first = 0;
    while (first < n && t0 + (double)first * dt < 0)
        first++;
    if (signal->kind == TRUTH_RECORDED) {
        /* the beam rests before t = 0, whatever the interpolation makes of the first sample */
        recorded(signal, spec->sample_rate_Hz, 2 * grid->oversampling, t0 + (double)first * dt, dt, n - first,
                 x + first);
        return;
    }
    if (signal->kind == TRUTH_MULTISINE) {
        multisine(signal, width, t0 + (double)first * dt, dt, n - first, x + first);
        return;
    }
    double last = signal->kind == TRUTH_TRIANGLE ? width + signal->taper_s : width;
    for (size_t i = first; i < n; i++) {
        double t = t0 + (double)i * dt;
        if (t > last)
            break;
        x[i] += pulse(signal, t, width);
    }
}

/* dz = du (1 − (β sgn(du z) + ζ)|z|). On each step z follows the exact exponential. */
static double hysteresis(const double p[], double du, double z)
{
    double left = du;
    for (int part = 0; part < 2 && fabs(left) > 0; part++) {
        double rate = p[1] * (left * z >= 0 ? 1 : -1) + p[2];
        double sign = z > 0 || (z >= 0 && left > 0) ? 1 : -1; /* |z| = sign·z until z crosses 0 */
        double k = rate * sign;                               /* dz/du = 1 − k z */
        double target = fabs(k) > 1e-12 ? 1 / k + (z - 1 / k) * exp(-k * left) : z + left;
        if (target * sign < 0 && z * sign > 0) { /* stop at z = 0, then go on with the other branch */
            double to_zero = fabs(k) > 1e-12 ? -log((0 - 1 / k) / (z - 1 / k)) / k : -z;
            z = 0;
            left -= to_zero;
            continue;
        }
        z = target;
        left = 0;
    }
    return z;
}

void truth_drive_distort(const struct truth_spec *spec, struct truth_drive *drive, size_t n, double *x)
{
    for (size_t e = 0; e < spec->n_effects; e++) {
        const double *p = spec->effect[e].parameter;
        switch (spec->effect[e].kind) {
        case TRUTH_DRIVE_HYSTERESIS:
            for (size_t i = 0; i < n; i++) { /* x ← u − a z */
                drive->z[e] = hysteresis(p, x[i] - drive->before[e], drive->z[e]);
                drive->before[e] = x[i];
                x[i] -= p[0] * drive->z[e];
            }
            break;
        case TRUTH_DRIVE_SATURATION:
            for (size_t i = 0; i < n && isfinite(p[0]); i++)
                x[i] = p[0] * truth_curve(p[1], x[i] / p[0]);
            break;
        case TRUTH_DRIVE_DEAD_ZONE:
            for (size_t i = 0; i < n; i++)
                x[i] = fabs(x[i]) <= p[0] ? 0 : x[i] - copysign(p[0], x[i]);
            break;
        default:
            break;
        }
    }
}
