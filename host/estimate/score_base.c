/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The baseline at its optimum: its residual, and everything that it could absorb. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"
#include "fit_problem.h"
#include "score_base.h"

static const double dependent = 1e-9; /* columns that depend on others to this share add nothing */
static const double at_bound = 1e-9;  /* closer than this to a bound (in x) an unknown does not move */
/*
 * A parameter estimated as its logarithm may have vanished: it has next to no influence, and the linear step to the optimum is more
 * than this many times its value. A step down means that it is held at 0, a step up that the search stopped too early.
 */
static const double far_step = 5.0;
static const double cancelled = 1e-3; /* of a column: what the baseline absorbs all but this of is projected twice */
static const double seen = 0.1;       /* of the residual: from where a vanished parameter is found again */

/* rows[n_rows] in units of the noise -> whitened by the colour of each channel. */
static void whiten(const struct score_base *base, double rows[])
{
    for (size_t c = 0; base->options.colour && c < base->n_channels; c++) {
        const struct predict_channel *channel = &base->channels[c];
        ar_whiten(&base->options.colour[c], rows + channel->row, channel->n, rows + channel->row);
    }
}

/* x[n] ← (I − Q Qᵀ) x, Q[n × rank]; along[rank] is room. */
static void take_out(size_t n, size_t rank, const double Q[], double along[], double x[])
{
    if (rank == 0)
        return;
    dense_gemv(true, n, rank, 1.0, Q, x, 0.0, along);
    dense_gemv(false, n, rank, -1.0, Q, along, 1.0, x);
}

static void project_states(const struct score_base *base, double x[])
{
    for (size_t r = 0; r < base->n_records; r++) {
        const struct record_basis *own = &base->states[r];
        double *along = bf_alloc(own->rank + 1, sizeof *along);
        take_out(own->n, own->rank, own->Q, along, x + own->row);
        free(along);
    }
}

static void project_once(const struct score_base *base, double along[], double x[])
{
    project_states(base, x);
    take_out(base->n_all, base->rank, base->absorbed, along, x);
}

