/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Turns of a phase: with one sinusoid at most one of them stands on the maximum. Records whose values a strength begins at. */
enum { TURNS = 3, OTHERS = 6 };

void own_values_free(struct own_values *own)
{
    for (size_t i = 0; i < own->n_notes; i++)
        free(own->notes[i]);
    free(own->notes);
    if (own->copy)
        model_free(own->copy);
    free(own->copy);
    *own = (struct own_values){0};
}

/* Free, of this record alone, and without a value. */
static bool is_missing(const struct model *model, const struct parameter_ref *ref, const char *name)
{
    return ref->record >= 0 && !ref->info->fixed &&
           effect_record_value(&model->effects[ref->owner], ref->slot, name) == NULL;
}

static bool is_phase(const struct model *model, const struct parameter_ref *ref)
{
    return ref->role == ROLE_EFFECT && model->effects[ref->owner].effect->parameters[ref->slot].role == BEAM_ROLE_PHASE;
}

static struct parameter *parameter_of(struct model *model, const struct parameter_ref *ref)
{
    return &model->effects[ref->owner].parameters[ref->slot];
}

/* What the missing parameters begin at: phases at the model's value plus a turn, others at the model's or at that of another record. */
struct own_start {
    double turn;
    const char *other; /* NULL: the model's */
};

/* Holds all parameters but the missing ones. */
static void prepare(const struct model *model, const struct parameter_ref refs[], size_t n, const char *name,
                    const struct own_start *start, struct model *trial)
{
    for (size_t i = 0; i < trial->n_materials; i++)
        trial->materials[i].EI.fixed = trial->materials[i].rho.fixed = trial->materials[i].cDI.fixed = true;
    trial->gamma.fixed = trial->Ks.fixed = trial->KB.fixed = true;
    trial->own.length.fixed = trial->own.from.fixed = trial->own.to.fixed = true;
    for (size_t i = 0; i < trial->n_inputs; i++)
        trial->inputs[i].own.at.fixed = trial->inputs[i].own.gain.fixed = true;
    for (size_t i = 0; i < trial->n_outputs; i++)
        trial->outputs[i].own.at.fixed = trial->outputs[i].own.gain.fixed = true;
    for (size_t i = 0; i < trial->n_residuals; i++)
        trial->residuals[i].compliance.fixed = true;
    for (size_t i = 0; i < n; i++) {
        if (refs[i].role != ROLE_EFFECT)
            continue;
        struct parameter *p = parameter_of(trial, &refs[i]);
        p->fixed = !is_missing(model, &refs[i], name);
        if (p->fixed)
            continue;
        const struct per_record_value *known =
            start->other ? effect_record_value(&model->effects[refs[i].owner], refs[i].slot, start->other) : NULL;
        if (is_phase(model, &refs[i]))
            p->value += start->turn;
        else if (known)
            p->value = known->value;
    }
}

/* Records that have a value of this parameter, OTHERS at most, spread over all of them. */
static size_t others_of(const struct model *model, const struct parameter_ref *ref, struct own_start starts[])
{
    const struct model_effect *effect = &model->effects[ref->owner];
    size_t n = 0, seen = 0, found = 0;
    for (size_t k = 0; k < effect->n_per_record; k++)
        n += effect->per_record[k].parameter == ref->slot;
    for (size_t k = 0; k < effect->n_per_record; k++) {
        if (effect->per_record[k].parameter != ref->slot)
            continue;
        if (found < OTHERS && seen * OTHERS >= found * n)
            starts[found++] = (struct own_start){.other = effect->per_record[k].record};
        seen++;
    }
    return found;
}

/* starts: [TURNS + OTHERS]; the model's own values first. */
static size_t starts_of(const struct model *model, const struct parameter_ref refs[], size_t n, const char *name,
                        struct own_start starts[])
{
    const struct parameter_ref *strength = NULL; /* the first that is no phase */
    size_t turns = 1;
    for (size_t i = 0; i < n; i++) {
        if (!is_missing(model, &refs[i], name))
            continue;
        if (is_phase(model, &refs[i]))
            turns = TURNS;
        else if (strength == NULL)
            strength = &refs[i];
    }
    for (size_t k = 0; k < turns; k++)
        starts[k] = (struct own_start){.turn = 2.0 * M_PI * (double)k / TURNS};
    return turns + (strength ? others_of(model, strength, starts + turns) : 0);
}

/* What the model leaves of the record from a start; infinite where it has no value. */
static double left_from(const struct model *model, const struct record *record, const struct parameter_ref refs[],
                        size_t n, const struct fit_options *options, const struct own_start *start)
{
    struct model trial;
    struct bf_error ignored;
    struct fit_channel_error *channels = NULL;
    size_t n_channels;
    double nrmse = HUGE_VAL, ratio;
    if (model_copy(model, &trial, &ignored) != BF_OK)
        return HUGE_VAL;
    prepare(model, refs, n, record_base_name(record), start, &trial);
    if (fit_errors(&trial, record, 1, options, &channels, &n_channels, &ignored) == BF_OK)
        fit_totals(channels, n_channels, &nrmse, &ratio);
    free(channels);
    model_free(&trial);
    return nrmse;
}

