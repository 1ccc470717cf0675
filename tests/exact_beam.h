/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * exact_beam.h — natural frequencies of Euler–Bernoulli beams from their transcendental equations: no discretisation.
 * Uniform beams by the classical equations, a stepped cantilever by the transfer matrices of its pieces.
 */
#ifndef EXACT_BEAM_H
#define EXACT_BEAM_H

#include <math.h>
#include <stddef.h>
#include <string.h>

enum { EXACT_PIECES = 8 };

struct exact_beam {
    size_t n;
    double span_m[EXACT_PIECES], EI[EXACT_PIECES], rho[EXACT_PIECES];
};

static inline double exact_bisect(double (*f)(const void *, double), const void *context, double low, double high)
{
    double sign = f(context, low);
    for (int i = 0; i < 200; i++) {
        double middle = 0.5 * (low + high);
        if (f(context, middle) * sign > 0.0)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

/* cos z ± 1/cosh z: the sign of the cantilever (+) and of both other ends alike (−). */
static inline double exact_uniform_equation(const void *sign, double z)
{
    return cos(z) + *(const double *)sign / cosh(z);
}

/* βℓ of mode k = 0, 1, …: cos cosh = −1 clamped-free, +1 clamped-clamped and free-free (elastic), sin = 0 pinned. */
static inline double exact_uniform_root(int support, int k)
{
    const double pi = acos(-1.0);
    double sign = support == 0 ? 1.0 : -1.0;
    if (support == 2)
        return (double)(k + 1) * pi;
    if (support == 0)
        return exact_bisect(exact_uniform_equation, &sign, (double)k * pi + 1e-9, (double)(k + 1) * pi);
    return exact_bisect(exact_uniform_equation, &sign, (double)(k + 1) * pi, (double)(k + 2) * pi);
}

/*
 * Krylov's functions carry (y, y', EI y″, EI y‴) over a piece; a clamp leaves moment and force free, and both vanish at
 * the free end: the determinant of that 2 × 2 block.
 */
static inline double exact_cantilever_determinant(const void *context, double f_Hz)
{
    const struct exact_beam *beam = context;
    double omega = 2.0 * acos(-1.0) * f_Hz, state[2][4] = {{0, 0, 1, 0}, {0, 0, 0, 1}};
    for (size_t p = 0; p < beam->n; p++) {
        double b = sqrt(omega * sqrt(beam->rho[p] / beam->EI[p])), z = b * beam->span_m[p], EI = beam->EI[p];
        double S = 0.5 * (cosh(z) + cos(z)), T = 0.5 * (sinh(z) + sin(z)) / b;
        double U = 0.5 * (cosh(z) - cos(z)) / (b * b), V = 0.5 * (sinh(z) - sin(z)) / (b * b * b), q = b * b * b * b;
        const double M[4][4] = {{S, T, U / EI, V / EI},
                                {q * V, S, T / EI, U / EI},
                                {q * U * EI, q * V * EI, S, T},
                                {q * T * EI, q * U * EI, q * V, S}};
        for (int c = 0; c < 2; c++) {
            double next[4] = {0};
            for (int i = 0; i < 4; i++)
                for (int j = 0; j < 4; j++)
                    next[i] += M[i][j] * state[c][j];
            memcpy(state[c], next, sizeof next);
        }
    }
    return state[0][2] * state[1][3] - state[1][2] * state[0][3];
}

/* Mode k = 0, 1, … of the cantilever, by sign changes on a grid of half a per cent and bisection. */
static inline double exact_stepped_Hz(const struct exact_beam *beam, int k)
{
    double low = 0.1, high;
    for (;; low = high) {
        high = 1.005 * low;
        if (exact_cantilever_determinant(beam, low) * exact_cantilever_determinant(beam, high) < 0.0 && k-- == 0)
            return exact_bisect(exact_cantilever_determinant, beam, low, high);
    }
}

#endif
