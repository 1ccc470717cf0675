/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"

#include <string.h>

static bool is_zero(size_t n, const double x[])
{
    for (size_t i = 0; i < n; i++)
        if (x[i] < 0.0 || x[i] > 0.0)
            return false;
    return true;
}

/* A hum, an oscillating floor: what moves the outputs without an input. */
static bool moves_by_itself(const struct model *model)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (model->effects[e].effect->signal != NULL || model->effects[e].effect->base != NULL)
            return true;
    return false;
}

bool record_is_driven(const struct model *model, const struct record *record)
{
    if (record->kind != RECORD_SAMPLES || moves_by_itself(model) || record_is_free_decay(record))
        return true;
    for (size_t i = 0; i < model->n_inputs; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        if (u != NULL && !is_zero(record->n, u))
            return true;
    }
    return false;
}
