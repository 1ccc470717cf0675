/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"

#include <math.h>
#include <string.h>

/* No region may become shorter than this part of itself. */
static const double shortest_part = 0.02;

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

/* ---- The model with its patch shifted ---- */

static bool not_zero(double x)
{
    return x < 0.0 || x > 0.0;
}

static bool is_patch(const struct region *region)
{
    return strcmp(region->name, "patch") == 0;
}

static void shift_regions(const struct model *fixed, double shift_m, struct model *out)
{
    size_t r = 0;
    for (size_t i = 0; i < fixed->n_regions; i++)
        out->regions[i] = fixed->regions[i];
    while (r < fixed->n_regions && !is_patch(&fixed->regions[r]))
        r++;
    if (r > 0 && r < fixed->n_regions)
        out->regions[r - 1].to_m += shift_m;
    for (; r < fixed->n_regions && is_patch(&fixed->regions[r]); r++) {
        out->regions[r].from_m += shift_m;
        out->regions[r].to_m += shift_m;
    }
    if (r > 0 && r < fixed->n_regions && is_patch(&fixed->regions[r - 1]))
        out->regions[r].from_m += shift_m;
}

static bool on_patch(double from, double to, double patch_from, double patch_to, double length)
{
    return fabs(from - patch_from) < 1e-9 * length && fabs(to - patch_to) < 1e-9 * length;
}

enum bf_status model_shift_patch(const struct model *fixed, double shift_m, struct model *out, struct bf_error *err)
{
    double from = 0.0, to = 0.0, L = fixed->length_m;
    if (!model_patch(fixed, &from, &to))
        return bf_fail(err, BF_BAD_FILE, "an effect shifts the patch, but the model has none");
    if (not_zero(shift_m) && (!(from + shift_m > 0.0) || !(to + shift_m < L)))
        return bf_fail(err, BF_NUMERIC, "the patch, shifted by %.4g m, would leave the beam", shift_m);
    shift_regions(fixed, shift_m, out);
    for (size_t r = 0; r < fixed->n_regions; r++)
        if (!(out->regions[r].to_m - out->regions[r].from_m >
              shortest_part * (fixed->regions[r].to_m - fixed->regions[r].from_m)) ||
            (r > 0 && not_zero(out->regions[r].from_m - out->regions[r - 1].to_m)))
            return bf_fail(err, BF_NUMERIC, "the patch, shifted by %.4g m, would leave no room for region '%s'",
                           shift_m, fixed->regions[r].name);
    for (size_t i = 0; i < fixed->n_inputs; i++) {
        bool moves = fixed->inputs[i].kind == INPUT_PATCH_MOMENT &&
                     on_patch(fixed->inputs[i].from_m, fixed->inputs[i].to_m, from, to, L);
        out->inputs[i].from_m = fixed->inputs[i].from_m + (moves ? shift_m : 0.0);
        out->inputs[i].to_m = fixed->inputs[i].to_m + (moves ? shift_m : 0.0);
    }
    for (size_t o = 0; o < fixed->n_outputs; o++) {
        bool moves = fixed->outputs[o].kind == OUTPUT_PATCH_STRAIN &&
                     on_patch(fixed->outputs[o].from_m, fixed->outputs[o].to_m, from, to, L);
        out->outputs[o].from_m = fixed->outputs[o].from_m + (moves ? shift_m : 0.0);
        out->outputs[o].to_m = fixed->outputs[o].to_m + (moves ? shift_m : 0.0);
    }
    return BF_OK;
}
