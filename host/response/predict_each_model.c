/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What differs from record to record, and the model of one of them. */
#include "predictor.h"

bool each_wanted(const struct model *model, const struct record records[], size_t n_records)
{
    bool wanted = model_differs_by_record(model);
    for (size_t r = 0; r < n_records && !wanted; r++)
        wanted = record_has_places(model, &records[r]);
    return wanted;
}

static enum bf_status hold_place(const struct model *model, const struct record *record, const char *name,
                                 struct channel_parameters *own, double *at_m, struct bf_error *err)
{
    double stated_m;
    if (!record_place(model, record, name, &stated_m))
        return BF_OK;
    if (!(stated_m >= 0.0 && stated_m <= model->length_m))
        return bf_fail_at(err, record->path, 1, "%s.at_m: %.6g m is outside the beam (0 … %.6g m); is it in metres?",
                          name, stated_m, model->length_m);
    *at_m = own->at.value = stated_m;
    own->lists_at = false;
    own->at.fixed = true;
    return BF_OK;
}

enum bf_status each_model(const struct model *model, const struct record *record, struct model *out,
                          struct bf_error *err)
{
    const char *name = record_base_name(record);
    enum bf_status status = model_copy(model, out, err);
    for (size_t e = 0; e < out->n_effects; e++) {
        struct model_effect *effect = &out->effects[e];
        for (int j = 0; j < effect->effect->n_parameters; j++) {
            const struct per_record_value *own = effect_record_value(effect, j, name);
            if (effect->by_record[j] && own != NULL)
                effect->parameters[j].value = own->value;
            effect->by_record[j] = false;
        }
    }
    for (size_t i = 0; i < out->n_inputs && !status; i++)
        if (out->inputs[i].kind == INPUT_POINT_FORCE)
            status = hold_place(model, record, out->inputs[i].name, &out->inputs[i].own, &out->inputs[i].at_m, err);
    for (size_t o = 0; o < out->n_outputs && !status; o++)
        if (out->outputs[o].kind != OUTPUT_PATCH_STRAIN)
            status = hold_place(model, record, out->outputs[o].name, &out->outputs[o].own, &out->outputs[o].at_m, err);
    return status;
}
