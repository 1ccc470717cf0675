/* SPDX-License-Identifier: GPL-3.0-or-later */
/* effects_draw.h — random points at which the slots of an effect are tried. */
#ifndef EFFECTS_DRAW_H
#define EFFECTS_DRAW_H

#include <math.h>
#include <stdint.h>
#include <string.h>
#include "beam_effect.h"
#include "effects_shadow.h"

/* xorshift64*: the same points in every run. */
static inline double draw_uniform(uint64_t *seed, double low, double high)
{
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    const uint64_t bits = (*seed * 2685821657736338717u) >> 11;
    return low + (high - low) * (double)bits / 9007199254740992.0;
}

static inline double draw_signed(uint64_t *seed, double low_exponent, double high_exponent)
{
    const double size = pow(10.0, draw_uniform(seed, low_exponent, high_exponent));
    return draw_uniform(seed, -1.0, 1.0) < 0.0 ? -size : size;
}

/* Within a decade of the start value, either sign where the range allows it; a position anywhere on the beam. */
static inline double draw_parameter(const struct beam_parameter_info *info, double length_m, uint64_t *seed)
{
    if (info->role == BEAM_ROLE_PLACE)
        return length_m * draw_uniform(seed, info->minimum, info->maximum);
    double x =
        info->start == 0.0 ? draw_uniform(seed, -1.0, 1.0) : info->start * pow(10.0, draw_uniform(seed, -1.0, 1.0));
    if (info->minimum < 0.0 && info->maximum > 0.0 && draw_uniform(seed, 0.0, 1.0) < 0.5)
        x = -x;
    return fmin(fmax(x, info->minimum), info->maximum);
}

/* A point of one slot: parameters, and inputs of a size that a beam shows (rad, m, m/s, V). */
static inline struct shadow_case draw_case(int effect, enum shadow_slot slot, uint64_t *seed)
{
    const struct beam_effect *e = beam_effects[effect];
    struct shadow_case c;
    memset(&c, 0, sizeof c);
    c.effect = effect;
    c.slot = slot;
    c.direction = -1;
    c.length_m = draw_uniform(seed, 0.2, 2.0);
    c.t_s = draw_uniform(seed, 0.0, 8.0);
    c.dt_s = 1e-4;
    for (int j = 0; j < e->n_parameters; j++)
        c.x[j] = draw_parameter(&e->parameters[j], c.length_m, seed);
    for (int j = SHADOW_P; j < SHADOW_IN; j++) {
        if (slot == SHADOW_LAW)
            c.x[j] = draw_signed(seed, -4.0, j >= SHADOW_P + 2 && j < SHADOW_P + 4 ? 1.0 : -1.0);
        else if (slot == SHADOW_DRIVE && j == SHADOW_P + 2)
            c.x[j] = draw_signed(seed, -2.0, 0.5);
        else
            c.x[j] = draw_signed(seed, -2.0, 1.5);
    }
    return c;
}

#endif
