/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The answer of a fit becomes the model: values, their standard errors and the `fit:` block. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "estimate.h"

static void fill_fit_record(const struct record *record, size_t index, bool held_out,
                            const struct fit_channel_error channels[], size_t n, struct fit_record *out)
{
    *out = (struct fit_record){.file = bf_strdup(record->path ? record->path : ""), .held_out = held_out};
    memcpy(out->sha256, record->sha256, sizeof out->sha256);
    out->channels = bf_alloc(n, sizeof *out->channels);
    for (size_t c = 0; c < n; c++) {
        if (channels[c].record != index)
            continue;
        struct fit_channel *channel = &out->channels[out->n_channels++];
        memcpy(channel->name, channels[c].name, sizeof channel->name);
        channel->nrmse = channels[c].nrmse;
        channel->noise_ratio = channels[c].noise_ratio > 0.0 ? channels[c].noise_ratio : 0.0;
        channel->noise_rms = channels[c].noise > 0.0 ? channels[c].noise : 0.0;
    }
}

static void free_fit_records(struct fit_info *fit)
{
    for (size_t i = 0; i < fit->n_records; i++) {
        free(fit->records[i].file);
        free(fit->records[i].channels);
    }
    free(fit->records);
}

static double known(double x)
{
    return isfinite(x) ? x : 0.0; /* 0 stands for "not known" in struct fit_info */
}

void fit_into_model(const struct fit_result *result, const struct record records[], const struct fit_check *check,
                    struct model *model)
{
    struct parameter_ref *refs;
    const char *const *names = (const char *const *)result->names;
    const size_t n = model_parameters(model, names, result->n_records, &refs);
    double *value = bf_alloc(n, sizeof *value), *sd = bf_alloc(n, sizeof *sd);
    for (size_t i = 0; i < n && i < result->n_parameters; i++) {
        value[i] = result->parameters[i].value;
        sd[i] = result->parameters[i].identifiable ? known(result->parameters[i].sd) : 0.0;
    }
    model_set_parameters(model, refs, n, value, sd, names);
    if (result->steps_per_sample > 0)
        model->steps_per_sample = result->steps_per_sample;
    struct fit_info *fit = &model->fit;
    free_fit_records(fit);
    fit->present = true;
    fit->converged = result->converged;
    fit->nrmse = known(result->nrmse), fit->noise_ratio = known(result->noise_ratio);
    fit_totals(check->channels, check->n_channels, &fit->check_nrmse, &fit->check_noise_ratio);
    fit->check_noise_ratio = known(fit->check_noise_ratio);
    fit->n_records = result->n_records + check->n;
    fit->records = bf_alloc(fit->n_records, sizeof *fit->records);
    for (size_t r = 0; r < result->n_records; r++)
        fill_fit_record(&records[r], r, false, result->channels, result->n_channels, &fit->records[r]);
    for (size_t r = 0; r < check->n; r++)
        fill_fit_record(&check->records[r], r, true, check->channels, check->n_channels,
                        &fit->records[result->n_records + r]);
    free(refs), free(value), free(sd);
}
