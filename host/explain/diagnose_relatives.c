/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnose_relatives.h"
#include "plausible.h"

#include <math.h>
#include <string.h>

/* "sensor_offset on accel_mps2 + tip_mass" */
void hypothesis_name(FILE *out, const struct hypothesis *h)
{
    for (size_t i = 0; i < h->n_effects; i++) {
        const char *channel = h->model.effects[h->n_base + i].channel;
        (void)fprintf(out, "%s%s%s%s", i > 0 ? " + " : "", h->effects[i]->id, channel[0] != '\0' ? " on " : "",
                      channel);
    }
}

bool hypothesis_has(const struct hypothesis *h, const struct beam_effect *effect)
{
    for (size_t i = 0; i < h->n_effects; i++)
        if (h->effects[i] == effect)
            return true;
    return false;
}

int effect_slot(const struct beam_effect *effect, enum beam_role role)
{
    for (int i = 0; i < effect->n_parameters; i++)
        if (effect->parameters[i].role == role)
            return i;
    return -1;
}

bool effect_swings(const struct model_effect *own)
{
    const int slot = effect_slot(own->effect, BEAM_ROLE_RESONANCE);
    return slot >= 0 && !own->parameters[slot].fixed;
}

bool hypothesis_swings(const struct hypothesis *h, const struct beam_effect *effect)
{
    for (size_t i = 0; i < h->n_effects && h->n_base + i < h->model.n_effects; i++)
        if (h->effects[i] == effect && effect_swings(&h->model.effects[h->n_base + i]))
            return true;
    return false;
}

/* The catalogue's starts; places are at the free end. */
static void start_values(const struct beam_effect *effect, const struct model *model, double p[BEAM_EFFECT_PARAMETERS])
{
    for (int j = 0; j < effect->n_parameters; j++)
        p[j] = effect->parameters[j].role == BEAM_ROLE_PLACE ? model->length_m : effect->parameters[j].start;
}

bool diagnose_special_case(const struct beam_effect *small, const struct beam_effect *large, const struct model *model)
{
    double ps[BEAM_EFFECT_PARAMETERS], pl[BEAM_EFFECT_PARAMETERS];
    struct beam_term ts[BEAM_EFFECT_TERMS] = {0}, tl[BEAM_EFFECT_TERMS] = {0};
    const struct beam_place place = model_place(model);
    if (small == large || small->terms == NULL || large->terms == NULL || small->n_terms != large->n_terms ||
        small->n_parameters >= large->n_parameters)
        return false;
    start_values(small, model, ps);
    for (int i = 0; i < large->n_parameters; i++) {
        const struct beam_parameter_info *info = &large->parameters[i];
        pl[i] = info->role == BEAM_ROLE_PLACE ? model->length_m : info->neutral;
        for (int j = 0; j < small->n_parameters; j++)
            if (strcmp(info->name, small->parameters[j].name) == 0)
                pl[i] = ps[j];
    }
    if (small->terms(ps, &place, ts) != 0 || large->terms(pl, &place, tl) != 0)
        return false;
    for (int t = 0; t < small->n_terms; t++) {
        const struct beam_coefficients *a = &ts[t].value, *b = &tl[t].value;
        if (ts[t].place.kind != tl[t].place.kind || ts[t].place.at_m != tl[t].place.at_m || a->mass != b->mass ||
            a->damping != b->damping || a->stiffness != b->stiffness || a->memory != b->memory)
            return false;
    }
    return true;
}

/* At the values that it starts from. Returns how many; 0: it has none there. */
static int terms_at_start(const struct beam_effect *effect, const struct model *model,
                          struct beam_term terms[BEAM_EFFECT_TERMS])
{
    double p[BEAM_EFFECT_PARAMETERS];
    const struct beam_place place = model_place(model);
    if (effect->terms == NULL)
        return 0;
    start_values(effect, model, p);
    return effect->terms(p, &place, terms) == 0 ? effect->n_terms : 0;
}

/* Its only term, where that acts at one point whose place is a parameter. */
static bool term_at_a_place(const struct beam_effect *effect, const struct model *model,
                            struct beam_term terms[BEAM_EFFECT_TERMS])
{
    return effect_slot(effect, BEAM_ROLE_PLACE) >= 0 && terms_at_start(effect, model, terms) == 1 &&
           terms[0].place.kind == BEAM_AT_POINT;
}

