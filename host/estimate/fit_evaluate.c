/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One evaluation of the weighted residual and its Jacobian, with the linear unknowns projected out. */
#include "fit_problem.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "fit_shares.h"
#include "maths/maths.h"

static const double dependent = 1e-10; /* columns that depend on others to this share are left out */

/* The linear unknowns of one record: columns of its rows. */
struct linear_part {
    size_t row, m;    /* first row, number of rows */
    size_t n;         /* columns */
    size_t *nuisance; /* [n] which of the prediction's columns; the level comes first, as SIZE_MAX */
    double *A;        /* [m × n] weighted */
    double *Q;        /* [m × rank] orthonormal */
    size_t rank;
    double *c; /* [n] */
};

static void linear_part_free(struct linear_part *part)
{
    free(part->nuisance), free(part->A), free(part->Q), free(part->c);
    *part = (struct linear_part){0};
}

static bool any_nonzero(const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (x[i] != 0.0)
            return true;
    return false;
}

static void gather(const struct fit_problem *p, const struct prediction *y, size_t record, struct linear_part *part)
{
    *part = (struct linear_part){0};
    part->m = predict_rows_of(p->channels, p->n_channels, record, &part->row);
    /* a prediction in compressed rows has none */
    const size_t first = y->n_nuisance > 0 ? y->first_state[record] : 0;
    const size_t end = y->n_nuisance > 0 ? y->first_state[record + 1] : 0;
    part->nuisance = bf_alloc(end - first + 1, sizeof *part->nuisance);
    if (p->drives[record].level && part->m > 0)
        part->nuisance[part->n++] = SIZE_MAX;
    for (size_t k = first; k < end; k++)
        if (any_nonzero(y->nuisance + k * y->n_rows + part->row, part->m))
            part->nuisance[part->n++] = k;
    if (part->n == 0)
        return;
    part->A = bf_alloc(part->m * part->n, sizeof *part->A);
    part->Q = bf_alloc(part->m * part->n, sizeof *part->Q);
    part->c = bf_alloc(part->n, sizeof *part->c);
    for (size_t j = 0; j < part->n; j++) {
        const double *column =
            part->nuisance[j] == SIZE_MAX ? y->y + part->row : y->nuisance + part->nuisance[j] * y->n_rows + part->row;
        for (size_t k = 0; k < part->m; k++)
            part->A[k + j * part->m] = p->weight[part->row + k] * column[k];
    }
}

/* Coefficients c = argmin ‖A c − target‖ through Q: min ‖QᵀA c − Qᵀ target‖. */
static enum bf_status solve_part(struct linear_part *part, const double target[], struct bf_error *err)
{
    double *QA = bf_alloc(part->n * part->n, sizeof *QA), *Qb = bf_alloc(part->n, sizeof *Qb);
    enum bf_status status = dense_orthonormal(part->m, part->n, part->A, dependent, part->Q, QA, &part->rank, err);
    if (!status && part->rank > 0) {
        dense_gemv(true, part->m, part->rank, 1.0, part->Q, target, 0.0, Qb);
        status = dense_least_squares(part->rank, part->n, QA, Qb, dependent, part->c, NULL, err);
    }
    free(QA), free(Qb);
    return status;
}

/* Fills fitted and residual of one record, and remembers the coefficients. */
static enum bf_status fit_record(struct fit_problem *p, const struct prediction *y, size_t record,
                                 struct linear_part *part, struct bf_error *err)
{
    gather(p, y, record, part);
    p->levels[record] = 1.0;
    if (p->compressed)
        return BF_OK; /* there are none, see make_rows() */
    double *fitted = p->fitted + part->row;
    memcpy(fitted, y->y + part->row, part->m * sizeof *fitted);
    if (part->n == 0)
        return BF_OK;
    const bool level = part->nuisance[0] == SIZE_MAX;
    double *target = bf_alloc(part->m, sizeof *target);
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        for (size_t k = 0; channel->record == record && k < channel->n; k++) {
            const size_t row = channel->row + k;
            target[row - part->row] = p->weight[row] * (channel->measured[k] - (level ? 0.0 : y->y[row]));
        }
    }
    const enum bf_status status = solve_part(part, target, err);
    free(target);
    for (size_t j = 0; j < part->n && !status; j++) {
        if (part->nuisance[j] == SIZE_MAX) {
            p->levels[record] = part->c[j];
            for (size_t k = 0; k < part->m; k++)
                fitted[k] *= part->c[j];
            continue;
        }
        const double *column = y->nuisance + part->nuisance[j] * y->n_rows + part->row;
        p->coefficients[part->nuisance[j]] = part->c[j];
        for (size_t k = 0; k < part->m; k++)
            fitted[k] += part->c[j] * column[k];
    }
    return status;
}

