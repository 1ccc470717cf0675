/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "effect_kind.h"

#include <stddef.h>

enum effect_kind effect_kind(const struct beam_effect *effect)
{
    if (effect->law != NULL)
        return KIND_LAW;
    return effect->drive != NULL || effect->map != NULL ? KIND_NONLINEAR_CHAIN : KIND_LINEAR;
}
