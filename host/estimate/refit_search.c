/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "refit_search.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fit_best.h"
#include "fit_phase.h"
#include "fit_starts.h"
#include "refit_horizon.h"
#include "refit_law.h"

enum { SCAN_VALUES = 96, RANK_ITERATIONS = 8 };
static const double follow_within = 4.0; /* times the ½χ² of the best start: starts above are dropped */
static const double reached = 1.1;       /* root mean square in noises up to which no other start is tried */

static bool is_new(const struct refit_search *t, size_t unknown)
{
    const struct parameter_ref *ref = &t->p->refs[t->p->unknowns[unknown].ref];
    return ref->role == ROLE_EFFECT && ref->owner >= t->first_effect;
}

/* Strengths of the new effects from one linear least-squares step: they may be far larger than the start. */
static enum bf_status linear_amount(struct refit_search *t, double theta[], struct bf_error *err)
{
    struct fit_problem *p = t->p;
    const size_t n = p->n_unknowns;
    const struct least_squares view = fit_problem_view(p);
    double *x = bf_alloc(n, sizeof *x), *gradient = bf_alloc(n, sizeof *gradient);
    double *gram = bf_alloc(n * n, sizeof *gram), *step = bf_alloc(n, sizeof *step), square, fall;
    starts_to_x(p, theta, x);
    enum bf_status status = view.derivative(p, x, &square, gradient, gram, err);
    if (!status)
        status = optimise_decrement(&view, x, gradient, gram, 0.0, &fall, step, err);
    for (size_t i = 0; i < n && !status; i++) {
        const struct unknown *u = &p->unknowns[i];
        if (!is_new(t, i) || u->logarithmic || !is_strength(effect_parameter(p, i)))
            continue;
        const double there = fmin(fmax(x[i] + step[i], p->lower[i]), p->upper[i]);
        if (fabs(there) > fabs(x[i]))
            theta[u->ref] = there * u->scale;
    }
    free(x), free(gradient), free(gram), free(step);
    return status;
}

/* A few steps in the window as it is. */
static enum bf_status try_start(struct refit_search *t, const double theta[], struct starts *kept, struct bf_error *err)
{
    struct fit_problem *p = t->p;
    double *x = bf_alloc(p->n_unknowns, sizeof *x), *moved = bf_alloc(t->p->n_refs, sizeof *moved);
    const struct optimise_options options = {.iterations = 4, .tolerance = 1e-2, .relative = 1e-2};
    struct optimise_result result = {0};
    memcpy(moved, theta, t->p->n_refs * sizeof *moved);
    enum bf_status status = linear_amount(t, moved, err);
    if (!status) {
        const struct least_squares view = fit_problem_view(p);
        starts_to_x(p, moved, x);
        status = optimise_local(&view, &options, x, &result, err);
    }
    if (!status) {
        fit_problem_to_theta(p, x, moved);
        starts_add(kept, moved, result.half_square);
    }
    t->tried++;
    free(x), free(moved);
    return status == BF_NUMERIC ? BF_OK : status; /* a start without a value is no start */
}

/* Ranks the model's values and a grid of thresholds and places in a short window. */
static enum bf_status rank_starts(struct refit_search *t, struct starts *kept, struct bf_error *err)
{
    static const double floor = 0.02;
    struct fit_problem *p = t->p;
    double *theta = bf_alloc(t->p->n_refs, sizeof *theta), *x = bf_alloc(p->n_unknowns, sizeof *x);
    memcpy(theta, t->theta0, t->p->n_refs * sizeof *theta);
    starts_to_x(p, theta, x);
    phases_hold(p, x);
    struct start_grid grid = start_grid_new(p, t->first_effect, p->model->n_effects, 1, false);
    fit_problem_to_theta(p, x, theta);
    enum bf_status status = BF_OK;
    if (grid.n <= 1) {
        starts_add(kept, theta, 0.0);
    } else {
        status = fit_problem_stage(p, t->stairs.first_ps, floor, x, err);
        if (!status)
            fit_problem_weigh_priors(p, x);
        for (size_t k = 0; k < grid.n && !status && !fit_problem_interrupted(p); k++) {
            start_grid_at(&grid, p, k, theta);
            status = try_start(t, theta, kept, err);
        }
    }
    start_grid_free(&grid);
    free(theta), free(x);
    return status;
}

