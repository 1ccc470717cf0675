/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"

#include <math.h>
#include <string.h>

/* ---- Channels ---- */

static bool names_channel(const struct model *model, size_t e, const char *name)
{
    return strcmp(model->effects[e].channel, name) == 0 || strcmp(model->effects[e].channel, "all") == 0;
}

bool effect_on_output(const struct model *model, size_t e, size_t output)
{
    const struct beam_effect *effect = model->effects[e].effect;
    if (effect->filter == NULL && effect->map == NULL && effect->signal == NULL)
        return false;
    if (model->effects[e].channel[0] != '\0')
        return names_channel(model, e, model->outputs[output].name);
    return effect->channels == BEAM_CHANNELS_EVERY_OUTPUT ||
           (effect->channels == BEAM_CHANNELS_PATCH_OUTPUT && model->outputs[output].kind == OUTPUT_PATCH_STRAIN);
}

/* A geometry effect that shifts point forces, and not the patch or the clock alone. */
static bool shifts_inputs(const struct beam_effect *effect)
{
    double p[BEAM_EFFECT_PARAMETERS] = {0};
    struct beam_geometry at = {0};
    for (int s = 0; s < effect->n_parameters; s++)
        p[s] = effect->parameters[s].start;
    if (effect->geometry == NULL || effect->geometry(p, &at) != 0)
        return false;
    for (int s = 0; s < effect->n_parameters; s++)
        if (at.by_parameter[1][s] < 0.0 || at.by_parameter[1][s] > 0.0)
            return true;
    return false;
}

bool effect_on_input(const struct model *model, size_t e, size_t input)
{
    const struct beam_effect *effect = model->effects[e].effect;
    if (effect->drive == NULL && !shifts_inputs(effect))
        return false;
    if (model->effects[e].channel[0] != '\0')
        return names_channel(model, e, model->inputs[input].name);
    if (effect->drive == NULL)
        return model->inputs[input].kind == INPUT_POINT_FORCE;
    return (effect->channels == BEAM_CHANNELS_PATCH_INPUT && model->inputs[input].kind == INPUT_PATCH_MOMENT) ||
           (effect->channels == BEAM_CHANNELS_POINT_INPUT && model->inputs[input].kind == INPUT_POINT_FORCE);
}
