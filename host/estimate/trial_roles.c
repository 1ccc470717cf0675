/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What an effect's parameters are, told from their flags and units: strength, place, thresholds and their scales. */
#include "trial_work.h"

#include <stdio.h>
#include <string.h>

/* Units of the law's coordinate and its rate. */
static const char *coordinate_unit(enum beam_law_points points)
{
    switch (points) {
    case BEAM_LAW_AT_POINT:
    case BEAM_LAW_OVER_DEFLECTION:
        return "m";
    case BEAM_LAW_AT_PATCH:
    case BEAM_LAW_AT_SPAN:
    case BEAM_LAW_OVER_SLOPE_AND_CURVATURE:
        return "rad";
    case BEAM_LAW_OVER_CURVATURE:
        return "1/m";
    case BEAM_LAW_NONE:
        break;
    }
    return "";
}

static bool of_force(const struct beam_parameter_info *info)
{
    return info->unit[0] == 'N';
}

/* Is `strength` the unit `force` per coordinate (or per its rate)? */
static bool ratio_unit(const char *strength, const char *force, const char *per)
{
    char text[64];
    (void)snprintf(text, sizeof text, "%s%s", force, per);
    return strcmp(strength, text) == 0;
}

static enum trial_scale scale_of(const struct beam_effect *effect, int strength, int slot, const char *w)
{
    char rate[16], per_w[16], per_v[16];
    const char *unit = effect->parameters[slot].unit;
    (void)snprintf(rate, sizeof rate, "%s/s", w);
    (void)snprintf(per_w, sizeof per_w, "/%s", w);
    (void)snprintf(per_v, sizeof per_v, "·s/%s", w);
    if (strcmp(unit, w) == 0)
        return TRIAL_OF_W;
    if (strcmp(unit, rate) == 0)
        return TRIAL_OF_V;
    if (ratio_unit(effect->parameters[strength].unit, unit, per_w))
        return TRIAL_OF_KW;
    if (ratio_unit(effect->parameters[strength].unit, unit, per_v))
        return TRIAL_OF_KV;
    return TRIAL_OWN;
}

enum bf_status trial_roles(const struct trial_force *force, struct trial_roles *out, struct bf_error *err)
{
    const struct beam_effect *effect = force->law.effect;
    const struct beam_place place = model_place(&force->model);
    struct beam_law_place where = {.points = BEAM_LAW_NONE};
    double p[BEAM_EFFECT_PARAMETERS] = {0};
    *out = (struct trial_roles){.strength = -1, .position = -1};
    for (int s = 0; s < effect->n_parameters; s++)
        p[s] = force->model.effects[force->effect].parameters[s].value;
    if (effect->law_place(p, &place, &where) != 0)
        return bf_fail(err, BF_NUMERIC, "effect %s: its start is outside the beam", effect->id);
    for (int s = 0; s < effect->n_parameters; s++) {
        unsigned flags = effect->parameters[s].flags;
        if (out->strength < 0 && (flags & (BEAM_PARAMETER_INNER | BEAM_PARAMETER_POSITION | BEAM_PARAMETER_HELD)) == 0)
            out->strength = s;
        else if (where.at_parameter == s + 1)
            out->position = s;
        else if ((flags & BEAM_PARAMETER_HELD) == 0)
            out->inner[out->n_inner++] = s;
    }
    if (out->strength < 0)
        return bf_fail(err, BF_USAGE, "effect %s has no parameter that is its strength", effect->id);
    bool carries = of_force(&effect->parameters[out->strength]);
    out->with_strength[out->strength] = true;
    for (int i = 0; i < out->n_inner; i++) {
        int s = out->inner[i];
        out->with_strength[s] = carries && of_force(&effect->parameters[s]);
        out->scale[s] = scale_of(effect, out->strength, s, coordinate_unit(where.points));
    }
    return BF_OK;
}

double trial_unit(const struct trial_force *force, const struct trial_roles *roles, int slot)
{
    double w, v, k = force->model.effects[force->effect].parameters[roles->strength].value;
    trial_force_scales(force, &w, &v);
    switch (roles->scale[slot]) {
    case TRIAL_OF_W:
        return w;
    case TRIAL_OF_V:
        return v;
    case TRIAL_OF_KW:
        return k * w;
    case TRIAL_OF_KV:
        return k * v;
    case TRIAL_OWN:
        break;
    }
    return force->model.effects[force->effect].parameters[slot].value;
}
