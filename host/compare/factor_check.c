/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factor_check.c — the check's own model and how much of a record it looks at. */
#include "factor_pair.h"

#include <math.h>
#include <string.h>

enum { ENOUGH = 8192 }; /* samples of a record after its hardest drive */

static const double open_stiffness = 0.5; /* relative standard deviation of a stiffness in the check */

/* ---- The records ---- */

/* Samples up to ENOUGH after the hardest drive. */
size_t factor_enough(const struct model *model, const struct record *record)
{
    size_t last = 0;
    for (size_t i = 0; i < model->n_inputs; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        double most = 0.0;
        for (size_t k = 0; u && k < record->n; k++)
            if (fabs(u[k]) > most) {
                most = fabs(u[k]);
                last = k > last ? k : last;
            }
    }
    return record->n < last + ENOUGH ? record->n : last + ENOUGH;
}

/* ---- The model ---- */

static void hold_channel(struct channel_parameters *own)
{
    own->at.fixed = own->gain.fixed = true;
}

static void open_within(struct parameter *p)
{
    p->fixed = false, p->prior = open_stiffness, p->prior_value = p->value;
    p->min = -HUGE_VAL, p->max = HUGE_VAL;
}

/* Patches are glued: their mass is a guess. */
static void prepare_model(struct model *model, size_t output)
{
    const size_t plain = model_plain_material(model);
    for (size_t i = 0; i < model->n_materials; i++) {
        open_within(&model->materials[i].EI);
        if (i == plain)
            model->materials[i].rho.fixed = true;
        else
            open_within(&model->materials[i].rho);
    }
    model->Ks.fixed = model->KB.fixed = true;
    for (size_t i = 0; i < model->n_inputs; i++)
        hold_channel(&model->inputs[i].own);
    for (size_t i = 0; i < model->n_outputs; i++)
        hold_channel(&model->outputs[i].own);
    for (size_t i = 0; i < model->n_residuals; i++)
        if (model->residuals[i].output != output)
            model->residuals[i].compliance.fixed = true;
}

/* A law has no factor. */
static enum bf_status drop_laws(struct model *model, struct bf_error *err)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (model->effects[e].effect->law) {
            const enum bf_status status = model_drop_effect(model, model->effects[e].effect->id, err);
            if (status)
                return status;
            e = (size_t)-1;
        }
    return BF_OK;
}

enum bf_status factor_check_model(const struct model *given, size_t output, struct model *out, struct bf_error *err)
{
    enum bf_status status = model_copy(given, out, err);
    if (!status)
        status = drop_laws(out, err);
    if (!status)
        prepare_model(out, output);
    return status;
}
