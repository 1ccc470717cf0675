/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Initial states on which a law or a map acts, found by the steps of Gauss and Newton, each record by itself. */
#include "predictor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

enum { MOST_ROUNDS = 16 };
static const double dependent = 1e-10;         /* columns that depend on others to this share are left out */
static const double small = 1e-2, part = 1e-5; /* settled: χ² would fall by less than this, or this part of it */

struct settle {
    struct predictor *p;
    const struct predict_target *target;
    double *amplitude;   /* [n_nuisance] to be tried next */
    double *best;        /* [n_nuisance] */
    double *best_square; /* [n_records] of `best`; HUGE_VAL before the first */
};

/* b = weighted target − y, the whole prediction at the amplitudes of the run. */
static void fill_residual(const struct settle *s, const struct prediction *y, size_t record, size_t first, double b[])
{
    const struct record_plan *plan = &s->p->plans[record];
    for (size_t c = 0; c < plan->n_channels; c++) {
        const struct predict_channel *channel = &s->p->channels[plan->first_channel + c];
        for (size_t k = 0; k < channel->n; k++) {
            size_t row = channel->row + k;
            double z = s->target->z != NULL ? s->target->z[row] : channel->measured[k], sum = y->y[row];
            for (size_t i = y->first_state[record]; i < y->first_state[record + 1]; i++)
                sum += y->amplitude[i] * y->nuisance[i * y->n_rows + row];
            b[row - first] = s->target->weight[row] * (z - sum);
        }
    }
}

/* step[n] of the linearised problem; *square, *next: ‖b‖² before and after it. */
static enum bf_status solve_step(const struct settle *s, const struct prediction *y, size_t record, double step[],
                                 double *square, double *next, struct bf_error *err)
{
    size_t first, m = predict_rows_of(s->p->channels, s->p->n_channels, record, &first),
                  n = state_unknowns(s->p, record);
    size_t unknown = s->p->first_state[record];
    double *A = bf_alloc(m * (n + 1), sizeof *A), *b = A + m * n;
    for (size_t j = 0; j < n; j++)
        for (size_t k = 0; k < m; k++)
            A[k + j * m] = s->target->weight[first + k] * y->nuisance[(unknown + j) * y->n_rows + first + k];
    fill_residual(s, y, record, first, b);
    *square = dense_dot(m, b, b);
    enum bf_status status = dense_least_squares(m, n, A, b, dependent, step, NULL, err);
    for (size_t j = 0; status == BF_OK && j < n; j++)
        add_scaled(m, -step[j], A + j * m, b);
    *next = dense_dot(m, b, b);
    free(A);
    return status;
}

/* The next amplitudes of a record; a step that made it worse is halved. *settled becomes false where there is more to do. */
static enum bf_status advance(struct settle *s, const struct prediction *y, size_t record, bool *settled,
                              struct bf_error *err)
{
    size_t first = s->p->first_state[record], n = state_unknowns(s->p, record);
    double *step = bf_alloc(n, sizeof *step), square, next, *a = s->amplitude + first, *best = s->best + first;
    enum bf_status status = solve_step(s, y, record, step, &square, &next, err);
    if (status == BF_OK && !(square <= s->best_square[record])) {
        for (size_t i = 0; i < n; i++)
            a[i] = 0.5 * (a[i] + best[i]);
        *settled = false;
    } else if (status == BF_OK) {
        s->best_square[record] = square;
        memcpy(best, a, n * sizeof *best);
        for (size_t i = 0; i < n; i++)
            a[i] += step[i];
        *settled = *settled && square - next <= small + part * next;
    }
    free(step);
    return status;
}

/* Amplitudes without a prediction: half way back to the last that had one, or to rest when none has. */
static void retreat(struct settle *s, bool first)
{
    for (size_t i = 0; i < s->p->n_nuisance; i++)
        s->amplitude[i] = first ? 0.0 : 0.5 * (s->amplitude[i] + s->best[i]);
}

static enum bf_status settle_rounds(struct settle *s, const double theta[], struct bf_error *err)
{
    bool settled = false, known = false;
    enum bf_status status = BF_OK;
    for (int round = 0; round < MOST_ROUNDS && !settled; round++) {
        struct prediction y;
        single_set_nuisance(s->p, s->amplitude);
        status = single_run(s->p, theta, NULL, &y, err);
        if (s->target->runs != NULL)
            (*s->target->runs)++;
        if (status == BF_NUMERIC) {
            retreat(s, !known);
            continue;
        }
        settled = true;
        for (size_t r = 0; status == BF_OK && r < s->p->n_records; r++)
            if (state_unknowns(s->p, r) > 0)
                status = advance(s, &y, r, &settled, err);
        if (status != BF_OK)
            return status;
        known = true;
    }
    single_set_nuisance(s->p, settled ? s->amplitude : s->best);
    return known ? BF_OK : status;
}

enum bf_status single_settle(struct predictor *p, const double theta[], const struct predict_target *target,
                             struct bf_error *err)
{
    if (!states_bend(p))
        return BF_OK;
    struct settle s = {.p = p, .target = target};
    s.amplitude = bf_alloc(2 * p->n_nuisance + p->n_records, sizeof *s.amplitude);
    s.best = s.amplitude + p->n_nuisance;
    s.best_square = s.best + p->n_nuisance;
    memcpy(s.amplitude, target->start != NULL ? target->start : p->amplitude, p->n_nuisance * sizeof *s.amplitude);
    memcpy(s.best, s.amplitude, p->n_nuisance * sizeof *s.best);
    for (size_t r = 0; r < p->n_records; r++)
        s.best_square[r] = HUGE_VAL;
    enum bf_status status = settle_rounds(&s, theta, err);
    free(s.amplitude);
    return status;
}

enum bf_status settle_last(struct predictor *p, const struct predict_target *target, struct prediction *y, double a[],
                           struct bf_error *err)
{
    struct settle s = {.p = p, .target = target};
    double square, next;
    enum bf_status status = BF_OK;
    memcpy(a, p->amplitude, p->n_nuisance * sizeof *a);
    for (size_t r = 0; status == BF_OK && r < p->n_records; r++) {
        size_t first = p->first_state[r], n = state_unknowns(p, r);
        double *step = bf_alloc(n, sizeof *step);
        if (n > 0)
            status = solve_step(&s, y, r, step, &square, &next, err);
        for (size_t i = 0; i < n; i++)
            a[first + i] += step[i];
        free(step);
    }
    for (size_t i = 0; status == BF_OK && i < p->n_nuisance; i++)
        add_scaled(p->n_rows, a[i], y->nuisance + i * y->n_rows, y->y);
    return status;
}
