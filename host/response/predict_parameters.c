/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a parameter vector says: values of the model, gains, shifts of places, masses at points. */
#include "predictor.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int output_order(enum output_kind kind)
{
    switch (kind) {
    case OUTPUT_VELOCITY:
        return 1;
    case OUTPUT_ACCELERATION:
        return 2;
    case OUTPUT_DISPLACEMENT:
    case OUTPUT_PATCH_STRAIN:
        break;
    }
    return 0;
}

/* A gain that the model holds, or that stands in theta; one that was never stated is 1. */
static double own_gain(const struct run *run, const struct parameter *gain, size_t place, size_t *parameter)
{
    *parameter = place;
    if (place != SIZE_MAX)
        return run->theta[place];
    return gain->name[0] ? gain->value : 1.0;
}

double input_gain(const struct run *run, size_t input, size_t *parameter)
{
    const struct model_input *channel = &run->p->model.inputs[input];
    if (channel->kind != INPUT_PATCH_MOMENT)
        return own_gain(run, &channel->own.gain, run->p->map.input_gain[input], parameter);
    *parameter = run->p->map.KB;
    return run->theta[run->p->map.KB];
}

double output_gain(const struct run *run, size_t output, size_t *parameter)
{
    const struct model_output *channel = &run->p->model.outputs[output];
    if (channel->kind != OUTPUT_PATCH_STRAIN)
        return own_gain(run, &channel->own.gain, run->p->map.output_gain[output], parameter);
    *parameter = run->p->map.Ks;
    return run->theta[run->p->map.Ks];
}

bool is_input_gain(const struct predictor *p, size_t parameter)
{
    for (size_t i = 0; i < p->model.n_inputs; i++)
        if (p->map.input_gain[i] == parameter)
            return true;
    return parameter == p->map.KB;
}

double input_place(const struct predictor *p, size_t input, const double theta[])
{
    const size_t place = p->map.input_place[input];
    return place != SIZE_MAX ? theta[place] : p->model.inputs[input].at_m;
}

void predictor_use(struct predictor *p, const double theta[])
{
    const char **names = record_base_names(p->records, p->n_records);
    model_set_parameters(&p->model, p->refs, p->map.n, theta, NULL, names);
    free(names);
}

enum bf_status read_geometry(const struct predictor *p, size_t record, size_t e, const double theta[],
                             struct beam_geometry *out, struct bf_error *err)
{
    const struct beam_effect *effect = p->model.effects[e].effect;
    double parameters[BEAM_EFFECT_PARAMETERS];
    *out = (struct beam_geometry){0};
    if (effect->geometry == NULL)
        return BF_OK;
    parameter_map_effect(&p->map, record, e, theta, parameters);
    if (effect->geometry(parameters, out) != 0)
        return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
    return BF_OK;
}

enum bf_status geometry_input_shift(const struct predictor *p, size_t record, size_t input, const double theta[],
                                    double *shift_m, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *shift_m = 0.0;
    for (size_t e = 0; status == BF_OK && e < p->model.n_effects; e++) {
        struct beam_geometry at;
        if (p->model.effects[e].effect->geometry == NULL || !effect_on_input(&p->model, e, input))
            continue;
        status = read_geometry(p, record, e, theta, &at, err);
        *shift_m += at.input_shift_m;
    }
    double to = input_place(p, input, theta) + *shift_m;
    if (status == BF_OK && !(to >= 0.0 && to <= p->model.length_m))
        status = bf_fail(err, BF_NUMERIC, "input %s, shifted by %.4g m, would leave the beam",
                         p->model.inputs[input].name, *shift_m);
    return status;
}

bool point_mass(const struct predictor *p, const struct model *model, size_t e, int t, const double theta[],
                struct beam_term *out)
{
    const struct beam_effect *effect = p->model.effects[e].effect;
    struct beam_term terms[BEAM_EFFECT_TERMS];
    struct beam_place place = model_place(model);
    double parameters[BEAM_EFFECT_PARAMETERS];
    memset(terms, 0, sizeof terms);
    parameter_map_effect(&p->map, 0, e, theta, parameters);
    if (effect->terms == NULL || t >= effect->n_terms || effect->terms(parameters, &place, terms) != 0)
        return false;
    *out = terms[t];
    return out->place.kind == BEAM_AT_POINT || out->place.kind == BEAM_AT_OWN;
}
