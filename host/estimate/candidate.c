/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"
#include "beam/beam.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double mains_Hz[] = {50.0, 60.0};
static const double levels[] = {0.4, 0.6, 0.8, 1.0, 1.3, 1.8, 2.5, 4.0}; /* of the largest value */
static const double scales[] = {0.01, 0.1, 1.0, 10.0};                   /* of the catalogue's start */
enum { PLACES = 12, TIMES = 10 };

/* ---- Roles and grids ---- */

struct scan {
    const struct model *model;
    const struct record *records;
    size_t n_records;
    const struct candidate_options *options;
};

static enum candidate_role role_of(const struct beam_parameter_info *info)
{
    if (info->flags & BEAM_PARAMETER_HELD)
        return CANDIDATE_KEPT;
    if (info->role == BEAM_ROLE_PHASE)
        return CANDIDATE_PHASE;
    if (info->flags & BEAM_PARAMETER_INNER)
        return CANDIDATE_INNER;
    return isinf(info->neutral) ? CANDIDATE_INVERSE : CANDIDATE_STRENGTH;
}

static void add_value(struct candidate *c, int slot, double value)
{
    if (value < c->lower[slot] || value > c->upper[slot] || c->n_grid[slot] == CANDIDATE_GRID)
        return;
    for (size_t i = 0; i < c->n_grid[slot]; i++)
        if (fabs(c->grid[slot][i] - value) <= 1e-9 * fabs(value))
            return;
    c->grid[slot][c->n_grid[slot]++] = value;
}

static void scale_values(struct candidate *c, int slot, double size, const double factor[], size_t n)
{
    for (size_t i = 0; i < n; i++)
        add_value(c, slot, size * factor[i]);
}

static void time_constants(const struct scan *s, struct candidate *c, int slot)
{
    double shortest = INFINITY, longest = 0.0;
    for (size_t r = 0; r < s->n_records; r++) {
        shortest = fmin(shortest, s->records[r].dt_s);
        longest = fmax(longest, (double)s->records[r].n * s->records[r].dt_s);
    }
    for (int i = 0; i < TIMES && longest > shortest; i++)
        add_value(c, slot, shortest * pow(longest / shortest, (double)i / (TIMES - 1)));
}

/* A line in the sensor's wire comes from the mains; one of the bench from anything that turns. */
static bool of_mains(double frequency_Hz)
{
    enum { HARMONICS = 8 };
    static const double off = 0.01, lowest_Hz = 45.0, highest_Hz = 65.0; /* a generator may run anywhere between */
    if (frequency_Hz >= lowest_Hz && frequency_Hz <= highest_Hz)
        return true;
    for (size_t m = 0; m < sizeof mains_Hz / sizeof *mains_Hz; m++)
        for (int k = 1; k <= HARMONICS; k++)
            if (fabs(frequency_Hz - k * mains_Hz[m]) < off * k * mains_Hz[m])
                return true;
    return false;
}

static void frequencies(const struct scan *s, struct candidate *c, int slot)
{
    for (size_t i = 0; s->options && i < s->options->n_lines && i < CANDIDATE_GRID - 2; i++)
        if (c->effect->signal == NULL || of_mains(s->options->line_Hz[i]))
            add_value(c, slot, s->options->line_Hz[i]);
    scale_values(c, slot, 1.0, mains_Hz, sizeof mains_Hz / sizeof *mains_Hz);
    if (c->n_grid[slot] == 0)
        add_value(c, slot, c->start[slot]);
}

/* Does the effect act on this channel, by its default or by name? */
static bool acts_on(const struct candidate *c, bool output, int kind, const char *name)
{
    if (c->channel[0] != '\0')
        return strcmp(c->channel, name) == 0;
    switch (c->effect->channels) {
    case BEAM_CHANNELS_PATCH_OUTPUT:
        return output && kind == (int)OUTPUT_PATCH_STRAIN;
    case BEAM_CHANNELS_EVERY_OUTPUT:
        return output;
    case BEAM_CHANNELS_PATCH_INPUT:
        return !output && kind == (int)INPUT_PATCH_MOMENT;
    case BEAM_CHANNELS_POINT_INPUT:
        return !output && kind == (int)INPUT_POINT_FORCE;
    case BEAM_CHANNELS_NONE:
        break;
    }
    return false;
}

/* Largest |x| of a column over the records; negative when no record has it. */
static double peak_of(const struct scan *s, const char *name)
{
    double peak = -1.0;
    for (size_t r = 0; r < s->n_records; r++) {
        const double *x = record_column(&s->records[r], name);
        for (size_t k = 0; x && k < s->records[r].n; k++)
            peak = fmax(peak, fabs(x[k]));
    }
    return peak;
}

