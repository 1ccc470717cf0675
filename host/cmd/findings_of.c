/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "findings_of.h"

#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

static bool is_force(const void *context, const char *column)
{
    const struct model *model = context;
    for (size_t i = 0; i < model->n_inputs; i++)
        if (model->inputs[i].kind == INPUT_POINT_FORCE && strcmp(model->inputs[i].name, column) == 0)
            return true;
    return false;
}

static bool is_signal(const void *context, const char *column)
{
    const struct model *model = context;
    for (size_t i = 0; i < model->n_outputs; i++)
        if (strcmp(model->outputs[i].name, column) == 0)
            return true;
    return false;
}

struct record_findings *findings_of(const struct model *model, const struct record records[], size_t n_records)
{
    struct record_findings *out = bf_alloc(n_records + 1, sizeof *out);
    for (size_t r = 0; r < n_records; r++)
        record_findings_find(&records[r], is_force, is_signal, model, &out[r]);
    return out;
}

void findings_free(struct record_findings *findings, size_t n_records)
{
    for (size_t r = 0; r < n_records && findings != NULL; r++)
        record_findings_free(&findings[r]);
    free(findings);
}