static void weighted_jacobian(struct fit_problem *p, const struct prediction *y, const double x[])
{
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const double *from = p->compressed ? NULL : y->jacobian + p->unknowns[i].ref * y->n_rows;
        const double slope = fit_problem_slope(p, i, x);
        double *to = p->jacobian + i * p->n_jacobian;
        for (size_t c = 0; c < p->n_channels && !p->compressed; c++) {
            const struct predict_channel *channel = &p->channels[c];
            const double factor = slope * p->levels[channel->record];
            for (size_t k = channel->row; k < channel->row + channel->n; k++)
                to[k] = factor * p->weight[k] *
                        from[k]; /* there are channels: NOLINT(clang-analyzer-core.NullDereference) */
        }
        to += p->n_jacobian - lines_rows(p->lines);
        for (size_t k = 0; k < lines_rows(p->lines); k++)
            to[k] = slope * p->lines->jacobian[p->unknowns[i].ref * p->lines->n_rows + k];
    }
}

/* J ← (I − Q Qᵀ) J on the rows of one record. */
static void project(struct fit_problem *p, const struct linear_part *part)
{
    if (part->n == 0 || part->rank == 0)
        return;
    double *along = bf_alloc(part->rank, sizeof *along);
    for (size_t i = 0; i < p->n_unknowns; i++) {
        double *J = p->jacobian + i * p->n_rows + part->row;
        dense_gemv(true, part->m, part->rank, 1.0, part->Q, J, 0.0, along);
        dense_gemv(false, part->m, part->rank, -1.0, part->Q, along, 1.0, J);
    }
    free(along);
}

static void weigh_residual(struct fit_problem *p)
{
    for (size_t c = 0; c < p->n_channels && p->fitted != NULL; c++) { /* NULL: there are no samples */
        const struct predict_channel *channel = &p->channels[c];
        for (size_t k = 0; k < channel->n; k++) {
            const size_t row = channel->row + k;
            p->residual[row] = p->weight[row] * (p->fitted[row] - channel->measured[k]);
        }
    }
    if (p->lines != NULL)
        memcpy(p->residual + p->n_sample_rows, p->lines->residual, p->lines->n_rows * sizeof *p->residual);
    if (p->lines != NULL && p->compressed)
        memcpy(p->beside + p->n_unknowns + 1, p->lines->residual, p->lines->n_rows * sizeof *p->beside);
    p->half_square = 0.5 * dense_dot(p->n_rows, p->residual, p->residual);
}

static enum bf_status predict(struct fit_problem *p, const double x[], bool with_jacobian, struct prediction *y,
                              struct bf_error *err)
{
    if (p->predictor == NULL)
        return BF_OK;
    if (with_jacobian && p->compressed)
        return fit_problem_compress(p, x, y, err);
    return predictor_run(p->predictor, p->theta, with_jacobian ? p->want : NULL, y, err);
}

