/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which columns of a record are inputs and outputs of the model. */
#include "predictor.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static enum bf_status bind_record(struct predictor *p, size_t r, struct bf_error *err)
{
    const struct record *record = &p->records[r];
    struct record_plan *plan = &p->plans[r];
    const char *from = record_meta(record, "free_from_s");
    if (record->kind != RECORD_SAMPLES)
        return bf_fail(
            err, BF_USAGE,
            "%s: %s; `fit` and `compare` take it, what asks for the motion cannot: give a record in time or a "
            "frequency response with phase",
            record->path,
            record->kind == RECORD_FREQUENCIES ? "a list of frequencies has no motion in it"
                                               : "a spectrum without phase has no motion in it");
    *plan = (struct record_plan){.record = record, .first_channel = p->n_channels};
    plan->recorder = recorder_filter_read(record);
    plan->n_rings = recorder_rings(record, plan->ring);
    plan->free_decay = record_is_free_decay(record);
    plan->periodic = record_is_periodic(record);
    plan->input = bf_alloc(p->model.n_inputs, sizeof *plan->input);
    plan->source = bf_alloc(p->model.n_inputs, sizeof *plan->source);
    plan->recorded = bf_alloc(p->model.n_inputs, sizeof *plan->recorded);
    plan->driven = bf_alloc(p->model.n_inputs, sizeof *plan->driven);
    plan->U = bf_alloc(p->model.n_inputs, sizeof *plan->U);
    plan->free_state = record_state_is_free(record);
    size_t n_inputs = 0;
    for (size_t i = 0; i < p->model.n_inputs && !plan->free_decay; i++) {
        plan->input[i] = record_column(record, p->model.inputs[i].name);
        n_inputs += plan->input[i] != NULL;
    }
    if (n_inputs == 0 && !plan->free_decay)
        return bf_fail_at(
            err, record->path, 1,
            "column '%s' is missing, and no other is an input of the model; name it in the header, or mark "
            "the record with the line '# excitation: free_decay' when the force was not recorded",
            p->model.n_inputs > 0 ? p->model.inputs[0].name : "(the model has no inputs)");
    if (plan->free_decay && from != NULL) {
        double offset = (strtod(from, NULL) - record->t0_s) / record->dt_s;
        if (!(offset >= 0.0) || offset > (double)record->n - 2.0)
            return bf_fail_at(err, record->path, 1, "free_from_s: %s is not a time inside the record", from);
        plan->start = record_free_from(record);
    }
    for (size_t o = 0; o < p->model.n_outputs; o++) {
        const double *measured = record_column(record, p->model.outputs[o].name);
        if (measured == NULL)
            continue;
        p->channels = bf_grow(p->channels, p->n_channels + 1, sizeof *p->channels);
        p->channels[p->n_channels++] = (struct predict_channel){
            .record = r, .output = o, .dt_s = record->dt_s, .measured = measured + plan->start};
        plan->n_channels++;
    }
    if (plan->n_channels == 0)
        return bf_fail_at(
            err, record->path, 1,
            "column '%s' is missing, and no other is an output of the model; name it in the header or add "
            "a column of the record to the model's outputs",
            p->model.n_outputs > 0 ? p->model.outputs[0].name : "(the model has no outputs)");
    return BF_OK;
}

/* y(2v, 2u) = 2 y(v, u), as of a direct path; a converter that saturates is none. */
bool effect_map_is_linear(const struct beam_effect *effect)
{
    static const double v = 1.7, u = 0.6, same = 1e-9;
    double p[BEAM_EFFECT_PARAMETERS];
    struct beam_sample_output once = {0}, twice = {0};
    for (int i = 0; i < effect->n_parameters; i++)
        p[i] = effect->parameters[i].start;
    return effect->map(p, v, u, &once) == 0 && effect->map(p, 2.0 * v, 2.0 * u, &twice) == 0 &&
           fabs(twice.y - 2.0 * once.y) <= same * fabs(twice.y);
}

bool effect_is_linear(const struct beam_effect *effect)
{
    return effect->law == NULL && effect->drive == NULL && effect->signal == NULL && effect->base == NULL &&
           effect->axial_inertia == NULL && (effect->map == NULL || effect_map_is_linear(effect));
}

static enum bf_status check_periodic(const struct predictor *p, const struct beam_effect *effect, struct bf_error *err)
{
    for (size_t r = 0; r < p->n_records && !effect_is_linear(effect); r++)
        if (p->plans[r].periodic)
            return bf_fail(err, BF_USAGE,
                           "%s: a frequency response, or one period of a steady state, is predicted with linear "
                           "effects only; drop %s, "
                           "or give records in time",
                           p->records[r].path, effect->id);
    return BF_OK;
}

/* An effect on a channel must find one. */
static enum bf_status check_effects(const struct predictor *p, struct bf_error *err)
{
    for (size_t e = 0; e < p->model.n_effects; e++) {
        const struct beam_effect *effect = p->model.effects[e].effect;
        bool found = effect->channels == BEAM_CHANNELS_NONE && p->model.effects[e].channel[0] == '\0';
        for (size_t o = 0; o < p->model.n_outputs; o++)
            found = found || effect_on_output(&p->model, e, o);
        for (size_t i = 0; i < p->model.n_inputs; i++)
            found = found || effect_on_input(&p->model, e, i);
        if (!found)
            return bf_fail(err, BF_BAD_FILE, "effect %s acts on no channel of the model; name one with 'channel:'",
                           effect->id);
        const enum bf_status status = check_periodic(p, effect, err);
        if (status)
            return status;
        if (effect->base != NULL && effect->tone == NULL)
            return bf_fail(err, BF_USAGE, "effect %s shakes the clamp but states no tone; the host needs one",
                           effect->id);
    }
    return BF_OK;
}

static bool shifted(const struct model *model, size_t input)
{
    for (size_t e = 0; model->inputs[input].kind == INPUT_POINT_FORCE && e < model->n_effects; e++)
        if (model->effects[e].effect->geometry != NULL && effect_on_input(model, e, input))
            return true;
    return false;
}

/* An input that effects shift acts in every record at a place of its own. */
static void make_sources(struct predictor *p)
{
    p->n_sources = p->model.n_inputs;
    p->sources = bf_alloc(p->n_sources, sizeof *p->sources);
    for (size_t i = 0; i < p->model.n_inputs; i++)
        p->sources[i] = (struct source){i, SIZE_MAX};
    for (size_t r = 0; r < p->n_records; r++) {
        for (size_t i = 0; i < p->model.n_inputs; i++) {
            p->plans[r].source[i] = i;
            if (p->plans[r].input[i] == NULL || !shifted(&p->model, i))
                continue;
            p->sources = bf_grow(p->sources, p->n_sources + 1, sizeof *p->sources);
            p->sources[p->n_sources] = (struct source){i, r};
            p->plans[r].source[i] = p->n_sources++;
        }
    }
}

enum bf_status predictor_bind(struct predictor *p, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t r = 0; status == BF_OK && r < p->n_records; r++)
        status = bind_record(p, r, err);
    if (status == BF_OK)
        make_sources(p);
    return status == BF_OK ? check_effects(p, err) : status;
}
