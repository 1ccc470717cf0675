/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A fit, and once more from where it ended when its laws need finer steps there. */
#include "fit_once.h"
#include "line_peaks.h"
#include "line_rows.h"

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

static bool any_spectrum(const struct record records[], size_t n_records)
{
    bool any = false;
    for (size_t r = 0; r < n_records; r++)
        any = any || records[r].kind == RECORD_MAGNITUDES;
    return any;
}

/* Values of a fit of the peaks and of the lists among the records; false: there are none, or no such fit. */
static bool fit_peaks(const struct model *model, const struct record records[], size_t n_records,
                      const struct fit_options *options, struct fit_result *out)
{
    struct fit_options quiet = *options;
    struct record *lists = bf_alloc(n_records, sizeof *lists);
    bool *made = bf_alloc(n_records, sizeof *made);
    size_t n = 0;
    int ignored;
    struct bf_error err;
    quiet.never_search = quiet.quiet = true;
    for (size_t r = 0; r < n_records; r++) {
        made[n] = records[r].kind == RECORD_MAGNITUDES;
        if (made[n])
            line_peaks(&records[r], &lists[n]);
        else
            lists[n] = records[r];
        if (lists[n].n == 0)
            record_free(&lists[n]);
        else
            n++;
    }
    const bool done = n == n_records && fit_once(model, lists, n, &quiet, out, &ignored, &err) == BF_OK;
    for (size_t r = 0; r < n; r++)
        if (made[r])
            record_free(&lists[r]);
    free(lists), free(made);
    return done;
}

/* Spectra without phase alone: what their peaks say first, then their lines from there. */
static enum bf_status fit_spectra(const struct model *model, const struct record records[], size_t n_records,
                                  const struct fit_options *options, struct fit_result *out, struct bf_error *err)
{
    struct fit_result first;
    struct model start;
    int ignored;
    if (!fit_peaks(model, records, n_records, options, &first))
        return fit_once(model, records, n_records, options, out, &ignored, err);
    enum bf_status status = model_at(model, records, n_records, &first, model->steps_per_sample, &start, err);
    if (!status)
        status = fit_once(&start, records, n_records, options, out, &ignored, err);
    model_free(&start);
    if (!status)
        join(&first, out, 0);
    else
        fit_free(&first);
    if (!status)
        *out = first;
    return status;
}

enum bf_status fit_run(const struct model *model, const struct record records[], size_t n_records,
                       const struct fit_options *options, struct fit_result *out, struct bf_error *err)
{
    static const struct fit_options defaults;
    struct fit_options near = options ? *options : defaults;
    struct fit_result again;
    struct model finer;
    int steps, ignored;
    if (near.start != FIT_NEAR && any_spectrum(records, n_records) && lines_behind(records, n_records) == 0)
        return fit_spectra(model, records, n_records, &near, out, err);
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
