/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_check.c — what can be said about a model without data: faults, and values that look like another unit. */
#include "model_check.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct check {
    const struct model *model;
    struct model_where *where;
    struct bf_error *err;
};

/* Fault at section/item/key. */
static enum bf_status fault(struct check *c, struct model_where where, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static enum bf_status fault(struct check *c, struct model_where where, const char *format, ...)
{
    char text[600];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    *c->where = where;
    return bf_fail(c->err, BF_BAD_FILE, "%s", text);
}

static enum bf_status check_beam(struct check *c)
{
    const struct model *m = c->model;
    if (!(m->length_m > 0.0) || isinf(m->length_m))
        return fault(c, (struct model_where){"beam", "length_m", 0, NULL},
                     "length_m is %g; the free length of the beam in metres must be above 0", m->length_m);
    double edge = 0.0;
    for (size_t i = 0; i < m->n_regions; i++) {
        const struct region *region = &m->regions[i];
        const struct model_where where = {"beam", "regions", 0, NULL};
        if (!(region->to_m > region->from_m))
            return fault(c, where, "region '%s' from %g to %g m is empty; 'to' must be larger than 'from'",
                         region->name, region->from_m, region->to_m);
        if (fabs(region->from_m - edge) > 0.0)
            return fault(c, where, "region '%s' begins at %g m, the one before it ends at %g m; let them meet",
                         region->name, region->from_m, edge);
        edge = region->to_m;
        if (!model_material(m, region->name))
            return fault(c, where, "region '%s' has no EI, rho and cDI; add them", region->name);
    }
    if (m->n_regions == 0 || fabs(edge - m->length_m) > 0.0)
        return fault(c, (struct model_where){"beam", "regions", 0, NULL},
                     "the regions end at %g m, the beam at %g m; cover the whole beam", edge, m->length_m);
    return BF_OK;
}

/* strictly: must be > 0; else ≥ 0 unless signed_value. */
static enum bf_status check_range(struct check *c, const struct parameter *p, struct model_where where,
                                  bool infinite_value)
{
    if (isnan(p->value) || (isinf(p->value) && !infinite_value))
        return fault(c, where, "%s is not a finite number; write one", p->name);
    if (isnan(p->min) || isnan(p->max) || p->min > p->max)
        return fault(c, where, "%s: min %g is larger than max %g; exchange them", p->name, p->min, p->max);
    if (p->value < p->min || p->value > p->max)
        return fault(c, where, "%s: value %g lies outside %g … %g %s; correct the value or the bounds", p->name,
                     p->value, p->min, p->max, p->unit);
    if (!isfinite(p->start) || (p->logarithmic && p->start < 0.0))
        return fault(c, where, "%s: start %g; it is the value before the first fit, of the sign of value; delete it",
                     p->name, p->start);
    if (p->prior < 0.0 || isnan(p->prior) || isinf(p->prior))
        return fault(c, where, "%s: prior %g; a prior is a relative standard deviation above 0, e.g. 0.03", p->name,
                     p->prior);
    if (p->prior > 0.0 && (p->prior_value == 0.0 || !isfinite(p->prior_value)))
        return fault(c, where, "%s: a relative prior around %g says nothing; delete prior or give a value", p->name,
                     p->prior_value);
    if (p->prior > 0.0 && p->logarithmic && p->prior_value < 0.0)
        return fault(c, where, "%s: prior_value %g is negative but the value is positive; correct one of them", p->name,
                     p->prior_value);
    return BF_OK;
}

static enum bf_status check_positive(struct check *c, const struct parameter *p, const char *what, bool zero_allowed)
{
    const struct model_where where = {"parameters", p->name, 0, NULL};
    enum bf_status status = check_range(c, p, where, false);
    if (status != BF_OK)
        return status;
    if (p->value < 0.0 || (p->value == 0.0 && !zero_allowed))
        return fault(c, where, "%s is %g; %s must be %s 0", p->name, p->value, what,
                     zero_allowed ? "at least" : "larger than");
    return BF_OK;
}

static enum bf_status check_parameters(struct check *c)
{
    const struct model *m = c->model;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < m->n_materials && status == BF_OK; i++) {
        const struct material *material = &m->materials[i];
        if ((status = check_positive(c, &material->EI, "a bending stiffness", false)) == BF_OK &&
            (status = check_positive(c, &material->rho, "a mass per length", false)) == BF_OK)
            status = check_positive(c, &material->cDI, "a damping", true);
    }
    if (status == BF_OK)
        status = check_positive(c, &m->gamma, "a damping", true);
    if (status == BF_OK)
        status = check_range(c, &m->Ks, (struct model_where){"parameters", m->Ks.name, 0, NULL}, false);
    if (status == BF_OK)
        status = check_range(c, &m->KB, (struct model_where){"parameters", m->KB.name, 0, NULL}, false);
    return status;
}

