/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_parts.c — the parts of a model: their names, memory, values at a place; residuals and parameters as they begin. */
#include "model_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

const char *model_support_name(enum model_support support)
{
    static const char *const names[] = {"clamped-free", "clamped-clamped", "pinned-pinned", "free-free"};
    return (size_t)support < sizeof names / sizeof *names ? names[support] : NULL;
}

const char *model_input_kind_name(enum input_kind kind)
{
    static const char *const names[] = {"point_force", "patch_moment"};
    return (size_t)kind < sizeof names / sizeof *names ? names[kind] : NULL;
}

const char *model_output_kind_name(enum output_kind kind)
{
    static const char *const names[] = {"displacement", "velocity", "acceleration", "patch_strain"};
    return (size_t)kind < sizeof names / sizeof *names ? names[kind] : NULL;
}

void model_parameter_init(struct parameter *out, const char *name, const char *unit, bool may_be_negative)
{
    *out = (struct parameter){.min = may_be_negative ? -HUGE_VAL : 0.0, .max = HUGE_VAL};
    (void)snprintf(out->name, sizeof out->name, "%s", name);
    (void)snprintf(out->unit, sizeof out->unit, "%s", unit);
}

void model_channel_init(struct channel_parameters *out, double length_m)
{
    model_parameter_init(&out->at, "at_m", "m", false);
    model_parameter_init(&out->gain, "gain", "", true);
    out->at.max = length_m;
    out->at.fixed = out->gain.fixed = true;
    out->gain.value = 1.0;
}

void model_channel_open_place(struct channel_parameters *own, double at_m, double sd_m)
{
    own->lists_at = true, own->at.fixed = false;
    own->at.value = own->at.prior_value = at_m;
    own->at.prior = sd_m / at_m;
}

void model_channel_open_gain(struct channel_parameters *own, double relative_sd)
{
    own->lists_gain = true, own->gain.fixed = false, own->gain.logarithmic = own->gain.value > 0.0;
    own->gain.prior_value = own->gain.value;
    own->gain.prior = relative_sd;
}

static void free_fit(struct fit_info *fit)
{
    for (size_t i = 0; i < fit->n_records; i++) {
        free(fit->records[i].file);
        free(fit->records[i].channels);
    }
    free(fit->records);
    free(fit->ancestors);
    *fit = (struct fit_info){0};
}

void model_free(struct model *model)
{
    for (size_t i = 0; i < model->n_effects; i++)
        free(model->effects[i].per_record);
    free(model->stated);
    free(model->residuals);
    free(model->effects);
    free(model->path);
    free(model->regions);
    free(model->materials);
    free(model->inputs);
    free(model->outputs);
    free(model->document);
    free_fit(&model->fit);
    *model = (struct model){0};
}

static void *copy_array(const void *from, size_t n, size_t size)
{
    if (n == 0)
        return NULL;
    void *copy = bf_alloc(n, size);
    memcpy(copy, from, n * size);
    return copy;
}

static void copy_fit(const struct fit_info *from, struct fit_info *out)
{
    out->ancestors = copy_array(from->ancestors, from->n_ancestors, sizeof *from->ancestors);
    out->records = copy_array(from->records, from->n_records, sizeof *from->records);
    for (size_t i = 0; i < from->n_records; i++) {
        const struct fit_record *record = &from->records[i];
        out->records[i].file = bf_strdup(record->file);
        out->records[i].channels = copy_array(record->channels, record->n_channels, sizeof *record->channels);
    }
}

enum bf_status model_copy(const struct model *from, struct model *out, struct bf_error *err)
{
    (void)err;
    *out = *from;
    out->path = from->path ? bf_strdup(from->path) : NULL;
    out->document = from->document ? bf_strdup(from->document) : NULL;
    out->regions = copy_array(from->regions, from->n_regions, sizeof *from->regions);
    out->materials = copy_array(from->materials, from->n_materials, sizeof *from->materials);
    out->inputs = copy_array(from->inputs, from->n_inputs, sizeof *from->inputs);
    out->outputs = copy_array(from->outputs, from->n_outputs, sizeof *from->outputs);
    out->stated = copy_array(from->stated, from->n_stated, sizeof *from->stated);
    out->residuals = copy_array(from->residuals, from->n_residuals, sizeof *from->residuals);
    out->effects = copy_array(from->effects, from->n_effects, sizeof *from->effects);
    for (size_t i = 0; i < from->n_effects; i++)
        out->effects[i].per_record =
            copy_array(from->effects[i].per_record, from->effects[i].n_per_record, sizeof *from->effects[i].per_record);
    copy_fit(&from->fit, &out->fit);
    return BF_OK;
}

static bool has_residual(const struct model_output *output, const struct model_input *input)
{
    return output->kind == OUTPUT_ACCELERATION ||
           (output->kind == OUTPUT_PATCH_STRAIN && input->kind == INPUT_POINT_FORCE);
}

void model_make_residuals(struct model *model)
{
    if (model->n_residuals > 0)
        return;
    model->residuals = bf_alloc(model->n_outputs * model->n_inputs, sizeof *model->residuals);
    for (size_t o = 0; o < model->n_outputs; o++) {
        for (size_t i = 0; i < model->n_inputs; i++) {
            if (!has_residual(&model->outputs[o], &model->inputs[i]))
                continue;
            struct model_residual *r = &model->residuals[model->n_residuals++];
            *r = (struct model_residual){.output = o, .input = i};
            char name[MODEL_NAME];
            (void)snprintf(name, sizeof name, "residual_%.26s_%.26s", model->outputs[o].name, model->inputs[i].name);
            bool volt_out = model->outputs[o].kind == OUTPUT_PATCH_STRAIN;
            bool volt_in = model->inputs[i].kind == INPUT_PATCH_MOMENT;
            model_parameter_init(&r->compliance, name, volt_out ? "V/N" : volt_in ? "m/V" : "m/N", true);
        }
    }
}