/* Tension. */
static bool is_axial(const struct beam_term *term)
{
    return term->place.kind == BEAM_OVER_SLOPE && term->place.weight == BEAM_WEIGHT_ONE && term->value.stiffness != 0.0;
}

bool diagnose_follows_much(const struct beam_effect *effect, const struct model *model)
{
    struct beam_term terms[BEAM_EFFECT_TERMS] = {0};
    return term_at_a_place(effect, model, terms) && (terms[0].value.mass != 0.0 || terms[0].value.stiffness != 0.0);
}

bool diagnose_is_mass(const struct beam_effect *effect, const struct model *model)
{
    struct beam_term terms[BEAM_EFFECT_TERMS] = {0};
    return term_at_a_place(effect, model, terms) && terms[0].value.mass != 0.0 && terms[0].value.stiffness == 0.0;
}

bool diagnose_can_be_changed(const struct beam_effect *effect, const struct model *model)
{
    struct beam_term terms[BEAM_EFFECT_TERMS] = {0};
    const int n = effect->law == NULL ? terms_at_start(effect, model, terms) : 0;
    bool can = false;
    for (int t = 0; t < n; t++)
        can = can || terms[t].place.kind == BEAM_AT_POINT || terms[t].place.kind == BEAM_AT_ROOT || is_axial(&terms[t]);
    return can;
}

double diagnose_large_strength(const struct beam_effect *effect, const struct model *model)
{
    struct beam_term terms[BEAM_EFFECT_TERMS] = {0};
    if (effect->n_parameters != 1 || terms_at_start(effect, model, terms) != 1)
        return 0.0;
    if (terms[0].place.kind == BEAM_AT_POINT && terms[0].value.mass != 0.0)
        return model_mass_kg(model);
    const double EI = model->materials[model_plain_material(model)].EI.value;
    return is_axial(&terms[0]) ? EI * pow(M_PI / model->length_m, 2.0) : 0.0;
}

double diagnose_rigid_Npm(const struct model *model)
{
    static const double rigid = 1e3; /* of EI/l³ */
    return rigid * model->materials[model_plain_material(model)].EI.value / pow(model->length_m, 3.0);
}

bool hypothesis_has_support(const struct hypothesis *h, const struct beam_effect *effect)
{
    for (size_t e = 0; e < h->n_effects && h->n_base + e < h->model.n_effects; e++) {
        const struct parameter *own = h->model.effects[h->n_base + e].parameters;
        if (h->effects[e] == effect && diagnose_follows_much(effect, &h->model) && !diagnose_is_mass(effect, &h->model))
            return own[effect_slot(effect, BEAM_ROLE_STRENGTH)].value >= diagnose_rigid_Npm(&h->model);
    }
    return false;
}

bool hypothesis_support_is_held(const struct hypothesis *h)
{
    for (size_t e = 0; e < h->n_effects && h->n_base + e < h->model.n_effects; e++) {
        const int strength = effect_slot(h->effects[e], BEAM_ROLE_STRENGTH);
        if (hypothesis_has_support(h, h->effects[e]) && h->model.effects[h->n_base + e].parameters[strength].fixed)
            return true;
    }
    return false;
}

/* What is asked for, or a part of it. */
static bool decision_has_one(const struct hypothesis *h, const struct decision *one)
{
    for (size_t i = 0; i < one->n; i++)
        if (hypothesis_has(h, one->among[i]))
            return true;
    return false;
}

bool diagnose_is_kin(const struct beam_effect *one, const struct beam_effect *other, const struct model *model)
{
    return one == other || diagnose_special_case(one, other, model) || diagnose_special_case(other, one, model);
}

bool decision_looks_at(const struct hypothesis *h, const struct decision *one)
{
    bool all = h->n_effects <= one->most_effects;
    for (size_t i = 0; i < one->n_beside; i++)
        all = all && hypothesis_has(h, one->beside[i]);
    return all;
}

bool decision_asks_for(const struct hypothesis *h, const struct decision *one)
{
    return decision_looks_at(h, one) && decision_has_one(h, one) && !is_stand_in(h);
}
