/* SPDX-License-Identifier: GPL-3.0-or-later */
/* modes_record.h — a record of a few linear modes, and the model whose poles are elsewhere. Include after cmocka.h. */
#ifndef BEAMFIT_MODES_RECORD_H
#define BEAMFIT_MODES_RECORD_H

#include <math.h>
#include <string.h>

#include "record/record.h"
#include "signals.h"

#include "linear_modes.h" /* after signals.h, whose arguments have the names of its modes */

/*
 * Records are sums of exactly sampled modes (signals.h) far from the model's: its frequencies are 9.8, 61, 172 Hz and
 * more. The reference is the noise that was added.
 *
 * Deflections of both channels to a hit (kind 0), a sweep (1), from a start (2, no input), or to lines 9 Hz apart, none of them at a mode (3); `level` scales the input. cubic: the
 * sensor shows z (1 + cubic z²/rms²) of the deflection at level 1.
 */
static inline struct record make_record(int kind, double level, double cubic, unsigned number)
{
    static double u[N], z[N];
    struct record record = {.path = strdup("test.csv"), .n = N, .dt_s = dt};
    uint64_t seed = signal_seed(number);
    for (size_t i = 0; i < N; i++) {
        const double t = (double)i * dt;
        if (kind == 0)
            u[i] = level * exp(-0.5 * pow(((double)i - 60.0) / 2.0, 2.0)); /* band-limited: the sum is exact then */
        else
            u[i] = kind == 1 ? level * sin(2.0 * M_PI * (3.0 + 10.0 * t) * t) * (1.0 - exp(-t)) : 0.0;
        for (int line = 1; kind == 3 && line <= 20; line++)
            u[i] += 0.1 * level * sin(2.0 * M_PI * 9.0 * line * t + line * line) * (1.0 - exp(-t));
    }
    record_add_column(&record, "drive_N", u);
    for (int channel = 0; channel < 2; channel++) {
        memset(z, 0, sizeof z);
        for (int m = 0; m < MODES; m++)
            signal_add_mode(mode_Hz[m], damping[m], (channel == 1 && m == 1 ? -1.0 : 1.0) / (1.0 + m), dt,
                            kind == 2 ? NULL : u, N, kind == 2 ? level : 0.0, z);
        const double rms = signal_rms(z, N);
        for (size_t i = 0; i < N; i++)
            z[i] *= 1.0 + cubic * pow(z[i] * level / rms, 2.0);
        for (size_t i = 0; i < N; i++)
            z[i] += noise_share * rms * signal_normal(&seed);
        record_add_column(&record, channel == 0 ? "tip_m" : "middle_m", z);
    }
    if (kind == 2)
        record_add_meta(&record, "excitation", "free_decay");
    return record;
}

#endif
