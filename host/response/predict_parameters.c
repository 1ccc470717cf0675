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

double input_gain(const struct run *run, size_t input, size_t *parameter)
{
    bool patch = run->p->model.inputs[input].kind == INPUT_PATCH_MOMENT;
    *parameter = patch ? run->p->map.KB : SIZE_MAX;
    return patch ? run->theta[run->p->map.KB] : 1.0;
}

double output_gain(const struct run *run, size_t output, size_t *parameter)
{
    bool patch = run->p->model.outputs[output].kind == OUTPUT_PATCH_STRAIN;
    *parameter = patch ? run->p->map.Ks : SIZE_MAX;
    return patch ? run->theta[run->p->map.Ks] : 1.0;
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
    double to = p->model.inputs[input].at_m + *shift_m;
    if (status == BF_OK && !(to >= 0.0 && to <= p->model.length_m))
        status = bf_fail(err, BF_NUMERIC, "input %s, shifted by %.4g m, would leave the beam",
                         p->model.inputs[input].name, *shift_m);
    return status;
}

bool point_mass(const struct predictor *p, size_t e, int t, const double theta[], struct beam_term *out)
{
    const struct beam_effect *effect = p->model.effects[e].effect;
    struct beam_term terms[BEAM_EFFECT_TERMS];
    struct beam_place place = model_place(&p->model);
    double parameters[BEAM_EFFECT_PARAMETERS];
    memset(terms, 0, sizeof terms);
    parameter_map_effect(&p->map, 0, e, theta, parameters);
    if (effect->terms == NULL || t >= effect->n_terms || effect->terms(parameters, &place, terms) != 0)
        return false;
    *out = terms[t];
    return out->place.kind == BEAM_AT_POINT;
}