/* As rank_starts(), for nonlinear effects: the given values and those of law_starts(), after a few steps. */
static enum bf_status rank_laws(struct refit_search *t, struct starts *kept, struct bf_error *err)
{
    struct fit_problem *p = t->p;
    struct starts found = starts_new(t->quick ? 3 : 6, p->n_refs, p->refs, t->first_effect);
    const double last_ps = 1.0 / t->stairs.longest_s;
    double scanned_ps;
    enum bf_status status = law_starts(p, t->first_effect, SCAN_VALUES, 3.0 * t->stairs.first_ps, last_ps, t->theta0,
                                       &found, &scanned_ps, err);
    t->stairs.first_ps = scanned_ps;
    if (!status)
        status = try_start(t, t->theta0, kept, err);
    for (size_t k = 0; k < found.n && !status && !fit_problem_interrupted(p); k++)
        status = try_start(t, found.theta + k * p->n_refs, kept, err);
    starts_free(&found);
    return status;
}

/* Ranks the starts again in a window that is longer by the factor and keeps `room` of them; the staircase begins with that window. */
static enum bf_status rank_again(struct refit_search *t, double longer, struct starts *starts, size_t room,
                                 struct bf_error *err)
{
    struct fit_problem *p = t->p;
    starts_prune(starts, follow_within);
    if (starts->n <= room)
        return BF_OK;
    struct starts fewer = starts_new(room, t->p->n_refs, t->p->refs, t->first_effect);
    double *x = bf_alloc(p->n_unknowns, sizeof *x), *theta = bf_alloc(t->p->n_refs, sizeof *theta);
    enum bf_status status = BF_OK;
    memcpy(theta, t->theta0, t->p->n_refs * sizeof *theta);
    t->stairs.first_ps /= longer;
    for (size_t k = 0; k < starts->n && !status && !fit_problem_interrupted(p); k++) {
        struct optimise_result result = {0};
        starts_to_x(p, starts->theta + k * t->p->n_refs, x);
        status = staircase_step(p, t->stairs.first_ps, RANK_ITERATIONS, x, &result, err);
        if (!status) {
            fit_problem_to_theta(p, x, theta);
            starts_add(&fewer, theta, result.half_square);
        } else if (status == BF_NUMERIC) {
            status = BF_OK;
        }
    }
    starts_free(starts);
    *starts = fewer;
    free(x), free(theta);
    return status;
}

/* The lowest end of a staircase so far. */
struct best_end {
    bool have;
    double *theta;     /* [n_refs] */
    double *explained; /* [n_refs] of the longest window that was explained, if any: explained_ps > 0 */
    double explained_ps;
    double *horizon_s; /* [n_records] */
    size_t n_used;     /* rows before the horizons */
    struct optimise_result found;
};

static bool explained(const struct best_end *best)
{
    return best->have && 2.0 * best->found.half_square <= reached * reached * (double)best->n_used;
}

/* Keeps x, the end of a staircase, when its mean square is the lowest. */
static void keep_lowest(const struct refit_search *t, const double x[], const struct optimise_result *found,
                        struct best_end *best)
{
    const struct fit_problem *p = t->p;
    if (p->n_used == 0 ||
        (best->have && found->half_square / (double)p->n_used >= best->found.half_square / (double)best->n_used))
        return;
    memcpy(best->theta, t->theta0, p->n_refs * sizeof *best->theta);
    fit_problem_to_theta(p, x, best->theta);
    memcpy(best->explained, p->explained, p->n_refs * sizeof *best->explained);
    memcpy(best->horizon_s, p->horizon_s, p->n_records * sizeof *best->horizon_s);
    best->have = true, best->explained_ps = p->explained_ps, best->n_used = p->n_used, best->found = *found;
}

/* A window many times the first is explained, so the law is known: the rest of the records lacks something else or cannot be predicted. */
static bool far_explained(const struct refit_search *t, const struct best_end *best)
{
    static const double far = 8.0;
    return best->have && best->explained_ps > 0.0 && best->explained_ps * far < t->stairs.first_ps;
}

