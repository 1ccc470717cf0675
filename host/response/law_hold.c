/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_hold.h"

/* |a| ≤ 4: the last term of the series is below 1e-17; above, the recursion is right to 1e-15 where Re a ≤ 0. */
enum { TERMS = 40 };
static const double series_below = 4.0;

/* m_j = ∫₀¹ e^(a(1−s)) s^j ds = (j m_(j−1) − 1)/a, m_0 = (e^a − 1)/a, and dm_j/da. */
static void moments_of_large(double complex a, double complex m[HOLD_CUBIC], double complex d_m[HOLD_CUBIC])
{
    const double complex e = cexp(a);
    m[0] = (e - 1.0) / a;
    d_m[0] = (e - m[0]) / a;
    for (size_t j = 1; j < HOLD_CUBIC; j++) {
        m[j] = ((double)j * m[j - 1] - 1.0) / a;
        d_m[j] = ((double)j * d_m[j - 1] - m[j]) / a;
    }
}

/* The same as Σ_i a^i j!/(i + j + 1)! where that cancels. */
static void moments(double complex a, double complex m[HOLD_CUBIC], double complex d_m[HOLD_CUBIC])
{
    if (cabs(a) > series_below) {
        moments_of_large(a, m, d_m);
        return;
    }
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
