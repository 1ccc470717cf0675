/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The baseline at its optimum: its residual, and everything that it could absorb. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "dense.h"
#include "fit_problem.h"
#include "score_work.h"

static const double dependent = 1e-9; /* columns that depend on others to this share add nothing */
static const double pressed = 1e-9;   /* this near to a bound (in x) an unknown cannot absorb anything */

/* rows[n_rows] in units of the noise -> whitened by the colour of each channel. */
static void whiten(const struct score_base *base, double rows[])
{
    for (size_t c = 0; base->options.colour && c < base->n_channels; c++) {
        const struct predict_channel *channel = &base->channels[c];
        ar_whiten(&base->options.colour[c], rows + channel->row, channel->n, rows + channel->row);
    }
}

static void project(const struct score_base *base, double x[])
{
    double *along = bf_alloc(base->rank, sizeof *along);
    for (int pass = 0; pass < 2; pass++) { /* twice is enough (Kahan): the first leaves rounding */
        dense_gemv(true, base->n_all, base->rank, 1.0, base->absorbed, x, 0.0, along);
        dense_gemv(false, base->n_all, base->rank, -1.0, base->absorbed, along, 1.0, x);
    }
    free(along);
}

double score_project(const struct score_base *base, const double column[], double out[])
{
    for (size_t k = 0; k < base->n_rows; k++)
        out[k] = base->weight[k] * column[k];
    whiten(base, out);
    for (size_t k = base->n_rows; k < base->n_all; k++)
        out[k] = 0.0;
    const double before = dense_norm(base->n_all, out);
    if (!(before > 0.0))
        return 0.0;
    project(base, out);
    return dense_norm(base->n_all, out) / before;
}

/* ---- What the baseline can absorb ---- */

/* Columns are scaled to unit length, so that `dependent` means the same for each. */
static void add_column(const struct score_base *base, double A[], size_t *n)
{
    double *column = A + *n * base->n_all;
    const double size = dense_norm(base->n_all, column);
    if (!(size > 0.0) || !isfinite(size))
        return;
    for (size_t k = 0; k < base->n_all; k++)
        column[k] /= size;
    (*n)++;
}

static void zero_prior_rows(const struct score_base *base, double column[])
{
    for (size_t k = base->n_rows; k < base->n_all; k++)
        column[k] = 0.0;
}

static void unknown_columns(const struct score_base *base, const struct fit_problem *p, const double x[], double A[],
                            size_t *n)
{
    size_t prior = base->n_rows;
    for (size_t i = 0; i < p->n_unknowns; i++) {
        double *column = A + *n * base->n_all;
        memcpy(column, p->jacobian + i * p->n_rows, p->n_rows * sizeof *column);
        whiten(base, column);
        zero_prior_rows(base, column);
        if (p->unknowns[i].prior > 0.0)
            column[prior++] = 1.0 / p->unknowns[i].prior;
        if (x[i] > p->lower[i] + pressed && x[i] < p->upper[i] - pressed)
            add_column(base, A, n);
    }
}

/* Unknown levels and initial states: columns of the rows of one record. */
static void record_columns(const struct score_base *base, const struct fit_problem *p, const struct prediction *y,
                           double A[], size_t *n)
{
    for (size_t r = 0; r < p->n_records; r++) {
        for (size_t k = p->level[r] ? 0 : 1; k <= y->n_nuisance; k++) {
            const double *from = k == 0 ? y->y : y->nuisance + (k - 1) * y->n_rows;
            double *column = A + *n * base->n_all;
            zero_prior_rows(base, column);
            for (size_t c = 0; c < base->n_channels; c++) {
                const struct predict_channel *channel = &base->channels[c];
                for (size_t row = channel->row; row < channel->row + channel->n; row++)
                    column[row] = channel->record == r ? base->weight[row] * from[row] : 0.0;
            }
            whiten(base, column);
            add_column(base, A, n);
        }
    }
}

static enum bf_status absorb(struct score_base *base, const struct fit_problem *p, const double x[],
                             struct bf_error *err)
{
    struct prediction y;
    enum bf_status status = predictor_run(p->predictor, p->theta, NULL, &y, err);
    if (status)
        return status;
    const size_t most = p->n_unknowns + p->n_records * (1 + y.n_nuisance);
    double *A = bf_alloc((most + 1) * base->n_all, sizeof *A);
    size_t n = 0;
    unknown_columns(base, p, x, A, &n);
    record_columns(base, p, &y, A, &n);
    base->absorbed = bf_alloc((n ? n : 1) * base->n_all, sizeof *base->absorbed);
    status = n > base->n_all ? bf_fail(err, BF_NUMERIC, "fewer samples than unknowns")
                             : dense_orthonormal(base->n_all, n, A, dependent, base->absorbed, &base->rank, err);
    free(A);
    return status;
}

