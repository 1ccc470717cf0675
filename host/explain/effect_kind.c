/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "effect_kind.h"

#include "response/response.h"

#include <math.h>
#include <stddef.h>

enum effect_kind effect_kind(const struct beam_effect *effect)
{
    if (effect->law != NULL)
        return KIND_LAW;
    if (effect->drive != NULL || (effect->map != NULL && !effect_map_is_linear(effect)))
        return KIND_NONLINEAR_CHAIN;
    return KIND_LINEAR;
}

bool effect_law_is_of_degree_one(const struct beam_effect *effect)
{
    static const double same = 1e-9;
    double p[BEAM_EFFECT_PARAMETERS];
    struct beam_law_output once = {0}, twice = {0};
    struct beam_law_input in = {
        .w = {1e-3, 2e-3}, .v = {0.3, 0.1}, .w_old = {0.9e-3, 1.9e-3}, .t_s = 1.0, .dt_s = 1e-3};
    for (int i = 0; i < effect->n_parameters; i++)
        p[i] = effect->parameters[i].start;
    if (effect->law(p, &in, &once) != 0)
        return false;
    for (int i = 0; i < BEAM_LAW_WIDTH; i++)
        in.w[i] *= 2.0, in.v[i] *= 2.0, in.w_old[i] *= 2.0;
    if (effect->law(p, &in, &twice) != 0)
        return false;
    for (int i = 0; i < BEAM_LAW_WIDTH; i++)
        if (fabs(twice.f[i] - 2.0 * once.f[i]) > same * fabs(twice.f[i]))
            return false;
    return true;
}