double model_input_gain(const struct model *model, size_t input)
{
    const struct model_input *channel = &model->inputs[input];
    if (channel->kind == INPUT_PATCH_MOMENT)
        return model->KB.value;
    return channel->own.gain.name[0] ? channel->own.gain.value : 1.0;
}

double model_output_gain(const struct model *model, size_t output)
{
    const struct model_output *channel = &model->outputs[output];
    if (channel->kind == OUTPUT_PATCH_STRAIN)
        return model->Ks.value;
    return channel->own.gain.name[0] ? channel->own.gain.value : 1.0;
}

bool model_patch(const struct model *model, double *from_m, double *to_m)
{
    for (size_t i = 0; i < model->n_regions; i++) {
        if (strcmp(model->regions[i].name, "patch") != 0)
            continue;
        *from_m = model->regions[i].from_m;
        *to_m = model->regions[i].to_m;
        while (++i < model->n_regions && strcmp(model->regions[i].name, "patch") == 0)
            *to_m = model->regions[i].to_m;
        return true;
    }
    for (size_t i = 0; i < model->n_inputs; i++) {
        if (model->inputs[i].kind == INPUT_PATCH_MOMENT) {
            *from_m = model->inputs[i].from_m;
            *to_m = model->inputs[i].to_m;
            return true;
        }
    }
    for (size_t i = 0; i < model->n_outputs; i++) {
        if (model->outputs[i].kind == OUTPUT_PATCH_STRAIN) {
            *from_m = model->outputs[i].from_m;
            *to_m = model->outputs[i].to_m;
            return true;
        }
    }
    return false;
}

const struct material *model_material(const struct model *model, const char *region)
{
    for (size_t i = 0; i < model->n_materials; i++)
        if (strcmp(model->materials[i].name, region) == 0)
            return &model->materials[i];
    return NULL;
}

double model_weight(const struct model *model, const struct material *material, enum beam_weight weight)
{
    switch (weight) {
    case BEAM_WEIGHT_RHO:
        return material->rho.value;
    case BEAM_WEIGHT_EI:
        return material->EI.value;
    case BEAM_WEIGHT_CDI:
        return material->cDI.value;
    case BEAM_WEIGHT_PATCH:
        return strcmp(material->name, "patch") == 0 ? 1.0 : 0.0;
    case BEAM_WEIGHT_TURNING: {
        const struct material *plain = &model->materials[model_plain_material(model)];
        return material->rho.value * plain->EI.value / plain->rho.value;
    }
    case BEAM_WEIGHT_ONE:
        break;
    }
    return 1.0;
}

size_t model_plain_material(const struct model *model)
{
    size_t bare = model->n_materials;
    for (size_t i = model->n_materials; i-- > 0;) {
        if (strcmp(model->materials[i].name, "beam") == 0)
            return i;
        if (strcmp(model->materials[i].name, "patch") != 0)
            bare = i;
    }
    return bare < model->n_materials ? bare : 0;
}

double model_mass_kg(const struct model *model)
{
    double mass = 0.0;
    for (size_t r = 0; r < model->n_regions; r++) {
        const struct material *material = model_material(model, model->regions[r].name);
        if (material != NULL)
            mass += material->rho.value * (model->regions[r].to_m - model->regions[r].from_m);
    }
    return mass;
}

double model_last_place_m(const struct model *model)
{
    static const double before_the_end = 0.01;
    return model->own.lists_length ? (1.0 - before_the_end) * model->length_m : model->length_m;
}

struct beam_place model_place(const struct model *model)
{
    struct beam_place place = {.length_m = model->length_m};
    (void)model_patch(model, &place.patch_from_m, &place.patch_to_m);
    return place;
}

void model_forget_fit(struct model *model)
{
    struct parameter *shared[] = {&model->gamma,      &model->Ks,       &model->KB,
                                  &model->own.length, &model->own.from, &model->own.to};
    for (size_t i = 0; i < sizeof shared / sizeof *shared; i++)
        shared[i]->sd = 0.0;
    for (size_t i = 0; i < model->n_inputs; i++)
        model->inputs[i].own.at.sd = model->inputs[i].own.gain.sd = 0.0;
    for (size_t i = 0; i < model->n_outputs; i++)
        model->outputs[i].own.at.sd = model->outputs[i].own.gain.sd = 0.0;
    for (size_t i = 0; i < model->n_residuals; i++)
        model->residuals[i].compliance.sd = 0.0;
    for (size_t i = 0; i < model->n_materials; i++)
        model->materials[i].EI.sd = model->materials[i].rho.sd = model->materials[i].cDI.sd = 0.0;
    for (size_t i = 0; i < model->n_effects; i++) {
        for (int j = 0; j < model->effects[i].effect->n_parameters; j++)
            model->effects[i].parameters[j].sd = 0.0;
        for (size_t j = 0; j < model->effects[i].n_per_record; j++)
            model->effects[i].per_record[j].sd = 0.0;
    }
    struct fit_info *fit = &model->fit;
    struct fit_info lineage = {.n_ancestors = fit->n_ancestors, .ancestors = fit->ancestors};
    memcpy(lineage.parent_sha256, fit->parent_sha256, sizeof lineage.parent_sha256);
    fit->ancestors = NULL;
    free_fit(fit);
    *fit = lineage;
}
