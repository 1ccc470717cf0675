/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_effects.c — the effects of a model: found in the catalogue, appended, dropped. */
#include "model_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

const struct beam_effect *effect_by_id(const char *id)
{
    for (int i = 0; i < beam_effects_count; i++)
        if (strcmp(beam_effects[i]->id, id) == 0)
            return beam_effects[i];
    return NULL;
}

const struct beam_effect *effect_find(const char *id, struct bf_error *err)
{
    const struct beam_effect *effect = effect_by_id(id);
    if (effect)
        return effect;
    const char **ids = bf_alloc((size_t)beam_effects_count, sizeof *ids);
    for (int i = 0; i < beam_effects_count; i++)
        ids[i] = beam_effects[i]->id;
    const char *closest = text_closest(id, ids, (size_t)beam_effects_count);
    free(ids);
    (void)bf_fail(err, BF_USAGE, "unknown effect '%.60s'; `beamfit effects` lists them%s%s%s", id,
                  closest ? "; did you mean '" : "", closest ? closest : "", closest ? "'?" : "");
    return NULL;
}

bool effect_parameter_is_held(const struct beam_parameter_info *info)
{
    return info->role == BEAM_ROLE_PLACE || (info->flags & BEAM_PARAMETER_HELD) != 0;
}

void model_effect_parameter(const struct model *model, const struct beam_effect *effect, int slot,
                            struct parameter *out)
{
    const struct beam_parameter_info *info = &effect->parameters[slot];
    double scale = info->role == BEAM_ROLE_PLACE ? model->length_m : 1.0;
    model_parameter_init(out, info->name, info->unit, true);
    out->value = info->start * scale;
    out->min = info->minimum * scale;
    out->max = info->maximum * scale;
    if (info->role == BEAM_ROLE_PLACE)
        out->value = fmin(out->value, model_last_place_m(model));
    out->fixed = effect_parameter_is_held(info);
    out->logarithmic = (info->flags & BEAM_PARAMETER_LOG) != 0 && out->value > 0.0;
}

enum bf_status model_append_effect(struct model *model, const char *id, const char *channel, struct bf_error *err)
{
    const struct beam_effect *effect = effect_find(id, err);
    if (!effect)
        return BF_USAGE;
    if (strlen(channel) >= MODEL_NAME)
        return bf_fail(err, BF_USAGE, "channel name '%.60s…' is longer than %d bytes", channel, MODEL_NAME - 1);
    model->effects = bf_grow(model->effects, model->n_effects + 1, sizeof *model->effects);
    struct model_effect *added = &model->effects[model->n_effects];
    *added = (struct model_effect){.effect = effect};
    (void)snprintf(added->channel, sizeof added->channel, "%s", channel);
    for (int i = 0; i < effect->n_parameters; i++)
        model_effect_parameter(model, effect, i, &added->parameters[i]);
    model->n_effects++;
    model_forget_fit(model);
    return BF_OK;
}

void model_take_effect(struct model *model, const struct model_effect *effect)
{
    model->effects = bf_grow(model->effects, model->n_effects + 1, sizeof *model->effects);
    struct model_effect *added = &model->effects[model->n_effects++];
    *added = *effect;
    added->per_record = bf_grow(NULL, effect->n_per_record + 1, sizeof *added->per_record);
    for (size_t i = 0; i < effect->n_per_record; i++)
        added->per_record[i] = effect->per_record[i];
    model_forget_fit(model);
}

enum bf_status model_drop_effect(struct model *model, const char *id, struct bf_error *err)
{
    if (!effect_find(id, err))
        return BF_USAGE;
    size_t kept = 0;
    for (size_t i = 0; i < model->n_effects; i++) {
        if (strcmp(model->effects[i].effect->id, id) == 0)
            free(model->effects[i].per_record);
        else
            model->effects[kept++] = model->effects[i];
    }
    if (kept == model->n_effects)
        return bf_fail(err, BF_USAGE, "the model has no effect '%s' to drop", id);
    model->n_effects = kept;
    model_forget_fit(model);
    return BF_OK;
}

bool model_has_effect(const struct model *model, const struct beam_effect *effect)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (model->effects[e].effect == effect)
            return true;
    return false;
}

bool model_is_clamped(const struct model *model)
{
    return model->support == SUPPORT_CLAMPED_FREE || model->support == SUPPORT_CLAMPED_CLAMPED;
}

bool model_has_law(const struct model *model)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (model->effects[e].effect->law)
            return true;
    return false;
}

bool model_bends(const struct model *model)
{
    for (size_t e = 0; e < model->n_effects; e++) {
        const struct beam_effect *effect = model->effects[e].effect;
        if (effect->law != NULL || effect->map != NULL || effect->drive != NULL)
            return true;
    }
    return false;
}
