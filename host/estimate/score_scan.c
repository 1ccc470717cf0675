/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The scan of one candidate: the best combination of its columns at each point, the best point, and what lies about it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"
#include "score_scan.h"

enum { REFINEMENTS = 5, SECANTS = 2 };
static const double golden = 0.6180339887498949;
static const double dependent = 1e-6; /* strengths whose responses depend on each other to this share */
static const double worth_refining =
    12.0; /* LM above which the grid's best point is refined: p ≈ 5e-4 for one strength */
static const double secant_limit = 10.0; /* a finite trial moves by this factor at most */

/* ---- One point of a scan ---- */

void answer_new(const struct probe *probe, struct answer *a)
{
    const size_t n = probe->n_most ? probe->n_most : 1, n_all = probe->base->n_all;
    *a = (struct answer){.LM = -1.0};
    a->what = bf_alloc(n, sizeof *a->what);
    a->S = bf_alloc(n * n_all, sizeof *a->S);
    a->Q = bf_alloc(n * n_all, sizeof *a->Q);
    a->delta = bf_alloc(n, sizeof *a->delta);
    a->held = bf_alloc(n, sizeof *a->held);
    a->along = bf_alloc(n, sizeof *a->along);
}

void answer_free(struct answer *a)
{
    free(a->what), free(a->S), free(a->Q), free(a->delta), free(a->held), free(a->along);
    *a = (struct answer){0};
}

void answer_range(const struct probe *probe, const struct probe_column *what, const double p[], double *low,
                  double *high)
{
    const struct candidate *c = probe->candidate;
    *low = -INFINITY, *high = INFINITY;
    if (what->slot < 0) {
        *low = 0.0;
    } else if (candidate_is_sinusoid(c)) {
        return;
    } else if (c->role[what->slot] == CANDIDATE_INVERSE) {
        *low = 0.0;
        *high = p[what->slot] / c->lower[what->slot];
    } else {
        const double unit = candidate_is_finite(c, what->slot) ? p[what->slot] : 1.0;
        *low = fmin(c->lower[what->slot] / unit, c->upper[what->slot] / unit);
        *high = fmax(c->lower[what->slot] / unit, c->upper[what->slot] / unit);
    }
}

/* δ of the columns that are not held, by least squares on what the held ones leave. */
static enum bf_status solve(const struct score_base *base, struct answer *a, struct bf_error *err)
{
    const size_t n_all = base->n_all;
    double *free_columns = bf_alloc((a->n + 1) * n_all, sizeof *free_columns);
    double *target = bf_alloc(n_all, sizeof *target);
    size_t n = 0;
    memcpy(target, base->residual, n_all * sizeof *target);
    for (size_t j = 0; j < a->n; j++) {
        const double *column = a->S + j * n_all;
        if (!a->held[j])
            memcpy(free_columns + n++ * n_all, column, n_all * sizeof *column);
        for (size_t k = 0; k < n_all && a->held[j] && fabs(a->delta[j]) > 0.0; k++)
            target[k] -= a->delta[j] * column[k];
    }
    a->rank = 0;
    a->LM = base->misfit - dense_dot(n_all, target, target);
    enum bf_status status = dense_orthonormal(n_all, n, free_columns, dependent, a->Q, NULL, &a->rank, err);
    double *QS = bf_alloc(a->rank * n + 1, sizeof *QS), *delta = bf_alloc(n + 1, sizeof *delta);
    if (!status && a->rank > 0) {
        dense_gemv(true, n_all, a->rank, 1.0, a->Q, target, 0.0, a->along);
        a->LM += dense_dot(a->rank, a->along, a->along);
        dense_gemm(true, false, a->rank, n, n_all, 1.0, a->Q, free_columns, 0.0, QS);
        status = dense_least_squares(a->rank, n, QS, a->along, 1e-9, delta, NULL, err);
    }
    n = 0;
    for (size_t j = 0; j < a->n; j++)
        if (!a->held[j])
            a->delta[j] = delta[n++];
    free(free_columns), free(target), free(QS), free(delta);
    return status;
}

/* What the data push out of its range is held at the bound, the worst first. */
static enum bf_status solve_bounded(const struct probe *probe, struct answer *a, struct bf_error *err)
{
    const struct score_base *base = probe->base;
    for (size_t j = 0; j < a->n; j++)
        a->held[j] = false;
    for (;;) {
        const enum bf_status status = solve(base, a, err);
        if (status)
            return status;
        size_t worst = a->n;
        double most = 0.0, bound = 0.0;
        for (size_t j = 0; j < a->n; j++) {
            double low, high;
            answer_range(probe, &a->what[j], a->p, &low, &high);
            const double allowed = fmin(fmax(a->delta[j], low), high);
            const double excess = fabs(a->delta[j] - allowed) * dense_norm(base->n_all, a->S + j * base->n_all);
            if (!a->held[j] && excess > most) {
                most = excess;
                worst = j;
                bound = allowed;
            }
        }
        if (worst == a->n)
            return BF_OK;
        a->held[worst] = true;
        a->delta[worst] = bound;
    }
}

static enum bf_status try_point(struct probe *probe, const double p[], struct answer *now, struct answer *best,
                                struct bf_error *err)
{
    memcpy(now->p, p, sizeof now->p);
    enum bf_status status = probe_columns(probe, p, now->S, now->what, &now->n, err);
    if (!status)
        status = solve_bounded(probe, now, err);
    if (!status && now->LM > best->LM) {
        const struct answer old = *best;
        *best = *now;
        *now = old;
    }
    return status;
}