/* Largest value of the channels that the effect acts on; negative when there is none in the records. */
static double largest_value(const struct scan *s, const struct candidate *c)
{
    double largest = -1.0;
    for (size_t o = 0; o < s->model->n_outputs; o++)
        if (acts_on(c, true, (int)s->model->outputs[o].kind, s->model->outputs[o].name))
            largest = fmax(largest, peak_of(s, s->model->outputs[o].name));
    for (size_t i = 0; i < s->model->n_inputs; i++)
        if (acts_on(c, false, (int)s->model->inputs[i].kind, s->model->inputs[i].name))
            largest = fmax(largest, peak_of(s, s->model->inputs[i].name));
    return largest;
}

static void fill_grid(const struct scan *s, struct candidate *c, int slot)
{
    const struct beam_parameter_info *info = &c->effect->parameters[slot];
    const size_t n_scales = sizeof scales / sizeof *scales;
    c->n_grid[slot] = 0;
    if (c->role[slot] != CANDIDATE_INNER && c->role[slot] != CANDIDATE_INVERSE)
        return;
    if (info->role == BEAM_ROLE_PLACE) {
        for (int i = PLACES; i >= 1; i--)
            add_value(c, slot, fmin(s->model->length_m * ((double)i / PLACES), model_last_place_m(s->model)));
    } else if (info->role == BEAM_ROLE_TIME) {
        time_constants(s, c, slot);
    } else if (info->role == BEAM_ROLE_FREQUENCY) {
        frequencies(s, c, slot);
    } else if (info->level_of == BEAM_LEVEL_CHANNEL) {
        const double size = largest_value(s, c);
        scale_values(c, slot, size > 0.0 ? size : c->start[slot], levels, sizeof levels / sizeof *levels);
    } else {
        if (info->neutral == 0.0)
            add_value(c, slot, 0.0);
        scale_values(c, slot, c->start[slot], scales, n_scales);
    }
}

static void fill(const struct scan *s, const struct beam_effect *effect, const char *channel, struct candidate *c)
{
    *c =
        (struct candidate){.effect = effect, .nonlinear = effect->law != NULL || effect->drive != NULL, .strength = -1};
    (void)snprintf(c->channel, sizeof c->channel, "%s", channel);
    for (int i = 0; i < effect->n_parameters; i++) {
        const struct beam_parameter_info *info = &effect->parameters[i];
        const double unit = info->role == BEAM_ROLE_PLACE ? s->model->length_m : 1.0;
        c->role[i] = role_of(info);
        c->start[i] = info->start * unit;
        c->lower[i] = info->minimum * unit;
        c->upper[i] = info->maximum * unit;
        if (info->role == BEAM_ROLE_PLACE) {
            c->start[i] = fmin(c->start[i], model_last_place_m(s->model));
            c->upper[i] = fmin(c->upper[i], model_last_place_m(s->model));
        }
        if (c->strength < 0 && (c->role[i] == CANDIDATE_STRENGTH || c->role[i] == CANDIDATE_INVERSE))
            c->strength = i;
        fill_grid(s, c, i);
    }
}

/* ---- What can act ---- */

static bool needs_patch(const struct candidate *c, const struct model *model)
{
    const struct beam_effect *effect = c->effect;
    const struct beam_place place = model_place(model);
    struct beam_term terms[BEAM_EFFECT_TERMS] = {0};
    struct beam_law_place at = {0};
    struct beam_geometry shift = {0};
    if (effect->terms && effect->terms(c->start, &place, terms) == 0)
        for (int i = 0; i < effect->n_terms; i++)
            if (terms[i].place.kind == BEAM_AT_PATCH || terms[i].place.weight == BEAM_WEIGHT_PATCH)
                return true;
    if (effect->law_place && effect->law_place(c->start, &place, &at) == 0 &&
        (at.points == BEAM_LAW_AT_PATCH || at.weight == BEAM_WEIGHT_PATCH))
        return true;
    return effect->geometry && effect->geometry(c->start, &shift) == 0 && fabs(shift.patch_shift_m) > 0.0;
}

/* "" when the effect can act. */
static void why_not(const struct scan *s, const struct candidate *c, char reason[CANDIDATE_REASON])
{
    const struct model *model = s->model;
    double from_m, to_m;
    struct model trial;
    struct bf_error err;
    reason[0] = '\0';
    bool periodic = false;
    for (size_t r = 0; r < s->n_records; r++)
        periodic = periodic || record_is_periodic(&s->records[r]);
    if (periodic && !effect_is_linear(c->effect)) {
        (void)snprintf(reason, CANDIDATE_REASON, "a frequency response shows linear effects only");
    } else if (c->strength < 0) {
        (void)snprintf(reason, CANDIDATE_REASON, "no parameter of it makes it absent");
    } else if (c->effect->channels != BEAM_CHANNELS_NONE && largest_value(s, c) < 0.0) {
        (void)snprintf(reason, CANDIDATE_REASON, "the records have none of the channels it acts on");
    } else if (needs_patch(c, model) && !model_patch(model, &from_m, &to_m)) {
        (void)snprintf(reason, CANDIDATE_REASON, "the model has no patch");
    } else if (c->effect->releases_root && !model_is_clamped(model)) {
        (void)snprintf(reason, CANDIDATE_REASON, "the beam is not clamped at x = 0");
    } else if (candidate_model(model, c, c->start, &trial, &err) != BF_OK) {
        (void)snprintf(reason, CANDIDATE_REASON, "%.*s", CANDIDATE_REASON - 1, err.text);
    } else {
        model_free(&trial);
    }
}