/* Goes down the staircase from each start, until one explains the records. */
static enum bf_status descend(struct refit_search *t, const struct starts *starts, struct best_end *best,
                              struct bf_error *err)
{
    struct fit_problem *p = t->p;
    double *x = bf_alloc(p->n_unknowns, sizeof *x);
    enum bf_status status = BF_OK;
    for (size_t k = 0; k < starts->n; k++) {
        struct optimise_result found;
        starts_to_x(p, starts->theta + k * p->n_refs, x);
        status = staircase_run(p, &t->stairs, t->bar, x, &found, err);
        t->tried++;
        if (status && status != BF_NUMERIC)
            break;
        if (!status)
            keep_lowest(t, x, &found, best);
        if (fit_problem_interrupted(p) || explained(best))
            break;
    }
    free(x);
    return status == BF_NUMERIC ? BF_OK : status;
}

/* Goes down from the start that the equation-error trial gives; when it explains the records, no other start is tried. */
static enum bf_status descend_trial(struct refit_search *t, struct best_end *best, struct bf_error *err)
{
    struct fit_problem *p = t->p;
    if (t->baseline == NULL)
        return BF_OK;
    struct starts one = starts_new(1, p->n_refs, p->refs, t->first_effect);
    double *theta = bf_alloc(p->n_refs, sizeof *theta);
    bool possible;
    enum bf_status status = law_trial(p, &t->predict, t->first_effect, t->baseline, t->theta0, theta, &possible, err);
    if (!status && possible) {
        starts_add(&one, theta, 0.0);
        status = descend(t, &one, best, err);
    }
    free(theta);
    starts_free(&one);
    return status;
}

/* Ranks the starts in two or three windows and goes down the staircase from the best. */
static enum bf_status descend_from_ranked(struct refit_search *t, bool law, struct best_end *best, struct bf_error *err)
{
    struct fit_problem *p = t->p;
    struct starts starts = starts_new(t->quick ? 3 : 6, p->n_refs, p->refs, t->first_effect);
    const size_t before = p->runs;
    enum bf_status status = law ? BF_OK : starts_restore_vanished(p, t->theta0, err);
    if (!status)
        status = law ? rank_laws(t, &starts, err) : rank_starts(t, &starts, err);
    if (!status && law)
        status = rank_again(t, 3.0, &starts, t->quick ? 2 : 4, err);
    if (!status)
        status = rank_again(t, law ? 3.0 : 10.0, &starts, t->quick ? 1 : 2, err);
    /* a quick look goes as far down with a place, whose starts are many, as without; steps through time are too dear for that */
    if (!model_has_law(p->model))
        fit_problem_do_not_count(p, before);
    if (!status)
        status = descend(t, &starts, best, err);
    starts_free(&starts);
    return status;
}

/* Refits with the rows that can be predicted from the best values: the horizon depends on the values. */
static enum bf_status move_horizon(struct refit_search *t, struct best_end *best, struct bf_error *err)
{
    struct fit_problem *p = t->p;
    double *x = bf_alloc(p->n_unknowns, sizeof *x);
    struct optimise_result found;
    bool any;
    enum bf_status status = horizon_find(p, &t->predict, best->theta, &any, err);
    starts_to_x(p, best->theta, x);
    if (!status)
        status = staircase_last(p, &t->stairs, x, &found, err);
    if (!status && p->n_used > 0 && 2.0 * found.half_square <= reached * reached * (double)p->n_used) {
        best->have = false;
        keep_lowest(t, x, &found, best);
    }
    free(x);
    return status == BF_NUMERIC ? BF_OK : status;
}

static bool is_cut(const struct refit_search *t, const struct best_end *best)
{
    for (size_t r = 0; r < t->p->n_records; r++)
        if (isfinite(best->horizon_s[r]))
            return true;
    return false;
}

/* x and *found become the other end where that is lower; else the problem is at x once more. */
static enum bf_status keep_lower(struct fit_problem *p, const double other[], const struct optimise_result *end,
                                 double x[], struct optimise_result *found, struct bf_error *err)
{
    if (end->half_square < found->half_square) {
        memcpy(x, other, p->n_unknowns * sizeof *x);
        *found = *end;
    }
    return fit_problem_whole(p, x, err);
}

/*
 * A hum or a shaking clamp has a minimum in each wrong frequency, and the first-order score that theta0 is of may have taken one: whole records once more
 * with the frequency and the phases of the lines that stand out of the residual.
 */
