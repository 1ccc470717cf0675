/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What an effect's parameters are to its trial, told from the catalogue: strength, place, thresholds and their scales. */
#include "trial_roles.h"

bool trial_possible(const struct beam_effect *effect)
{
    return effect->law != NULL && effect->law_place != NULL;
}

/* The force is proportional to all its strengths and levels of force together. */
static bool scales_force(const struct beam_parameter_info *info)
{
    return info->role == BEAM_ROLE_STRENGTH || info->level_of == BEAM_LEVEL_ELASTIC ||
           info->level_of == BEAM_LEVEL_VISCOUS;
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
        if (out->strength < 0 && (flags & (BEAM_PARAMETER_INNER | BEAM_PARAMETER_HELD)) == 0)
            out->strength = s;
        else if (where.at_parameter == s + 1)
            out->position = s;
        else if ((flags & BEAM_PARAMETER_HELD) == 0)
            out->inner[out->n_inner++] = s;
    }
    if (out->strength < 0)
        return bf_fail(err, BF_USAGE, "effect %s has no parameter that is its strength", effect->id);
    out->with_strength[out->strength] = true;
    for (int i = 0; i < out->n_inner; i++) {
        const int s = out->inner[i];
        out->with_strength[s] = scales_force(&effect->parameters[s]);
        out->scale[s] = effect->parameters[s].level_of;
        if (out->scale[s] == BEAM_LEVEL_CHANNEL) /* there is no channel in a trial of forces */
            out->scale[s] = BEAM_LEVEL_OWN;
    }
    return BF_OK;
}

double trial_unit(const struct trial_force *force, const struct trial_roles *roles, int slot)
{
    double w, v, k = force->model.effects[force->effect].parameters[roles->strength].value;
    trial_force_scales(force, &w, &v);
    switch (roles->scale[slot]) {
    case BEAM_LEVEL_COORDINATE:
        return w;
    case BEAM_LEVEL_RATE:
        return v;
    case BEAM_LEVEL_ELASTIC:
        return k * w;
    case BEAM_LEVEL_VISCOUS:
        return k * v;
    case BEAM_LEVEL_CHANNEL:
    case BEAM_LEVEL_OWN:
        break;
    }
    return force->model.effects[force->effect].parameters[slot].value;
}