/* Turns alone: the misfit of a sinusoid has one minimum, which the nearest turn leads to. Returns how many starts are left, the first. */
static size_t keep_nearest_turn(const struct model *model, const struct record *record,
                                const struct parameter_ref refs[], size_t n, const struct fit_options *options,
                                struct own_start starts[], size_t n_starts)
{
    double least = HUGE_VAL;
    size_t nearest = 0;
    for (size_t k = 0; k < n_starts; k++) {
        const double left = left_from(model, record, refs, n, options, &starts[k]);
        if (left < least)
            least = left, nearest = k;
    }
    starts[0] = starts[nearest];
    return isfinite(least) ? 1 : n_starts;
}

/* The best of the starts; *out is empty when no start has a value. */
static enum bf_status fit_one(const struct model *model, const struct record *record, const struct parameter_ref refs[],
                              size_t n, const struct fit_options *options, struct fit_result *out, struct bf_error *err)
{
    const char *name = record_base_name(record);
    double lowest = HUGE_VAL;
    enum bf_status status = BF_OK;
    struct own_start starts[TURNS + OTHERS];
    const struct fit_options own_options = {
        .start = FIT_NEAR, .never_search = true, .quiet = true, .sigma = options->sigma, .predict = options->predict};
    size_t n_starts = starts_of(model, refs, n, name, starts);
    if (n_starts == TURNS && starts[TURNS - 1].other == NULL)
        n_starts = keep_nearest_turn(model, record, refs, n, &own_options, starts, n_starts);
    *out = (struct fit_result){0};
    for (size_t k = 0; k < n_starts && !status; k++) {
        struct model trial;
        struct fit_result result;
        status = model_copy(model, &trial, err);
        if (status)
            return status;
        prepare(model, refs, n, name, &starts[k], &trial);
        status = fit_run(&trial, record, 1, &own_options, &result, err);
        model_free(&trial);
        if (!status && result.nrmse < lowest) {
            lowest = result.nrmse;
            fit_free(out);
            *out = result;
        } else if (!status) {
            fit_free(&result);
        } else if (status == BF_NUMERIC || status == BF_BAD_FILE) {
            status = BF_OK; /* no value there, or a record without an output: nothing to learn from it */
        }
    }
    return status;
}

static void say(struct own_values *own, const struct parameter_ref *ref, const char *name, double value)
{
    char text[512];
    (void)snprintf(text, sizeof text,
                   "%s of %.200s estimated from the record itself (%.4g %s): held-out errors allow for it",
                   ref->info->name, name, value, ref->info->unit);
    own->notes = bf_grow(own->notes, own->n_notes + 1, sizeof *own->notes);
    own->notes[own->n_notes++] = bf_strdup(text);
}

static enum bf_status complete(const struct model *model, const struct record *record,
                               const struct fit_options *options, struct own_values *own, struct bf_error *err)
{
    const char *name = record_base_name(record);
    struct parameter_ref *refs;
    const size_t n = model_parameters(model, &name, 1, &refs);
    bool missing = false;
    for (size_t i = 0; i < n; i++)
        missing = missing || is_missing(model, &refs[i], name);
    struct fit_result result = {0};
    enum bf_status status = missing ? fit_one(model, record, refs, n, options, &result, err) : BF_OK;
    for (size_t i = 0; i < n && !status && result.n_parameters == n; i++) {
        if (!is_missing(model, &refs[i], name) || !result.parameters[i].identifiable)
            continue;
        if (!own->copy) {
            own->copy = bf_alloc(1, sizeof *own->copy);
            status = model_copy(model, own->copy, err);
            own->model = own->copy;
        }
        double value = result.parameters[i].value;
        if (is_phase(model, &refs[i]))
            value = remainder(value, 2.0 * M_PI);
        if (!status) {
            model_set_parameters(own->copy, &refs[i], 1, &value, &result.parameters[i].sd, &name);
            say(own, &refs[i], name, value);
        }
    }
    fit_free(&result);
    free(refs);
    return status;
}

static size_t n_channels_of(const struct model *model, const struct record *record)
{
    size_t n = 0;
    for (size_t o = 0; o < model->n_outputs; o++)
        n += record_column(record, model->outputs[o].name) != NULL;
    return n;
}

enum bf_status own_values_find(const struct model *model, const struct record records[], size_t n_records,
                               const struct fit_options *options, struct own_values *out, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    struct fit_options own_options = *options;
    *out = (struct own_values){.model = model};
    for (size_t r = 0; r < n_records && !status; r++) {
        status = complete(model, &records[r], &own_options, out, err);
        if (own_options.sigma != NULL)
            own_options.sigma += n_channels_of(model, &records[r]);
    }
    return status;
}