static enum bf_status from_lines(struct refit_search *t, double x[], struct optimise_result *found,
                                 struct bf_error *err)
{
    struct fit_problem *p = t->p;
    struct optimise_result end = {.half_square = HUGE_VAL};
    double *other = bf_alloc(p->n_unknowns, sizeof *other);
    starts_to_x(p, t->theta0, other);
    phases_hold(p, other);
    enum bf_status status = phases_find(p, other, err);
    t->tried++;
    if (!status)
        status = staircase_last(p, &t->stairs, other, &end, err);
    if (!status || status == BF_NUMERIC)
        status = keep_lower(p, other, &end, x, found, err);
    free(other);
    return status;
}

/* Refits whole records from theta0 alone. Rows that cannot be predicted from theta0 do not count. */
static enum bf_status refine_near(struct refit_search *t, double x[], struct optimise_result *found,
                                  struct bf_error *err)
{
    struct fit_problem *p = t->p;
    bool cut;
    enum bf_status status = model_has_law(p->model) ? horizon_find(p, &t->predict, t->theta0, &cut, err) : BF_OK;
    starts_to_x(p, t->theta0, x);
    t->tried = 1;
    if (!status)
        status = staircase_last(p, &t->stairs, x, found, err);
    if (!status && p->n_used == 0)
        status = bf_fail(err, BF_NUMERIC, "no row of the records can be predicted");
    if (!status && phases_any(p, t->first_effect) && !fit_problem_interrupted(p))
        status = from_lines(t, x, found, err);
    if (!status)
        phases_wrap(p, x);
    return status;
}

/* What a start comes to on whole records at once, where it is below the end that there is, and that is lower. */
static enum bf_status from_start(struct refit_search *t, const double theta[], double x[],
                                 struct optimise_result *found, struct bf_error *err)
{
    struct tried one = {0};
    if (t->quick || fit_problem_interrupted(t->p))
        return BF_OK;
    tried_add(&one, t->p, theta);
    const enum bf_status status = best_of_tried(&one, t->p, &t->stairs, x, found, err);
    tried_free(&one);
    return status;
}

/* The best end, or that of one of the starts. */
static enum bf_status take_best(struct refit_search *t, const struct best_end *best, double x[],
                                struct optimise_result *found, struct bf_error *err)
{
    struct fit_problem *p = t->p;
    starts_to_x(p, best->theta, x);
    *found = best->found;
    p->explained_ps = best->explained_ps;
    memcpy(p->horizon_s, best->horizon_s, p->n_records * sizeof *best->horizon_s);
    enum bf_status status = fit_problem_whole(p, x, err);
    const bool more = !explained(best); /* at the noise no other start is worth a prediction */
    const bool near = 2.0 * found->half_square <= t->raise_below * (double)p->n_used;
    if (!status && (t->stairs.gentle || (more && near)) && !fit_problem_interrupted(p))
        status = best_raise_vanished(p, &t->stairs, x, found, err);
    if (!status && more)
        status = from_start(t, t->theta0, x, found, err);
    for (size_t k = 0; k < t->n_starts && !status && more; k++)
        status = from_start(t, t->starts + k * p->n_refs, x, found, err);
    return status;
}

enum bf_status refit_search_run(struct refit_search *t, double x[], struct optimise_result *found, struct bf_error *err)
{
    if (t->near)
        return refine_near(t, x, found, err);
    struct fit_problem *p = t->p;
    const bool law = law_is_new(p, t->first_effect);
    struct best_end best = {.theta = bf_alloc(p->n_refs, sizeof *best.theta),
                            .explained = bf_alloc(p->n_refs, sizeof *best.explained),
                            .horizon_s = bf_alloc(p->n_records, sizeof *best.horizon_s)};
    t->stairs.predict = &t->predict;
    t->stairs.gentle = model_has_law(p->model) && !t->quick;
    enum bf_status status = law ? descend_trial(t, &best, err) : BF_OK;
    if (!status && !(best.have && (t->quick || explained(&best) || fit_problem_interrupted(p))) &&
        !far_explained(t, &best))
        status = descend_from_ranked(t, law, &best, err);
    if (!status && !best.have)
        status = bf_fail(err, BF_NUMERIC, "no start of the new effects has a value");
    if (!status && is_cut(t, &best) && explained(&best) && !fit_problem_interrupted(p))
        status = move_horizon(t, &best, err);
    if (best.have)
        status = take_best(t, &best, x, found, err);
    free(best.theta), free(best.explained), free(best.horizon_s);
    return status;
}
