/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A hypothesis with laws as a linear one: what the laws add to the response is taken off the measured channels. What the
 * linear model then leaves is what the hypothesis left, and a further linear effect can be scored without a step through time.
 */
#include <stdlib.h>
#include <string.h>

#include "diagnose_linear_part.h"
#include "effect_kind.h"
#include "response/response.h"

static enum bf_status drop_laws(const struct model *from, struct model *out, struct bf_error *err)
{
    enum bf_status status = model_copy(from, out, err);
    if (status)
        return status;
    for (size_t e = out->n_effects; e-- > 0 && !status;)
        if (effect_kind(out->effects[e].effect) == KIND_LAW)
            status = model_drop_effect(out, out->effects[e].effect->id, err);
    if (status)
        model_free(out);
    return status;
}

/* A record whose columns can be replaced one by one; the rest is the original's. */
static struct record with_own_columns(const struct record *record)
{
    struct record own = *record;
    own.columns = bf_alloc(own.n_columns, sizeof *own.columns);
    for (size_t i = 0; i < own.n_columns; i++) {
        own.columns[i] = record->columns[i];
        own.columns[i].x = bf_alloc(own.n, sizeof(double));
        memcpy(own.columns[i].x, record->columns[i].x, own.n * sizeof(double));
    }
    return own;
}

/* measured ← linear prediction + what the hypothesis leaves */
static void replace(struct record *record, const char *name, size_t n, const double y[], const double residual[])
{
    for (size_t i = 0; i < record->n_columns; i++)
        for (size_t k = 0; strcmp(record->columns[i].name, name) == 0 && k < n; k++)
            record->columns[i].x[k] = y[k] + residual[k];
}

static enum bf_status take_laws_off(struct linear_part *linear_part, const struct diagnose_state *w,
                                    const struct hypothesis *h, struct bf_error *err)
{
    struct predictor *predictor = NULL;
    struct prediction prediction;
    const char **names = record_base_names(linear_part->records, linear_part->n_records);
    struct parameter_ref *refs;
    const size_t n = model_parameters(&linear_part->model, names, linear_part->n_records, &refs);
    double *theta = bf_alloc(n + 1, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    enum bf_status status = predictor_new(&linear_part->model, linear_part->records, linear_part->n_records,
                                          &w->options->predict, &predictor, err);
    double *weight = bf_alloc(h->fit.n_rows, sizeof *weight);
    for (size_t c = 0; c < h->fit.n_channels; c++)
        for (size_t k = 0; k < h->fit.channels[c].n; k++)
            weight[h->fit.channels[c].row + k] = 1.0 / w->sigma[c];
    if (!status)
        status = predictor_run_solved(predictor, theta, &(struct predict_target){.weight = weight}, &prediction, err);
    for (size_t c = 0; !status && c < h->fit.n_channels; c++) {
        const struct predict_channel *channel = &h->fit.channels[c];
        replace(&linear_part->records[channel->record], linear_part->model.outputs[channel->output].name, channel->n,
                prediction.y + channel->row, h->fit.residual + channel->row);
    }
    predictor_free(predictor);
    free(theta), free(refs), free(names), free(weight);
    return status;
}

enum bf_status linear_part_new(const struct diagnose_state *w, const struct hypothesis *h, struct linear_part *out,
                               struct bf_error *err)
{
    *out = (struct linear_part){0};
    enum bf_status status = drop_laws(&h->model, &out->model, err);
    if (status)
        return status;
    out->n_records = w->d->n_records;
    out->records = bf_alloc(out->n_records, sizeof *out->records);
    for (size_t r = 0; r < out->n_records; r++)
        out->records[r] = with_own_columns(&w->d->records[r]);
    status = take_laws_off(out, w, h, err);
    if (status)
        linear_part_free(out);
    return status;
}

void linear_part_free(struct linear_part *linear_part)
{
    for (size_t r = 0; r < linear_part->n_records; r++) {
        for (size_t i = 0; i < linear_part->records[r].n_columns; i++)
            free(linear_part->records[r].columns[i].x);
        free(linear_part->records[r].columns);
    }
    free(linear_part->records);
    model_free(&linear_part->model);
    *linear_part = (struct linear_part){0};
}
