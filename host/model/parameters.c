/* SPDX-License-Identifier: GPL-3.0-or-later */
/* parameters.c — the parameters of a model as one vector, and back. */
#include "model.h"
#include "model_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const struct per_record_value *effect_record_value(const struct model_effect *effect, int slot, const char *record)
{
    for (size_t i = 0; i < effect->n_per_record; i++)
        if (effect->per_record[i].parameter == slot && strcmp(effect->per_record[i].record, record) == 0)
            return &effect->per_record[i];
    return NULL;
}

bool effect_per_record(const struct model_effect *effect, int slot)
{
    return effect->by_record[slot] || (effect->effect->parameters[slot].flags & BEAM_PARAMETER_PER_RECORD) != 0;
}

/* How often a bare parameter name occurs among all effects, and how often with the same effect, up to (owner). */
static void count_names(const struct model *model, size_t owner, int slot, int *by_name, int *by_effect, int *before)
{
    const struct model_effect *mine = &model->effects[owner];
    *by_name = *by_effect = *before = 0;
    for (size_t i = 0; i < model->n_effects; i++) {
        const struct model_effect *effect = &model->effects[i];
        for (int j = 0; j < effect->effect->n_parameters; j++)
            *by_name += strcmp(effect->parameters[j].name, mine->parameters[slot].name) == 0;
        *by_effect += effect->effect == mine->effect;
        *before += effect->effect == mine->effect && i < owner;
    }
}

static void make_label(const struct model *model, struct parameter_ref *ref, const char *record)
{
    int by_name, by_effect, before;
    const struct model_effect *effect = &model->effects[ref->owner];
    const char *name = ref->info->name, *id = effect->effect->id;
    const char *at = record ? "@" : "", *where = record ? record : "";
    count_names(model, ref->owner, ref->slot, &by_name, &by_effect, &before);
    if (by_name == 1)
        (void)snprintf(ref->label, sizeof ref->label, "%s%s%.60s", name, at, where);
    else if (by_effect == 1)
        (void)snprintf(ref->label, sizeof ref->label, "%.30s.%.30s%s%.60s", id, name, at, where);
    else
        (void)snprintf(ref->label, sizeof ref->label, "%.26s.%d.%.26s%s%.60s", id, before + 1, name, at, where);
}

static void add_shared(struct parameter_ref *ref, enum parameter_role role, size_t owner, const struct parameter *p)
{
    *ref = (struct parameter_ref){.role = role, .owner = owner, .record = -1, .info = p, .value = p->value};
    (void)snprintf(ref->label, sizeof ref->label, "%s", p->name);
}

static size_t add_effect(const struct model *model, size_t owner, const char *const record_names[], size_t n_records,
                         struct parameter_ref *refs)
{
    const struct model_effect *effect = &model->effects[owner];
    size_t n = 0;
    for (int j = 0; j < effect->effect->n_parameters; j++) {
        bool per_record = effect_per_record(effect, j);
        size_t copies = per_record ? n_records : 1;
        for (size_t k = 0; k < copies; k++) {
            struct parameter_ref *ref = &refs[n++];
            const char *record = per_record ? record_names[k] : NULL;
            const struct per_record_value *own = record ? effect_record_value(effect, j, record) : NULL;
            *ref = (struct parameter_ref){.role = ROLE_EFFECT,
                                          .owner = owner,
                                          .slot = j,
                                          .record = record ? (int)k : -1,
                                          .info = &effect->parameters[j],
                                          .value = own ? own->value : effect->parameters[j].value};
            make_label(model, ref, record);
        }
    }
    return n;
}

/* Of a channel what the model lists: its place, its gain. */
static size_t add_channel(const char *name, const struct channel_parameters *own, double at_m,
                          enum parameter_role place, size_t owner, struct parameter_ref *refs)
{
    size_t n = 0;
    if (own->lists_at) {
        add_shared(&refs[n], place, owner, &own->at);
        refs[n].value = at_m;
        (void)snprintf(refs[n++].label, sizeof refs->label, "%s.at_m", name);
    }
    if (own->lists_gain) {
        add_shared(&refs[n], place + 1, owner, &own->gain);
        (void)snprintf(refs[n++].label, sizeof refs->label, "%s.gain", name);
    }
    return n;
}

size_t model_parameters(const struct model *model, const char *const record_names[], size_t n_records,
                        struct parameter_ref **out)
{
    size_t most = 3 * model->n_materials + 6 + model->n_residuals + 2 * (model->n_inputs + model->n_outputs) +
                  model->n_effects * BEAM_EFFECT_PARAMETERS * (n_records + 1);
    struct parameter_ref *refs = bf_alloc(most, sizeof *refs);
    size_t n = 0;
    for (size_t i = 0; i < model->n_materials; i++) {
        add_shared(&refs[n++], ROLE_EI, i, &model->materials[i].EI);
        add_shared(&refs[n++], ROLE_RHO, i, &model->materials[i].rho);
        add_shared(&refs[n++], ROLE_CDI, i, &model->materials[i].cDI);
    }
    add_shared(&refs[n++], ROLE_GAMMA, 0, &model->gamma);
    add_shared(&refs[n++], ROLE_KS, 0, &model->Ks);
    add_shared(&refs[n++], ROLE_KB, 0, &model->KB);
    for (size_t i = 0; i < model->n_residuals; i++)
        add_shared(&refs[n++], ROLE_RESIDUAL, i, &model->residuals[i].compliance);
    for (size_t i = 0; i < model->n_inputs; i++)
        n += add_channel(model->inputs[i].name, &model->inputs[i].own, model->inputs[i].at_m, ROLE_INPUT_PLACE, i,
                         refs + n);
    for (size_t i = 0; i < model->n_outputs; i++)
        n += add_channel(model->outputs[i].name, &model->outputs[i].own, model->outputs[i].at_m, ROLE_OUTPUT_PLACE, i,
                         refs + n);
    if (model->own.lists_length)
        add_shared(&refs[n++], ROLE_LENGTH, 0, &model->own.length);
    if (model->own.lists_from)
        add_shared(&refs[n++], ROLE_PATCH_FROM, 0, &model->own.from);
    if (model->own.lists_to)
        add_shared(&refs[n++], ROLE_PATCH_TO, 0, &model->own.to);
    for (size_t i = 0; i < model->n_effects; i++)
        n += add_effect(model, i, record_names, n_records, refs + n);
    *out = refs;
    return n;
}

