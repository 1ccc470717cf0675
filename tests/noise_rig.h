/* SPDX-License-Identifier: GPL-3.0-or-later */
/* noise_rig.h — a channel of a beam of five modes for tests of the noise, which is cut while it rings. */
#ifndef BEAMFIT_NOISE_RIG_H
#define BEAMFIT_NOISE_RIG_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>

#include "maths/maths.h"
#include "noise/noise.h"
#include "noise/noise_estimate.h"
#include "signals.h"

enum { N = 4096 };
static const double dt = 1.0 / 1024.0;
static const double mode_Hz[5] = {6.6, 38.4, 95.5, 178.7, 305.2};
static const double damping[5] = {0.0017, 0.001, 0.0015, 0.0025, 0.004};

enum drive { HAMMER, CHIRP, RANDOM };

static inline void fill_drive(enum drive kind, size_t onset, uint64_t *seed, double *u)
{
    for (size_t i = 0; i < N; i++) {
        const double t = (double)i * dt;
        if (kind == HAMMER)
            u[i] = i >= onset && i < onset + 3 ? sin(M_PI * ((double)(i - onset) + 0.5) / 3.0) : 0.0;
        else if (kind == CHIRP)
            u[i] = sin(2.0 * M_PI * (2.0 + 0.5 * 95.0 * t) * t);
        else
            u[i] = signal_normal(seed);
    }
}

/* A five-mode response, cut while it rings; the drive is known. start: motion before the record. */
static inline void respond(const double *u, double start, double *z)
{
    memset(z, 0, N * sizeof *z);
    for (int m = 0; m < 5; m++)
        signal_add_mode(mode_Hz[m], damping[m], (m % 2 ? -1.0 : 1.0) / (1.0 + m), dt, u, N, start, z);
}

static inline double estimate(const double *z, size_t n, const double *u, size_t from)
{
    struct noise_estimate e;
    struct bf_error err;
    const struct noise_channel_input inputs[1] = {{.u = u}};
    assert_int_equal(noise_estimate(z, n, dt, inputs, u != NULL ? 1 : 0, from, &e, &err), BF_OK);
    const double rms = e.rms;
    noise_free(&e);
    return rms;
}

#endif
