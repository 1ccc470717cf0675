/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * exact_response.h — the frequency response at the tip of a uniform cantilever, in closed form: the damped wave number k⁴ =
 * −(ρ s² + γ s)/(EI + cDI s) in the receptance of the free end (Bishop and Johnson, The Mechanics of Vibration, 1960); and files of it.
 */
#ifndef EXACT_RESPONSE_H
#define EXACT_RESPONSE_H

#include <complex.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "signals.h"

struct exact_cantilever {
    double length_m, EI_Nm2, rho_kgpm, cDI_sNm2, gamma_sNpm2, tip_kg;
};

/* Acceleration of the tip over the force there, 1/kg, at s = rate + 2πi f. */
static inline double complex exact_accelerance(const struct exact_cantilever *b, double f_Hz, double rate)
{
    const double complex s = CMPLX(rate, 2.0 * acos(-1.0) * f_Hz);
    const double complex E = b->EI_Nm2 + s * b->cDI_sNm2;
    const double complex k = cpow(-(b->rho_kgpm * s * s + b->gamma_sNpm2 * s) / E, 0.25), z = k * b->length_m;
    const double complex H = (ccosh(z) * csin(z) - csinh(z) * ccos(z)) / (E * k * k * k * (1.0 + ccos(z) * ccosh(z)));
    return s * s * H / (1.0 + s * s * b->tip_kg * H);
}

enum exact_form { EXACT_COMPLEX, EXACT_DECIBEL };

/* What is measured: lines 0, df, …, each a mean of `averages` with this noise (of the rms over the lines) on the output. */
struct exact_measurement {
    double df_Hz, noise, window_rate;
    int lines, averages;
    enum exact_form form;
    uint64_t *seed;
};

static inline double exact_rms(const struct exact_cantilever *b, const struct exact_measurement *m)
{
    double sum = 0.0;
    for (int i = 1; i < m->lines; i++)
        sum += pow(cabs(exact_accelerance(b, i * m->df_Hz, m->window_rate)), 2.0) / m->lines;
    return sqrt(sum);
}

/* accel_mps2 over hammer_N, with coherence. */
static inline void exact_write(const struct exact_cantilever *b, const struct exact_measurement *m, FILE *out)
{
    const double noise = m->noise * exact_rms(b, m), degree = acos(-1.0) / 180.0;
    const char *const columns[] = {"re", "im", "dB", "deg"};
    (void)fprintf(out, "# averages: %d\n", m->averages);
    if (m->window_rate > 0.0)
        (void)fprintf(out, "# exponential window: %.12g s\n", 1.0 / m->window_rate);
    (void)fprintf(out, "freq_Hz,accel_mps2/hammer_N_%s,accel_mps2/hammer_N_%s,accel_mps2/hammer_N_coherence\n",
                  columns[2 * (int)m->form], columns[2 * (int)m->form + 1]);
    for (int i = 0; i < m->lines; i++) {
        const double complex H = i > 0 ? exact_accelerance(b, i * m->df_Hz, m->window_rate) : 0.0;
        const double power = pow(cabs(H), 2.0), sd = noise / sqrt(2.0 * m->averages);
        const double complex measured = H + CMPLX(sd * signal_normal(m->seed), sd * signal_normal(m->seed));
        const double re = creal(measured), im = cimag(measured);
        if (m->form == EXACT_COMPLEX)
            (void)fprintf(out, "%.9g,%.9g,%.9g", i * m->df_Hz, re, im);
        else
            (void)fprintf(out, "%.9g,%.9g,%.9g", i * m->df_Hz, 20.0 * log10(fmax(cabs(measured), 1e-30)),
                          atan2(im, re) / degree);
        (void)fprintf(out, ",%.9g\n", noise > 0.0 ? power / (power + noise * noise) : 1.0);
    }
}

#endif
