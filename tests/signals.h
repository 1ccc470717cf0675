/* SPDX-License-Identifier: GPL-3.0-or-later */
/* signals.h — reproducible noise and the exact response of modes, for tests of spectra, noise and residuals. */
#ifndef SIGNALS_H
#define SIGNALS_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

/* xorshift64* */
static inline double signal_uniform(uint64_t *seed)
{
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return (double)((*seed * 2685821657736338717u) >> 11) / 9007199254740992.0;
}

/* Box and Muller. */
static inline double signal_normal(uint64_t *seed)
{
    const double u = signal_uniform(seed), v = signal_uniform(seed);
    return sqrt(-2.0 * log(1.0 - u)) * cos(2.0 * M_PI * v);
}

static inline uint64_t signal_seed(unsigned number)
{
    uint64_t seed = 0x9e3779b97f4a7c15u * (number + 1u);
    for (int i = 0; i < 8; i++)
        signal_uniform(&seed);
    return seed;
}

/* x[t] = a1 x[t−1] + a2 x[t−2] + e, e ~ N(0, sigma²), from its stationary state. */
static inline void signal_ar2(uint64_t *seed, double a1, double a2, double sigma, size_t n, double *x)
{
    double x1 = 0.0, x2 = 0.0;
    for (size_t t = 0; t < n + 2000; t++) {
        const double now = a1 * x1 + a2 * x2 + sigma * signal_normal(seed);
        x2 = x1;
        x1 = now;
        if (t >= 2000)
            x[t - 2000] = now;
    }
}

/* Adds gain · (a mode's sampled impulse response * u); u NULL: free. start: its deflection before the first sample. */
static inline void signal_add_mode(double f_Hz, double damping, double gain, double dt_s, const double *u, size_t n,
                                   double start, double *y)
{
    const double w = 2.0 * M_PI * f_Hz, wd = w * sqrt(1.0 - damping * damping), r = exp(-damping * w * dt_s);
    const double c1 = 2.0 * r * cos(wd * dt_s), c2 = -r * r, b = r * sin(wd * dt_s);
    double y1 = start, y2 = 0.5 * start, u1 = 0.0;
    for (size_t t = 0; t < n; t++) { /* Σ u r^k sin(k ωd dt), exactly */
        const double now = c1 * y1 + c2 * y2 + b * u1;
        y2 = y1;
        y1 = now;
        u1 = u == NULL ? 0.0 : u[t];
        y[t] += gain * now;
    }
}

static inline double signal_rms(const double *x, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum / (double)n);
}

#endif