/* Twice is enough (Kahan), and once where no thousandth is left to cancel: the first leaves rounding of what was there. */
static void project(const struct score_base *base, double x[])
{
    double *along = bf_alloc(base->rank + 1, sizeof *along);
    const double before = dense_norm(base->n_all, x);
    project_once(base, along, x);
    if (!(dense_norm(base->n_all, x) > cancelled * before))
        project_once(base, along, x);
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

/* Columns of unit length, less what the records' own columns take of them: `dependent` means the same for each. */
struct absorbent {
    double *A; /* [n][n_all] */
    size_t n;
    double *size;      /* [n] length before */
    bool *logarithmic; /* [n] */
    size_t *ref;       /* [n] */
};

static void add_column(const struct score_base *base, struct absorbent *a, bool logarithmic, size_t ref)
{
    double *column = a->A + a->n * base->n_all;
    const double size = dense_norm(base->n_all, column);
    if (!(size > 0.0) || !isfinite(size))
        return;
    for (size_t k = 0; k < base->n_all; k++)
        column[k] /= size;
    for (int pass = 0; pass < 2; pass++)
        project_states(base, column);
    a->size[a->n] = size;
    a->ref[a->n] = ref;
    a->logarithmic[a->n++] = logarithmic;
}

static void remove_column(const struct score_base *base, struct absorbent *a, size_t j)
{
    a->n--;
    memmove(a->A + j * base->n_all, a->A + (j + 1) * base->n_all, (a->n - j) * base->n_all * sizeof *a->A);
    memmove(a->size + j, a->size + j + 1, (a->n - j) * sizeof *a->size);
    memmove(a->ref + j, a->ref + j + 1, (a->n - j) * sizeof *a->ref);
    memmove(a->logarithmic + j, a->logarithmic + j + 1, (a->n - j) * sizeof *a->logarithmic);
}

static void zero_prior_rows(const struct score_base *base, double column[])
{
    for (size_t k = base->n_rows; k < base->n_all; k++)
        column[k] = 0.0;
}

static void unknown_columns(const struct score_base *base, const struct fit_problem *p, const double x[],
                            struct absorbent *a)
{
    size_t prior = base->n_rows;
    for (size_t i = 0; i < p->n_unknowns; i++) {
        double *column = a->A + a->n * base->n_all;
        memcpy(column, p->jacobian + i * p->n_rows, p->n_rows * sizeof *column);
        whiten(base, column);
        zero_prior_rows(base, column);
        if (p->unknowns[i].prior > 0.0)
            column[prior++] = 1.0 / p->unknowns[i].prior;
        if (x[i] > p->lower[i] + at_bound && x[i] < p->upper[i] - at_bound)
            add_column(base, a, p->unknowns[i].logarithmic, p->unknowns[i].ref);
    }
}

/* from[n_rows] in the rows of a record, whitened, of unit length; false: nothing. */
static bool state_column(const struct score_base *base, size_t record, const double from[],
                         const struct record_basis *own, double column[])
{
    for (size_t k = 0; k < own->n; k++)
        column[k] = base->weight[own->row + k] * from[own->row + k];
    for (size_t c = 0; base->options.colour && c < base->n_channels; c++) {
        double *rows = column + base->channels[c].row - own->row;
        if (base->channels[c].record == record)
            ar_whiten(&base->options.colour[c], rows, base->channels[c].n, rows);
    }
    const double size = dense_norm(own->n, column);
    for (size_t k = 0; k < own->n && size > 0.0; k++)
        column[k] /= size;
    return size > 0.0 && isfinite(size);
}

/* Unknown levels and initial states of one record. */
static enum bf_status record_basis(const struct score_base *base, const struct fit_problem *p,
                                   const struct prediction *y, size_t record, struct record_basis *own,
                                   struct bf_error *err)
{
    const size_t first = y->first_state[record], n = y->first_state[record + 1] - first;
    own->n = predict_rows_of(base->channels, base->n_channels, record, &own->row);
    double *A = bf_alloc((n + 1) * own->n + 1, sizeof *A);
    size_t kept = 0;
    for (size_t k = p->drives[record].level ? 0 : 1; k <= n && own->n > 0; k++)
        kept += state_column(base, record, k == 0 ? y->y : y->nuisance + (first + k - 1) * y->n_rows, own,
                             A + kept * own->n);
    own->Q = bf_alloc(kept * own->n + 1, sizeof *own->Q);
    const enum bf_status status = dense_orthonormal(own->n, kept, A, dependent, own->Q, NULL, &own->rank, err);
    free(A);
    return status;
}

static enum bf_status find_states(struct score_base *base, const struct fit_problem *p, const struct prediction *y,
                                  struct bf_error *err)
{
    enum bf_status status = BF_OK;
    base->states = bf_alloc(base->n_records + 1, sizeof *base->states);
    for (size_t r = 0; r < base->n_records && !status; r++)
        status = record_basis(base, p, y, r, &base->states[r], err);
    return status;
}

/* step[n] to the linear optimum, of columns of unit length. */
static enum bf_status linear_step(const struct score_base *base, const struct absorbent *a, double step[],
                                  struct bf_error *err)
{
    const size_t rank = base->rank;
    double *QA = bf_alloc(rank * a->n + 1, sizeof *QA), *Qr = bf_alloc(rank + 1, sizeof *Qr);
    dense_gemm(true, false, rank, a->n, base->n_all, 1.0, base->absorbed, a->A, 0.0, QA);
    dense_gemv(true, base->n_all, rank, 1.0, base->absorbed, base->residual, 0.0, Qr);
    const enum bf_status status = dense_least_squares(rank, a->n, QA, Qr, dependent, step, NULL, err);
    free(QA), free(Qr);
    return status;
}

/* The value θ (1 + step) of a vanished parameter, at most where it alone would be as large as the residual. */
static void raise_start(struct score_base *base, const struct absorbent *a, size_t j, double factor)
{
    const size_t ref = a->ref[j];
    const double most = dense_norm(base->n_all, base->residual) / a->size[j];
    const double start = base->theta[ref] * fmax(fmin(factor, most), 1.0);
    base->start_theta[ref] = fmin(fmax(start, base->refs[ref].info->min), base->refs[ref].info->max);
}

/* Column j is no longer absorbed: with a candidate it may grow. */
static void limit(struct score_base *base, struct absorbent *a, size_t j)
{
    base->limited = bf_grow(base->limited, (base->n_limited + 1) * base->n_all, sizeof *base->limited);
    memcpy(base->limited + base->n_limited++ * base->n_all, a->A + j * base->n_all,
           base->n_all * sizeof *base->limited);
    raise_start(base, a, j, seen * dense_norm(base->n_all, base->residual) / a->size[j]);
    remove_column(base, a, j);
}

/* Spans the columns, less those of vanished parameters that the misfit would drive below 0, the furthest first. */
static enum bf_status span(struct score_base *base, struct absorbent *a, struct bf_error *err)
{
    if (a->n > base->n_all)
        return bf_fail(err, BF_NUMERIC, "fewer samples than unknowns");
    base->absorbed = bf_alloc((a->n + 1) * base->n_all, sizeof *base->absorbed);
    double *step = bf_alloc(a->n + 1, sizeof *step);
    enum bf_status status = BF_OK;
    for (bool done = false; !done && !status;) {
        size_t worst = a->n;
        double furthest = far_step;
        status = dense_orthonormal(base->n_all, a->n, a->A, dependent, base->absorbed, NULL, &base->rank, err);
        if (!status)
            status = linear_step(base, a, step, err);
        for (size_t j = 0; j < a->n && !status; j++) {
            const double moved = a->logarithmic[j] ? -step[j] / a->size[j] : 0.0;
            if (moved > furthest) {
                furthest = moved;
                worst = j;
            }
        }
        done = worst == a->n;
        if (!done && !status)
            limit(base, a, worst);
    }
    for (size_t j = 0; j < a->n && !status; j++)
        if (a->logarithmic[j] && step[j] > far_step * a->size[j])
            raise_start(base, a, j, 1.0 + step[j] / a->size[j]);
    free(step);
    return status;
}

static enum bf_status absorb(struct score_base *base, const struct fit_problem *p, const double x[],
                             struct bf_error *err)
{
    struct prediction y;
    enum bf_status status = predictor_run(p->predictor, p->theta, NULL, &y, err);
    if (status)
        return status;
    const size_t most = p->n_unknowns + 1;
    struct absorbent a = {.A = bf_alloc(most * base->n_all, sizeof *a.A),
                          .size = bf_alloc(most, sizeof *a.size),
                          .logarithmic = bf_alloc(most, sizeof *a.logarithmic),
                          .ref = bf_alloc(most, sizeof *a.ref)};
    status = find_states(base, p, &y, err);
    if (!status) {
        unknown_columns(base, p, x, &a);
        status = span(base, &a, err);
    }
    free(a.A), free(a.size), free(a.logarithmic), free(a.ref);
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
    fit_problem_release(p); /* an optimum of the file's bounds */
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
        for (size_t j = 0; j < base->n_limited; j++)
            project(base, base->limited + j * base->n_all);
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
    base->names = record_base_names(records, n_records);
    base->n_refs = model_parameters(model, base->names, n_records, &base->refs);
    base->theta = bf_alloc(base->n_refs, sizeof *base->theta);
    for (size_t i = 0; i < base->n_refs; i++)
        base->theta[i] = base->refs[i].value;
    base->start_theta = bf_alloc(base->n_refs, sizeof *base->start_theta);
    memcpy(base->start_theta, base->theta, base->n_refs * sizeof *base->start_theta);
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
    for (size_t r = 0; r < base->n_records && base->states != NULL; r++)
        free(base->states[r].Q);
    free(base->states);
    free(base->names), free(base->refs), free(base->theta), free(base->channels), free(base->levels);
    free(base->weight), free(base->fitted), free(base->residual), free(base->absorbed);
    free(base->limited), free(base->start_theta);
    free(base);
}

double score_base_misfit(const struct score_base *base, double *degrees_of_freedom)
{
    *degrees_of_freedom = (double)base->n_all - (double)base->rank;
    for (size_t r = 0; r < base->n_records; r++)
        *degrees_of_freedom -= (double)base->states[r].rank;
    return base->misfit;
}