/* ---- The scan ---- */

static enum bf_status scan_grid(struct probe *probe, struct answer *now, struct answer *best, struct bf_error *err)
{
    const struct candidate *c = probe->candidate;
    const int n_slots = c->effect->n_parameters;
    size_t total = 1, failed = 0;
    enum bf_status status = BF_OK;
    for (int i = 0; i < n_slots; i++)
        total *= c->n_grid[i] ? c->n_grid[i] : 1;
    for (size_t k = 0; k < total; k++) {
        double p[BEAM_EFFECT_PARAMETERS];
        memcpy(p, c->start, sizeof p);
        size_t digits = k;
        for (int i = 0; i < n_slots; i++) {
            if (c->n_grid[i] == 0)
                continue;
            p[i] = c->grid[i][digits % c->n_grid[i]];
            digits /= c->n_grid[i];
        }
        status = try_point(probe, p, now, best, err);
        failed += status != BF_OK;
        if (status != BF_OK && status != BF_NUMERIC)
            return status;
    }
    return failed == total ? status : BF_OK; /* a point without a value is no point */
}

/* Half the distance to the neighbours of the best value, in ln where the parameter is positive by nature. */
static double bracket(const struct candidate *c, int slot, double value, double longest_s, bool *logarithmic)
{
    const struct beam_parameter_info *info = &c->effect->parameters[slot];
    *logarithmic = (info->flags & BEAM_PARAMETER_LOG) && value > 0.0;
    if (info->role == BEAM_ROLE_FREQUENCY)
        return 0.5 / longest_s;
    double nearest = INFINITY;
    for (size_t i = 0; i < c->n_grid[slot]; i++) {
        const double other = c->grid[slot][i];
        const double distance = *logarithmic ? fabs(log(other / value)) : fabs(other - value);
        if (distance > 1e-9 * fabs(value))
            nearest = fmin(nearest, distance);
    }
    return isfinite(nearest) ? nearest : 0.0;
}

/* Golden section about the best value of one scanned parameter. */
static enum bf_status refine_slot(struct probe *probe, int slot, struct answer *now, struct answer *best,
                                  struct bf_error *err)
{
    const struct candidate *c = probe->candidate;
    double longest = 0.0, p[BEAM_EFFECT_PARAMETERS], at[2], LM[2] = {NAN, NAN};
    bool logarithmic;
    for (size_t r = 0; r < probe->base->n_records; r++)
        longest = fmax(longest, (double)probe->base->records[r].n * probe->base->records[r].dt_s);
    memcpy(p, best->p, sizeof p);
    const double width = bracket(c, slot, p[slot], longest, &logarithmic);
    if (!(width > 0.0))
        return BF_OK;
    const double center = logarithmic ? log(p[slot]) : p[slot];
    double low = center - width, high = center + width;
    low = fmax(low, logarithmic ? log(c->lower[slot]) : c->lower[slot]);
    high = fmin(high, logarithmic ? log(c->upper[slot]) : c->upper[slot]);
    for (int k = 0; k < REFINEMENTS; k++) {
        for (int side = 0; side < 2; side++) {
            if (k > 0 && isfinite(LM[side]))
                continue; /* known from the step before */
            at[side] = side ? low + golden * (high - low) : high - golden * (high - low);
            p[slot] = logarithmic ? exp(at[side]) : at[side];
            const double before = best->LM;
            const enum bf_status status = try_point(probe, p, now, best, err);
            if (status && status != BF_NUMERIC)
                return status;
            LM[side] = status ? -1.0 : best->LM > before ? best->LM : now->LM;
        }
        const bool right = LM[1] > LM[0];
        *(right ? &low : &high) = at[!right];
        at[!right] = at[right];
        LM[!right] = LM[right];
        LM[right] = NAN;
    }
    return BF_OK;
}

/* The trial's size follows the estimate, so that the estimate is not extrapolated. */
static enum bf_status follow_estimate(struct probe *probe, struct answer *now, struct answer *best,
                                      struct bf_error *err)
{
    const struct candidate *c = probe->candidate;
    const int slot = c->strength;
    for (int k = 0; k < SECANTS && best->n > 0 && best->delta[0] > 0.0; k++) {
        double p[BEAM_EFFECT_PARAMETERS];
        memcpy(p, best->p, sizeof p);
        const double factor = fmin(fmax(best->delta[0], 1.0 / secant_limit), secant_limit);
        p[slot] = c->role[slot] == CANDIDATE_INVERSE ? p[slot] / factor : p[slot] * factor;
        p[slot] = fmin(fmax(p[slot], c->lower[slot]), c->upper[slot]);
        const enum bf_status status = try_point(probe, p, now, best, err);
        if (status)
            return status == BF_NUMERIC ? BF_OK : status;
    }
    return BF_OK;
}

enum bf_status probe_scan(struct probe *probe, struct answer *now, struct answer *best, struct bf_error *err)
{
    const struct candidate *c = probe->candidate;
    enum bf_status status = scan_grid(probe, now, best, err);
    if (status || best->LM < worth_refining)
        return status;
    if (candidate_is_finite(c, c->strength))
        status = follow_estimate(probe, now, best, err);
    for (int i = 0; i < c->effect->n_parameters && !status; i++)
        if (c->n_grid[i] > 1 && c->role[i] == CANDIDATE_INNER)
            status = refine_slot(probe, i, now, best, err);
    return status;
}