/* ---- The residual ---- */

static void take_residual(struct score_base *base, const struct fit_problem *p, const double x[])
{
    size_t prior = base->n_rows;
    base->residual = bf_alloc(base->n_all, sizeof *base->residual);
    for (size_t k = 0; k < base->n_rows; k++)
        base->residual[k] = -p->residual[k];
    for (size_t i = 0; i < p->n_unknowns; i++)
        if (p->unknowns[i].prior > 0.0)
            base->residual[prior++] = (p->unknowns[i].prior_x - x[i]) / p->unknowns[i].prior;
    base->white_misfit = dense_dot(base->n_all, base->residual, base->residual);
    whiten(base, base->residual);
}

static void take_rows(struct score_base *base, const struct fit_problem *p)
{
    base->n_channels = p->n_channels;
    base->channels = bf_alloc(p->n_channels, sizeof *base->channels);
    memcpy(base->channels, p->channels, p->n_channels * sizeof *base->channels);
    base->n_rows = base->n_all = p->n_rows;
    for (size_t i = 0; i < p->n_unknowns; i++)
        base->n_all += p->unknowns[i].prior > 0.0;
    base->weight = bf_alloc(p->n_rows, sizeof *base->weight);
    memcpy(base->weight, p->weight, p->n_rows * sizeof *base->weight);
    base->fitted = bf_alloc(p->n_rows, sizeof *base->fitted);
    memcpy(base->fitted, p->fitted, p->n_rows * sizeof *base->fitted);
    base->levels = bf_alloc(p->n_records, sizeof *base->levels);
    memcpy(base->levels, p->levels, p->n_records * sizeof *base->levels);
    base->has_decay = p->has_decay;
}

static enum bf_status fill(struct score_base *base, struct fit_problem *p, struct bf_error *err)
{
    double *x = bf_alloc(p->n_unknowns ? p->n_unknowns : 1, sizeof *x), square;
    fit_problem_to_x(p, base->theta, x);
    enum bf_status status = fit_problem_stage(p, 0.0, 0.0, x, err);
    if (!status)
        status = fit_problem_evaluate(p, x, true, &square, err);
    if (!status) {
        take_rows(base, p);
        take_residual(base, p, x);
        status = absorb(base, p, x, err);
    }
    if (!status) {
        project(base, base->residual);
        base->misfit = dense_dot(base->n_all, base->residual, base->residual);
    }
    free(x);
    return status;
}

enum bf_status score_base_new(const struct model *model, const struct record records[], size_t n_records,
                              const struct score_options *options, struct score_base **out, struct bf_error *err)
{
    struct score_base *base = bf_alloc(1, sizeof *base);
    *base = (struct score_base){.model = model, .records = records, .n_records = n_records, .options = *options};
    base->names = bf_alloc(n_records, sizeof *base->names);
    for (size_t r = 0; r < n_records; r++)
        base->names[r] = record_base_name(&records[r]);
    base->n_refs = model_parameters(model, base->names, n_records, &base->refs);
    base->theta = bf_alloc(base->n_refs, sizeof *base->theta);
    for (size_t i = 0; i < base->n_refs; i++)
        base->theta[i] = base->refs[i].value;
    struct predictor *predictor = NULL;
    struct fit_problem problem = {0};
    enum bf_status status = predictor_new(model, records, n_records, &options->predict, &predictor, err);
    if (!status)
        status = fit_problem_new(&problem, model, predictor, records, n_records, base->names, base->refs, base->n_refs,
                                 options->sigma, err);
    if (!status)
        status = fill(base, &problem, err);
    fit_problem_free(&problem);
    predictor_free(predictor);
    if (status) {
        score_base_free(base);
        base = NULL;
    }
    *out = base;
    return status;
}

void score_base_free(struct score_base *base)
{
    if (!base)
        return;
    free(base->names), free(base->refs), free(base->theta), free(base->channels), free(base->levels);
    free(base->weight), free(base->fitted), free(base->residual), free(base->absorbed);
    free(base);
}

double score_base_misfit(const struct score_base *base, double *degrees_of_freedom)
{
    *degrees_of_freedom = (double)base->n_all - (double)base->rank;
    return base->misfit;
}

double score_base_chi_square(const struct score_base *base)
{
    return base->white_misfit;
}