static enum bf_status check_place(struct check *c, struct model_where where, const char *what, double x_m)
{
    double length = c->model->length_m;
    if (x_m >= 0.0 && x_m <= length)
        return BF_OK;
    char advice[PLACE_ADVICE];
    model_place_advice(x_m, length, advice);
    return fault(c, where, "%s is %g m, outside the beam (0 … %g m); %s", what, x_m, length, advice);
}

/* An effect that is held at the end of a beam whose length is a parameter would be off it at once. */
static enum bf_status check_ends(struct check *c)
{
    const struct model *m = c->model;
    if (!m->own.lists_length)
        return BF_OK;
    const enum bf_status status =
        check_range(c, &m->own.length, (struct model_where){"beam", "length_m", 0, NULL}, false);
    for (size_t e = 0; e < m->n_effects && !status; e++)
        for (int j = 0; j < m->effects[e].effect->n_parameters; j++) {
            const struct beam_parameter_info *info = &m->effects[e].effect->parameters[j];
            if (info->role == BEAM_ROLE_PLACE && !(m->effects[e].parameters[j].value < m->length_m))
                return fault(c, (struct model_where){"effects", NULL, e, info->name},
                             "%s sits at the free end of a beam whose length_m is a parameter; put it 1 mm before it, "
                             "or write tip_mass for a mass there",
                             m->effects[e].effect->id);
        }
    return status;
}

static enum bf_status check_patch(struct check *c, struct model_where where, double from_m, double to_m)
{
    enum bf_status status = check_place(c, where, "the patch's beginning", from_m);
    if (status == BF_OK)
        status = check_place(c, where, "the patch's end", to_m);
    if (status == BF_OK && !(to_m > from_m))
        status = fault(c, where, "no patch (from %g to %g m); add `patch_m: [from, to]` to beam or to this channel",
                       from_m, to_m);
    return status;
}

static enum bf_status check_gain(struct check *c, const char *section, const char *channel,
                                 const struct parameter *gain)
{
    const struct model_where where = {section, channel, 0, "gain"};
    if (!gain->name[0] || (isfinite(gain->value) && fabs(gain->value) > 0.0))
        return BF_OK;
    return fault(c, where,
                 "gain is %g; write a number that is not 0, e.g. 1.02, or -1 for a channel that points the other way",
                 gain->value);
}

static enum bf_status check_gains(struct check *c)
{
    const struct model *m = c->model;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < m->n_inputs && !status; i++)
        status = check_gain(c, "inputs", m->inputs[i].name, &m->inputs[i].own.gain);
    for (size_t i = 0; i < m->n_outputs && !status; i++)
        status = check_gain(c, "outputs", m->outputs[i].name, &m->outputs[i].own.gain);
    return status;
}

static enum bf_status check_channels(struct check *c)
{
    const struct model *m = c->model;
    for (size_t i = 0; i < m->n_inputs; i++) {
        const struct model_input *input = &m->inputs[i];
        struct model_where where = {"inputs", input->name, 0, "at_m"};
        enum bf_status status = input->kind == INPUT_POINT_FORCE ? check_place(c, where, "at_m", input->at_m)
                                                                 : check_patch(c, where, input->from_m, input->to_m);
        if (status != BF_OK)
            return status;
        if (input->kind == INPUT_PATCH_MOMENT && m->KB.value == 0.0)
            return fault(c, where, "a patch_moment input without KB_NmpV; add it to parameters (N·m per volt, not 0)");
    }
    for (size_t i = 0; i < m->n_outputs; i++) {
        const struct model_output *output = &m->outputs[i];
        struct model_where where = {"outputs", output->name, 0, "at_m"};
        enum bf_status status = output->kind != OUTPUT_PATCH_STRAIN
                                    ? check_place(c, where, "at_m", output->at_m)
                                    : check_patch(c, where, output->from_m, output->to_m);
        if (status != BF_OK)
            return status;
        if (output->kind == OUTPUT_PATCH_STRAIN && m->Ks.value == 0.0)
            return fault(c, where, "a patch_strain output without Ks_V; add it to parameters (volt per radian, not 0)");
        for (size_t j = 0; j < m->n_inputs; j++)
            if (strcmp(m->inputs[j].name, output->name) == 0)
                return fault(c, where, "'%s' is an input and an output; a column of the record is one or the other",
                             output->name);
    }
    return BF_OK;
}

static bool has_channel(const struct model *m, const char *name, bool input)
{
    for (size_t i = 0; input && i < m->n_inputs; i++)
        if (strcmp(m->inputs[i].name, name) == 0)
            return true;
    for (size_t i = 0; !input && i < m->n_outputs; i++)
        if (strcmp(m->outputs[i].name, name) == 0)
            return true;
    return false;
}

