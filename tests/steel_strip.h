/* SPDX-License-Identifier: GPL-3.0-or-later */
/* steel_strip.h — a steel cantilever of 350 x 25 x 5 mm and its first poles in closed form: ω = (βℓ)² √(EI/ρ)/ℓ². SI units. */
#ifndef STEEL_STRIP_H
#define STEEL_STRIP_H

#include <math.h>
#include <stddef.h>

enum { STRIP_MODES = 3 };
static const double EI = 52.1, rho = 0.97, length = 0.35, cDI = 1.1e-4, viscous = 1.3;

/* rad/s, of mode 0, 1, 2 */
static inline double mode_rad(size_t mode)
{
    static const double beta_l[STRIP_MODES] = {1.875104068711961, 4.694091132974174, 7.854757438237613};
    return beta_l[mode] * beta_l[mode] * sqrt(EI / rho) / (length * length);
}

static inline double mode_damping(size_t mode)
{
    return (cDI / EI * mode_rad(mode) + viscous / (rho * mode_rad(mode))) / 2.0;
}

#endif