static void refuse(struct candidate_list *list, const struct beam_effect *effect, const char *reason)
{
    list->refused = bf_grow(list->refused, list->n_refused + 1, sizeof *list->refused);
    struct candidate_refusal *refusal = &list->refused[list->n_refused++];
    *refusal = (struct candidate_refusal){.effect = effect};
    (void)snprintf(refusal->reason, sizeof refusal->reason, "%s", reason);
}

static bool add(const struct scan *s, const struct beam_effect *effect, const char *channel,
                struct candidate_list *list, char reason[CANDIDATE_REASON])
{
    struct candidate c;
    fill(s, effect, channel, &c);
    why_not(s, &c, reason);
    if (reason[0] != '\0')
        return false;
    list->candidates = bf_grow(list->candidates, list->n + 1, sizeof *list->candidates);
    list->candidates[list->n++] = c;
    return true;
}

/* A measurement-chain effect on single outputs: on each, when it was asked for or when there is no default channel. */
static bool add_channels(const struct scan *s, const struct beam_effect *effect, bool have_default,
                         struct candidate_list *list)
{
    char reason[CANDIDATE_REASON];
    bool any = false;
    if (!effect->filter && !effect->map && !effect->signal)
        return false;
    if (have_default && !(s->options && s->options->each_channel))
        return false;
    size_t n_default = 0;
    const struct candidate whole = {.effect = effect};
    for (size_t o = 0; o < s->model->n_outputs; o++)
        n_default += acts_on(&whole, true, (int)s->model->outputs[o].kind, s->model->outputs[o].name);
    for (size_t o = 0; o < s->model->n_outputs; o++) {
        const struct model_output *output = &s->model->outputs[o];
        const bool same = n_default == 1 && acts_on(&whole, true, (int)output->kind, output->name);
        if (!same && add(s, effect, output->name, list, reason))
            any = true;
    }
    return any;
}

static void consider(const struct scan *s, const struct beam_effect *effect, struct candidate_list *list)
{
    char reason[CANDIDATE_REASON];
    for (size_t i = 0; s->options && i < s->options->n_without; i++) {
        if (strcmp(s->options->without[i], effect->id) == 0) {
            refuse(list, effect, "left out on request");
            return;
        }
    }
    if (model_has_effect(s->model, effect)) {
        refuse(list, effect, "the model has it");
        return;
    }
    if (effect_has_own(effect)) {
        refuse(list, effect, "tried where no other effect explains the records");
        return;
    }
    const bool whole = add(s, effect, "", list, reason);
    if (!add_channels(s, effect, whole, list) && !whole)
        refuse(list, effect, reason);
}

enum bf_status candidate_list_new(const struct model *model, const struct record records[], size_t n_records,
                                  const struct candidate_options *options, struct candidate_list *out,
                                  struct bf_error *err)
{
    const struct scan s = {model, records, n_records, options};
    *out = (struct candidate_list){0};
    for (size_t i = 0; options && i < options->n_without; i++)
        if (!effect_find(options->without[i], err))
            return BF_USAGE;
    for (int i = 0; i < beam_effects_count; i++)
        consider(&s, beam_effects[i], out);
    return BF_OK;
}

void candidate_list_free(struct candidate_list *list)
{
    free(list->candidates), free(list->refused);
    *list = (struct candidate_list){0};
}

enum bf_status candidate_model(const struct model *base, const struct candidate *candidate, const double p[],
                               struct model *out, struct bf_error *err)
{
    enum bf_status status = model_copy(base, out, err);
    if (status)
        return status;
    status = model_append_effect(out, candidate->effect->id, candidate->channel, err);
    if (!status) {
        struct parameter *parameters = out->effects[out->n_effects - 1].parameters;
        for (int i = 0; i < candidate->effect->n_parameters; i++) {
            parameters[i].value = p[i];
            parameters[i].fixed = candidate->role[i] == CANDIDATE_KEPT;
        }
        status = model_check(out, err);
    }
    if (status) {
        model_free(out);
        return err->status = BF_USAGE;
    }
    return BF_OK;
}