static bool has_default_channel(const struct model *m, enum beam_channels channels)
{
    for (size_t i = 0; i < m->n_inputs; i++)
        if ((channels == BEAM_CHANNELS_PATCH_INPUT && m->inputs[i].kind == INPUT_PATCH_MOMENT) ||
            (channels == BEAM_CHANNELS_POINT_INPUT && m->inputs[i].kind == INPUT_POINT_FORCE))
            return true;
    for (size_t i = 0; i < m->n_outputs; i++)
        if (channels == BEAM_CHANNELS_EVERY_OUTPUT ||
            (channels == BEAM_CHANNELS_PATCH_OUTPUT && m->outputs[i].kind == OUTPUT_PATCH_STRAIN))
            return true;
    return channels == BEAM_CHANNELS_NONE;
}

static enum bf_status check_effect_channel(struct check *c, size_t i)
{
    const struct model_effect *effect = &c->model->effects[i];
    enum beam_channels channels = effect->effect->channels;
    const struct model_where where = {"effects", NULL, i, "channel"};
    bool input = channels == BEAM_CHANNELS_PATCH_INPUT || channels == BEAM_CHANNELS_POINT_INPUT;
    if (effect->channel[0] && channels == BEAM_CHANNELS_NONE)
        return fault(c, where, "effect '%s' acts on the beam, not on a channel; delete channel", effect->effect->id);
    if (effect->channel[0] && !has_channel(c->model, effect->channel, input))
        return fault(c, where, "effect '%s' needs an %s, and '%s' is none; give the name of one", effect->effect->id,
                     input ? "input" : "output", effect->channel);
    if (!effect->channel[0] && !has_default_channel(c->model, channels))
        return fault(c, where, "effect '%s' sits on a %s, and the model has none; name a channel (channel: NAME)",
                     effect->effect->id,
                     channels == BEAM_CHANNELS_PATCH_OUTPUT   ? "patch_strain output"
                     : channels == BEAM_CHANNELS_EVERY_OUTPUT ? "measured output"
                     : channels == BEAM_CHANNELS_PATCH_INPUT  ? "patch_moment input"
                                                              : "point_force input");
    return BF_OK;
}

/* Two uses of one effect must differ in channel, place or time constant, else they cannot be told apart. */
static bool same_place(const struct model_effect *a, const struct model_effect *b)
{
    if (a->effect != b->effect || (a->channel[0] && b->channel[0] && strcmp(a->channel, b->channel) != 0))
        return false;
    for (int j = 0; j < a->effect->n_parameters; j++) {
        const struct beam_parameter_info *info = &a->effect->parameters[j];
        bool tells_apart = (info->flags & BEAM_PARAMETER_INNER) && !(info->flags & BEAM_PARAMETER_PER_RECORD);
        if (tells_apart && fabs(a->parameters[j].value - b->parameters[j].value) > 0.0)
            return false;
    }
    return true;
}

static enum bf_status check_effects(struct check *c)
{
    const struct model *m = c->model;
    for (size_t i = 0; i < m->n_effects; i++) {
        const struct model_effect *effect = &m->effects[i];
        for (int j = 0; j < effect->effect->n_parameters; j++) {
            const struct parameter *p = &effect->parameters[j];
            const struct beam_parameter_info *info = &effect->effect->parameters[j];
            const struct model_where where = {"effects", NULL, i, info->name};
            enum bf_status status = BF_OK;
            if (info->role == BEAM_ROLE_PLACE)
                status = check_place(c, where, info->name, p->value);
            if (status == BF_OK)
                status = check_range(c, p, where, isinf(info->neutral));
            if (status != BF_OK)
                return status;
        }
        enum bf_status status = check_effect_channel(c, i);
        if (status != BF_OK)
            return status;
        for (size_t k = 0; k < i; k++)
            if (same_place(&m->effects[k], effect))
                return fault(c, (struct model_where){"effects", NULL, i, NULL},
                             "the model has effect '%s' already; change its values, or give this one another "
                             "place or channel",
                             effect->effect->id);
    }
    return BF_OK;
}

enum bf_status model_check_where(const struct model *model, struct model_where *where, struct bf_error *err)
{
    struct check c = {model, where, err};
    enum bf_status status = check_beam(&c);
    if (status == BF_OK)
        status = check_parameters(&c);
    if (status == BF_OK)
        status = check_channels(&c);
    if (status == BF_OK)
        status = check_gains(&c);
    if (status == BF_OK)
        status = check_ends(&c);
    if (status == BF_OK)
        status = check_effects(&c);
    return status;
}

enum bf_status model_check(const struct model *model, struct bf_error *err)
{
    struct model_where where = {0};
    if (model_check_where(model, &where, err) == BF_OK)
        return BF_OK;
    if (where.section && strcmp(where.section, "effects") == 0)
        return bf_fail_at(err, model->path ? model->path : "model", 0, "effects, item %zu: %s", where.index + 1,
                          err->text);
    return bf_fail_at(err, model->path ? model->path : "model", 0, "%s%s%s: %s", where.section ? where.section : "",
                      where.item ? " " : "", where.item ? where.item : "", err->text);
}
