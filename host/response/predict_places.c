/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"

#include <math.h>
#include <stdio.h>
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

/* ---- What a record says of places ---- */

bool record_place(const struct model *model, const struct record *record, const char *channel, double *at_m)
{
    char key[MODEL_NAME + 8];
    const char *name = record_base_name(record);
    (void)snprintf(key, sizeof key, "%s.at_m", channel);
    if (record_meta_number(record, key, at_m))
        return true;
    for (size_t i = 0; i < model->n_stated; i++)
        if (strcmp(model->stated[i].channel, channel) == 0 && strcmp(model->stated[i].record, name) == 0) {
            *at_m = model->stated[i].at_m;
            return true;
        }
    return false;
}

bool record_has_places(const struct model *model, const struct record *record)
{
    double at_m;
    bool any = false;
    for (size_t i = 0; i < model->n_inputs; i++)
        any = any ||
              (model->inputs[i].kind == INPUT_POINT_FORCE && record_place(model, record, model->inputs[i].name, &at_m));
    for (size_t o = 0; o < model->n_outputs; o++)
        any = any || (model->outputs[o].kind != OUTPUT_PATCH_STRAIN &&
                      record_place(model, record, model->outputs[o].name, &at_m));
    return any;
}

bool model_differs_by_record(const struct model *model)
{
    for (size_t e = 0; e < model->n_effects; e++)
        for (int j = 0; j < model->effects[e].effect->n_parameters; j++)
            if (model->effects[e].by_record[j])
                return true;
    return false;
}