static struct parameter *target_of(struct model *model, const struct parameter_ref *ref)
{
    switch (ref->role) {
    case ROLE_EI:
        return &model->materials[ref->owner].EI;
    case ROLE_RHO:
        return &model->materials[ref->owner].rho;
    case ROLE_CDI:
        return &model->materials[ref->owner].cDI;
    case ROLE_GAMMA:
        return &model->gamma;
    case ROLE_KS:
        return &model->Ks;
    case ROLE_KB:
        return &model->KB;
    case ROLE_RESIDUAL:
        return &model->residuals[ref->owner].compliance;
    case ROLE_INPUT_PLACE:
        return &model->inputs[ref->owner].own.at;
    case ROLE_INPUT_GAIN:
        return &model->inputs[ref->owner].own.gain;
    case ROLE_OUTPUT_PLACE:
        return &model->outputs[ref->owner].own.at;
    case ROLE_OUTPUT_GAIN:
        return &model->outputs[ref->owner].own.gain;
    case ROLE_LENGTH:
        return &model->own.length;
    case ROLE_PATCH_FROM:
        return &model->own.from;
    case ROLE_PATCH_TO:
        return &model->own.to;
    case ROLE_EFFECT:
        break;
    }
    return &model->effects[ref->owner].parameters[ref->slot];
}

void effect_set_record_value(struct model_effect *effect, int slot, const char *record, double value, double sd)
{
    size_t i = 0;
    while (i < effect->n_per_record &&
           (effect->per_record[i].parameter != slot || strcmp(effect->per_record[i].record, record) != 0))
        i++;
    if (i == effect->n_per_record) {
        effect->per_record = bf_grow(effect->per_record, i + 1, sizeof *effect->per_record);
        effect->per_record[i] = (struct per_record_value){.parameter = slot};
        (void)snprintf(effect->per_record[i].record, sizeof effect->per_record[i].record, "%s", record);
        effect->n_per_record++;
    }
    effect->per_record[i].value = value;
    effect->per_record[i].sd = sd;
}

/* A place may be as far out as the beam now is: its bound follows the length, and no bound that was stated reaches beyond. */
static void move_bounds(const struct model *before, struct model *model)
{
    for (size_t e = 0; e < model->n_effects; e++)
        for (int i = 0; i < model->effects[e].effect->n_parameters; i++) {
            struct parameter was, now, *own = &model->effects[e].parameters[i];
            model_effect_parameter(before, model->effects[e].effect, i, &was);
            model_effect_parameter(model, model->effects[e].effect, i, &now);
            own->max = own->max < was.max ? fmin(own->max, now.max) : now.max;
        }
}

/* The regions follow the length and the edges that are parameters; where that is no beam they stay, and no prediction is made. */
static void set_geometry(struct model *model)
{
    struct bf_error err;
    struct model before;
    double by_m[MODEL_MOVES] = {0}, from_m, to_m;
    const struct geometry_parameters *own = &model->own;
    if (!own->lists_length && !own->lists_from && !own->lists_to)
        return;
    (void)model_copy(model, &before, &err);
    if (own->lists_length)
        by_m[MOVE_LENGTH] = own->length.value - model->length_m;
    if (model_patch(model, &from_m, &to_m)) {
        by_m[MOVE_FROM] = own->lists_from ? own->from.value - from_m : 0.0;
        by_m[MOVE_TO] = own->lists_to ? own->to.value - to_m : 0.0;
    }
    (void)model_move(&before, by_m, model, &err);
    move_bounds(&before, model);
    model_free(&before);
}

/* What an estimate of the beam's own values (they come before all other roles) moves away from is kept, unless a prior tells it. */
static void keep_start(struct parameter *p, const struct parameter_ref *ref, double value)
{
    const bool moved = value < p->value || value > p->value, known = p->start < 0.0 || p->start > 0.0;
    if (ref->role <= ROLE_KB && moved && !known && !(p->prior > 0.0))
        p->start = p->value;
}

void model_set_parameters(struct model *model, const struct parameter_ref refs[], size_t n, const double value[],
                          const double sd[], const char *const record_names[])
{
    for (size_t i = 0; i < n; i++) {
        const struct parameter_ref *ref = &refs[i];
        if (ref->record >= 0) {
            effect_set_record_value(&model->effects[ref->owner], ref->slot, record_names[ref->record], value[i],
                                    sd ? sd[i] : 0.0);
            continue;
        }
        struct parameter *p = target_of(model, ref);
        if (sd)
            keep_start(p, ref, value[i]);
        p->value = value[i];
        if (ref->role == ROLE_INPUT_PLACE)
            model->inputs[ref->owner].at_m = value[i];
        if (ref->role == ROLE_OUTPUT_PLACE)
            model->outputs[ref->owner].at_m = value[i];
        if (sd)
            p->sd = sd[i];
    }
    set_geometry(model);
}
