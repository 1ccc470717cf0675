/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "effect_kind.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* y(2v, 2u) = 2 y(v, u), as of a direct path; a converter that saturates is none. */
static bool is_linear_map(const struct beam_effect *effect)
{
    static const double v = 1.7, u = 0.6, same = 1e-9;
    double p[BEAM_EFFECT_PARAMETERS];
    struct beam_sample_output once = {0}, twice = {0};
    for (int i = 0; i < effect->n_parameters; i++)
        p[i] = effect->parameters[i].start;
    return effect->map(p, v, u, &once) == 0 && effect->map(p, 2.0 * v, 2.0 * u, &twice) == 0 &&
           fabs(twice.y - 2.0 * once.y) <= same * fabs(twice.y);
}

enum effect_kind effect_kind(const struct beam_effect *effect)
{
    if (effect->law != NULL)
        return KIND_LAW;
    if (effect->drive != NULL || (effect->map != NULL && !is_linear_map(effect)))
        return KIND_NONLINEAR_CHAIN;
    return KIND_LINEAR;
}
