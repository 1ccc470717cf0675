/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "effect_kind.h"

#include "response/response.h"

#include <stddef.h>

enum effect_kind effect_kind(const struct beam_effect *effect)
{
    if (effect->law != NULL)
        return KIND_LAW;
    if (effect->drive != NULL || (effect->map != NULL && !effect_map_is_linear(effect)))
        return KIND_NONLINEAR_CHAIN;
    return KIND_LINEAR;
}
