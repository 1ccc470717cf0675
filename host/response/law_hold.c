/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_hold.h"

/* m_j = ∫₀¹ e^(a(1−s)) s^j ds = Σ_i a^i j!/(i + j + 1)!, and dm_j/da; |a| ≤ 4: the last term is below 1e-17. */
enum { TERMS = 40 };

static void moments(double complex a, double complex m[HOLD_CUBIC], double complex d_m[HOLD_CUBIC])
{
    double factor = 1.0; /* j!/(j + 1)! and so on */
    for (size_t j = 0; j < HOLD_CUBIC; j++) {
        factor = 1.0 / (double)(j + 1);
        double complex power = 1.0, previous = 0.0; /* a^i, i a^(i−1) */
        m[j] = d_m[j] = 0.0;
        for (size_t i = 0; i < TERMS; i++) {
            m[j] += factor * power;
            d_m[j] += factor * previous;
            previous = (double)(i + 1) * power;
            power *= a;
            factor /= (double)(i + j + 2);
        }
    }
}

struct law_hold law_hold(double complex p, double h_s, size_t samples)
{
    /* Lagrange polynomials of the samples at s = 1, 0, −1, −2 in powers of s */
    static const double line[HOLD_LINE][HOLD_CUBIC] = {{0.0, 1.0}, {1.0, -1.0}};
    static const double cubic[HOLD_CUBIC][HOLD_CUBIC] = {{0.0, 1.0 / 3.0, 0.5, 1.0 / 6.0},
                                                         {1.0, 0.5, -1.0, -0.5},
                                                         {0.0, -1.0, 0.5, 0.5},
                                                         {0.0, 1.0 / 6.0, 0.0, -1.0 / 6.0}};
    double complex m[HOLD_CUBIC], d_m[HOLD_CUBIC];
    struct law_hold hold = {.e = cexp(p * h_s)};
    hold.d_e = h_s * hold.e;
    moments(p * h_s, m, d_m);
    for (size_t i = 0; i < samples; i++) {
        const double *c = samples == HOLD_LINE ? line[i] : cubic[i];
        for (size_t j = 0; j < HOLD_CUBIC; j++) {
            hold.g[i] += h_s * c[j] * m[j];
            hold.d_g[i] += h_s * h_s * c[j] * d_m[j];
        }
    }
    return hold;
}
