/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A fit, and once more from where it ended when its laws need finer steps there. */
#include "fit_once.h"

#include <stdlib.h>

/* A copy of the model with the values of a result, at another number of steps. */
static enum bf_status model_at(const struct model *model, const struct record records[], size_t n_records,
                               const struct fit_result *result, int steps, struct model *out, struct bf_error *err)
{
    const enum bf_status status = model_copy(model, out, err);
    double *value = bf_alloc(result->n_parameters + 1, sizeof *value);
    for (size_t i = 0; i < result->n_parameters; i++)
        value[i] = result->parameters[i].value;
    if (!status)
        refit_into_model(records, n_records, value, NULL, out);
    out->steps_per_sample = steps;
    free(value);
    return status;
}

/* The second result goes on where the first one ended; what was asked of the model stays in view. */
static void join(struct fit_result *first, struct fit_result *second, int steps)
{
    second->steps_per_sample = steps;
    second->evaluations += first->evaluations;
    second->seconds += first->seconds;
    second->searched = second->searched || first->searched;
    for (size_t i = 0; i < second->n_parameters; i++)
        second->parameters[i].start = first->parameters[i].start;
    fit_free(first);
    *first = *second;
}

enum bf_status fit_run(const struct model *model, const struct record records[], size_t n_records,
                       const struct fit_options *options, struct fit_result *out, struct bf_error *err)
{
    static const struct fit_options defaults;
    struct fit_options near = options ? *options : defaults;
    struct fit_result again;
    struct model finer;
    int steps, ignored;
    enum bf_status status = fit_once(model, records, n_records, &near, out, &steps, err);
    if (status || steps == 0)
        return status;
    status = model_at(model, records, n_records, out, steps, &finer, err);
    near.start = FIT_NEAR;
    if (!status && fit_once(&finer, records, n_records, &near, &again, &ignored, err) == BF_OK)
        join(out, &again, steps);
    model_free(&finer);
    if (status)
        fit_free(out);
    return status;
}