/* Runs the predictor and solves every record's linear unknowns. parts: [n_records]. */
static enum bf_status run(struct fit_problem *p, const double x[], bool with_jacobian, struct linear_part parts[],
                          struct prediction *y, struct bf_error *err)
{
    const bool *want = with_jacobian ? p->want : NULL;
    *y = (struct prediction){0};
    enum bf_status status = predict(p, x, with_jacobian, y, err);
    if (!status)
        status = lines_run(p->lines, p->theta, want, err);
    p->runs++;
    if (status)
        return status;
    if (y->n_rows != p->n_sample_rows)
        return bf_fail(err, BF_NUMERIC, "the prediction has %zu rows where %zu were asked for", y->n_rows,
                       p->n_sample_rows);
    p->coefficients = bf_grow(p->coefficients, y->n_nuisance ? y->n_nuisance : 1, sizeof *p->coefficients);
    p->n_nuisance = y->n_nuisance;
    if (p->compressed)
        p->fitted = y->y;
    for (size_t k = 0; k < p->n_nuisance; k++)
        p->coefficients[k] = 0.0;
    for (size_t r = 0; r < p->n_records && p->predictor != NULL && !status; r++) {
        linear_part_free(&parts[r]);
        status = fit_record(p, y, r, &parts[r], err);
    }
    if (!status && p->n_nuisance > 0)
        predictor_set_nuisance(p->predictor, p->coefficients);
    return status;
}

/* known: the amplitudes of the states are those at x already. */
static enum bf_status evaluate(struct fit_problem *p, const double x[], bool with_jacobian, bool known,
                               struct linear_part parts[], struct bf_error *err)
{
    if (with_jacobian && p->jacobian == NULL)
        fit_problem_make_jacobian(p);
    struct prediction y;
    const struct predict_target target = {.weight = p->weight, .start = p->states, .runs = &p->runs};
    enum bf_status status = p->predictor != NULL ? predictor_settle(p->predictor, p->theta, &target, err) : BF_OK;
    if (!status && (!with_jacobian || (p->has_decay && !known)))
        status = run(p, x, false, parts, &y, err);
    if (!status && with_jacobian)
        status = run(p, x, true, parts, &y, err); /* at the amplitudes of the run before */
    if (status)
        return status;
    weigh_residual(p);
    if (!with_jacobian)
        return BF_OK;
    weighted_jacobian(p, &y, x);
    for (size_t r = 0; r < p->n_records; r++)
        project(p, &parts[r]);
    p->states = bf_grow(p->states, p->n_nuisance ? p->n_nuisance : 1, sizeof *p->states);
    memcpy(p->states, p->coefficients, p->n_nuisance * sizeof *p->states);
    return BF_OK;
}

static enum bf_status evaluate_here(struct fit_problem *p, const double x[], bool with_jacobian, bool known,
                                    struct bf_error *err)
{
    struct linear_part *parts = bf_alloc(p->n_records, sizeof *parts);
    const enum bf_status status = evaluate(p, x, with_jacobian, known, parts, err);
    for (size_t r = 0; r < p->n_records; r++)
        linear_part_free(&parts[r]);
    free(parts);
    return status;
}

bool fit_problem_holds(const struct fit_problem *p, const double x[])
{
    static const double rounding = 1e-14; /* of x: from x to θ and back */
    bool same = p->held_at != HOLDS_NOTHING;
    for (size_t i = 0; i < p->n_unknowns && same; i++)
        same = fabs(x[i] - p->at[i]) <= rounding * fmax(1.0, fabs(x[i]));
    return same;
}

enum bf_status fit_problem_evaluate(struct fit_problem *p, const double x[], bool with_jacobian, double *data_square,
                                    struct bf_error *err)
{
    const enum fit_holds wanted = with_jacobian ? HOLDS_JACOBIAN : HOLDS_VALUE;
    *data_square = HUGE_VAL;
    if (p->held_at < wanted || !fit_problem_holds(p, x)) {
        const bool known = fit_problem_holds(p, x); /* the value is there, and with it the amplitudes */
        p->held_at = HOLDS_NOTHING;
        fit_problem_to_theta(p, x, p->theta);
        const enum bf_status status = p->shares != NULL ? shares_evaluate(p, x, with_jacobian, err)
                                                        : evaluate_here(p, x, with_jacobian, known, err);
        if (status)
            return status;
        memcpy(p->at, x, p->n_unknowns * sizeof *x);
        p->held_at = wanted;
    }
    *data_square = p->half_square;
    return BF_OK;
}
