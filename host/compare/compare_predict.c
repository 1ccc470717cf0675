/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compare_predict.h"
#include "maths/maths.h"
#include "estimate/estimate.h"

#include <stdlib.h>
#include <string.h>

static const double dependent = 1e-10; /* columns that depend on others to this share are left out */

bool excitation_level_unknown(const struct model *model, const struct record *record)
{
    const char *excitation = record_meta(record, "excitation");
    if (record_is_free_decay(record))
        return false;
    if (excitation != NULL && strcmp(excitation, "unknown_level") == 0)
        return true;
    for (size_t i = 0; i < model->n_inputs; i++)
        if (model->inputs[i].level_per_record && record_column(record, model->inputs[i].name) != NULL)
            return true;
    return false;
}

enum bf_status solved_prediction_new(const struct model *model, const struct record records[], size_t n_records,
                                     const struct predict_options *options, struct solved_prediction *out,
                                     struct bf_error *err)
{
    *out = (struct solved_prediction){0};
    struct predict_options how = options != NULL ? *options : (struct predict_options){0};
    how.pieces = true;
    enum bf_status status = predictor_new(model, records, n_records, &how, &out->predictor, err);
    if (status != BF_OK)
        return status;
    out->n_channels = predictor_channels(out->predictor, &out->channels);
    out->level = bf_alloc(n_records, sizeof *out->level);
    for (size_t r = 0; r < n_records; r++)
        out->level[r] = 1.0;
    return BF_OK;
}

void solved_prediction_free(struct solved_prediction *prediction)
{
    predictor_free(prediction->predictor);
    free(prediction->y);
    free(prediction->level);
    *prediction = (struct solved_prediction){0};
}

static bool all_zero(const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (x[i] < 0.0 || x[i] > 0.0)
            return false;
    return true;
}

/* Unknown amplitudes of one record's rows: the level (then the first column is y itself) and initial states. */
struct amplitudes {
    size_t first, n, n_columns;
    bool level;
    double *A, *b; /* weighted columns [n × n_columns] and target [n] */
    const double **column;
};

static double weight_of(const struct predict_channel *channel, double noise)
{
    const double size = noise > 0.0 ? noise : root_mean_square(channel->measured, channel->n);
    return size > 0.0 ? 1.0 / size : 0.0;
}

/* Initial states on which a law acts, but for the last linear step. */
static enum bf_status settle_states(const struct solved_prediction *s, const double theta[], const double noise[],
                                    struct bf_error *err)
{
    size_t rows = 0;
    for (size_t c = 0; c < s->n_channels; c++)
        rows += s->channels[c].n;
    double *weight = bf_alloc(rows, sizeof *weight);
    for (size_t c = 0; c < s->n_channels; c++)
        for (size_t k = 0; k < s->channels[c].n; k++)
            weight[s->channels[c].row + k] = weight_of(&s->channels[c], noise[c]);
    const struct predict_target target = {.weight = weight};
    const enum bf_status status = predictor_settle(s->predictor, theta, &target, err);
    free(weight);
    return status;
}

static void weigh(const struct solved_prediction *s, size_t record, const double noise[], struct amplitudes *a)
{
    for (size_t c = 0; c < s->n_channels; c++) {
        const struct predict_channel *channel = &s->channels[c];
        if (channel->record != record || channel->n == 0)
            continue;
        const double weight = weight_of(channel, noise[c]);
        for (size_t k = 0; k < channel->n; k++) {
            const size_t row = channel->row - a->first + k;
            a->b[row] = weight * (channel->measured[k] - (a->level ? 0.0 : s->y[channel->row + k]));
            for (size_t j = 0; j < a->n_columns; j++)
                a->A[row + j * a->n] = weight * a->column[j][row];
        }
    }
}

static enum bf_status solve_record(const struct prediction *y, size_t record, bool level, const double noise[],
                                   struct solved_prediction *s, struct bf_error *err)
{
    struct amplitudes a = {.level = level};
    a.n = predict_rows_of(s->channels, s->n_channels, record, &a.first);
    const size_t begin = y->first_state[record], end = y->first_state[record + 1];
    a.column = bf_alloc(end - begin + 1, sizeof *a.column);
    if (level)
        a.column[a.n_columns++] = y->y + a.first;
    for (size_t k = begin; k < end; k++)
        if (!all_zero(y->nuisance + k * y->n_rows + a.first, a.n))
            a.column[a.n_columns++] = y->nuisance + k * y->n_rows + a.first;
    enum bf_status status = BF_OK;
    if (a.n > 0 && a.n_columns > 0) {
        a.A = bf_alloc(a.n * a.n_columns, sizeof *a.A);
        a.b = bf_alloc(a.n, sizeof *a.b);
        double *x = bf_alloc(a.n_columns, sizeof *x);
        weigh(s, record, noise, &a);
        status = dense_least_squares(a.n, a.n_columns, a.A, a.b, dependent, x, NULL, err);
        for (size_t k = 0; k < a.n && status == BF_OK; k++) {
            double sum = level ? 0.0 : s->y[a.first + k];
            for (size_t j = 0; j < a.n_columns; j++)
                sum += x[j] * a.column[j][k]; /* there is room for all: NOLINT(clang-analyzer-core.NullDereference) */
            s->y[a.first + k] = sum;
        }
        if (level && status == BF_OK)
            s->level[record] = x[0];
        free(x);
    }
    free(a.column);
    free(a.A);
    free(a.b);
    return status;
}

enum bf_status solved_prediction_run(const struct model *model, const struct record records[], size_t n_records,
                                     const double noise[], struct solved_prediction *s, struct bf_error *err)
{
    const char **names = record_base_names(records, n_records);
    struct parameter_ref *refs = NULL;
    const size_t n = model_parameters(model, names, n_records, &refs);
    double *theta = bf_alloc(n + 1, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    struct prediction y;
    enum bf_status status = settle_states(s, theta, noise, err);
    if (status == BF_OK)
        status = predictor_run(s->predictor, theta, NULL, &y, err);
    if (status == BF_OK) {
        s->y = bf_alloc(y.n_rows, sizeof *s->y);
        memcpy(s->y, y.y, y.n_rows * sizeof *s->y);
    }
    for (size_t r = 0; r < n_records && status == BF_OK; r++)
        status = solve_record(&y, r, excitation_level_unknown(model, &records[r]), noise, s, err);
    free(names);
    free(refs);
    free(theta);
    return status;
}
