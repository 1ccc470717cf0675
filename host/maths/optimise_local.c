/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "optimise_step.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct search {
    const struct least_squares *problem;
    struct optimise_options options;
    double *x, *trial, *gradient, *gram, *low, *high, *step;
    double radius;
    double tried, expected; /* ½‖r‖² where the last step led to, and how far it was to fall */
    struct optimise_result *out;
};

static bool interrupted(const struct least_squares *problem)
{
    return problem->interrupted && problem->interrupted(problem->context);
}

static enum bf_status linearise(struct search *s, struct bf_error *err)
{
    const struct least_squares *problem = s->problem;
    s->out->derivatives++;
    enum bf_status status =
        problem->derivative(problem->context, s->x, &s->out->half_square, s->gradient, s->gram, err);
    if (!status && !isfinite(s->out->half_square))
        status = bf_fail(err, BF_NUMERIC, "the sum of squares is not finite");
    if (!status)
        status =
            optimise_decrement(problem, s->x, s->gradient, s->gram, s->options.rank, &s->out->decrement, NULL, err);
    return status;
}

static bool small_enough(const struct search *s)
{
    const struct optimise_options *o = &s->options;
    const double fall = s->out->decrement, square = s->out->half_square;
    return fall <= o->tolerance || fall <= o->relative * square || fall <= o->form * (square - o->noise);
}

/* So many steps ago ½‖r‖² was this. */
struct pace {
    int steps;
    double square;
};

/* A valley that bends promises more than its steps hold: what several of them have brought together is as little as would end the search as a promise. */
static bool creeps(const struct search *s, struct pace *pace)
{
    enum { PATIENCE = 6 };
    const struct optimise_options *o = &s->options;
    const double square = s->out->half_square, fall = pace->square - square;
    if (pace->steps < PATIENCE)
        return false;
    *pace = (struct pace){.square = square};
    return fall <= o->relative * square || fall <= o->form * (square - o->noise);
}

static bool give_up_above(const struct search *s)
{
    return s->options.give_up_above > 0.0 && s->out->half_square - 10.0 * s->out->decrement > s->options.give_up_above;
}

static enum bf_status choose_step(struct search *s, double *expected, struct bf_error *err)
{
    const size_t n = s->problem->n;
    quadratic_room(s->problem, s->x, s->low, s->high);
    const struct quadratic q = {n, s->gradient, s->gram, s->low, s->high, s->radius, s->options.rank};
    const enum bf_status status = quadratic_step(&q, s->step, err);
    *expected = status ? 0.0 : quadratic_fall(n, s->gradient, s->gram, s->step);
    return status;
}

static enum bf_status value_after_step(struct search *s, double *value, struct bf_error *err)
{
    for (size_t i = 0; i < s->problem->n; i++)
        s->trial[i] = s->x[i] + s->step[i];
    s->out->values++;
    return s->problem->value(s->problem->context, s->trial, value, err);
}

/* One trial step; *moved when x went there. A step cut by many bounds may promise nothing: then a shorter one will. */
static enum bf_status try_step(struct search *s, bool *moved, struct bf_error *err)
{
    const struct least_squares *problem = s->problem;
    const size_t n = problem->n;
    double expected, value = HUGE_VAL;
    *moved = false;
    s->tried = HUGE_VAL;
    enum bf_status status = choose_step(s, &expected, err);
    if (status)
        return status;
    const double length = dense_norm(n, s->step);
    if (expected <= 0.0) {
        s->radius = 0.25 * fmin(length, s->radius);
        return BF_OK;
    }
    status = value_after_step(s, &value, err);
    if (status && status != BF_NUMERIC)
        return status;
    s->tried = status ? HUGE_VAL : value, s->expected = expected;
    const double ratio = status || !isfinite(value) ? -1.0 : (s->out->half_square - value) / expected;
    if (ratio < 0.25)
        s->radius = 0.25 * fmin(length, s->radius);
    else if (ratio > 0.7)
        s->radius = fmin(fmax(s->radius, 2.5 * length), s->options.radius_max);
    if (ratio > 1e-4) {
        for (size_t i = 0; i < n; i++) { /* trial keeps the place left */
            const double left = s->x[i];
            s->x[i] = s->trial[i], s->trial[i] = left;
        }
        s->out->half_square = value;
        *moved = true;
    }
    return BF_OK;
}

/*
 * After a step. The problem may refine itself where it arrives (a rebased model); when the fall from `before` is not real there, or the
 * refined problem has no value (a beam beyond buckling), the step is taken back and a shorter one will follow. Without this a badly
 * determined direction is followed without end.
 */
static enum bf_status arrive(struct search *s, double before, struct bf_error *err)
{
    const enum bf_status status = linearise(s, err);
    if ((status && status != BF_NUMERIC) || (!status && s->out->half_square <= before))
        return status;
    memcpy(s->x, s->trial, s->problem->n * sizeof *s->x);
    s->radius = fmin(s->radius, 0.25 * dense_norm(s->problem->n, s->step));
    return linearise(s, err);
}

/*
 * Steps are short, and the last one went up: on the wall of a valley, not somewhere else. Where it was l long, the wall rises as l⁴, and what is left of it
 * after a step back as l⁶: where l is a few hundredths that is a thousandth.
 */
static bool is_on_a_wall(const struct search *s)
{
    static const double short_step = 0.1; /* of x */
    static const double rise = 1000.0;    /* times the expected fall */
    return s->radius < short_step && s->tried - s->out->half_square <= rise * s->expected;
}

/*
 * In a valley that bends, a step along its floor ends on its wall, and one that does not is short. A step back, too short to lead further along the wall,
 * ends on the floor again (a second-order correction: Nocedal and Wright, Numerical Optimization, 2006, section 15.6). *moved when that is lower than where
 * both began; else all is as it was. Cost: a value and one derivative, two where it fails.
 */
static enum bf_status step_by_the_wall(struct search *s, bool *moved, struct bf_error *err)
{
    const size_t n = s->problem->n;
    static const double back = 0.1; /* of the length of the step that led there */
    const double before = s->out->half_square, length = dense_norm(n, s->step), radius = s->radius;
    double *start = bf_alloc(n, sizeof *start), value = HUGE_VAL, expected;
    memcpy(start, s->x, n * sizeof *start);
    memcpy(s->x, s->trial, n * sizeof *start);
    s->radius = back * length;
    enum bf_status status = linearise(s, err);
    if (!status)
        status = choose_step(s, &expected, err);
    if (!status)
        status = value_after_step(s, &value, err);
    *moved = !status && value < before;
    memcpy(s->x, *moved ? s->trial : start, n * sizeof *start);
    memcpy(s->trial, start, n * sizeof *start); /* the place left */
    for (size_t i = 0; i < n; i++)
        s->step[i] = s->x[i] - start[i];
    free(start);
    s->radius = *moved ? fmin(2.5 * length, s->options.radius_max) : radius;
    if (*moved)
        s->out->half_square = value;
    return *moved || (status && status != BF_NUMERIC) ? status : linearise(s, err);
}

/* Steps by the wall that lead nowhere are tried less and less often: after 2, 4, 8 further steps. */
struct walls {
    int wait;     /* steps until the next may be tried */
    int patience; /* of them after the last one: 1 where it went down, else twice as many as before */
};

static enum bf_status step(struct search *s, struct walls *walls, bool *moved, struct bf_error *err)
{
    enum bf_status status = try_step(s, moved, err);
    if (walls->wait > 0)
        walls->wait--;
    if (status || *moved || walls->wait > 0 || !is_on_a_wall(s))
        return status;
    status = step_by_the_wall(s, moved, err);
    walls->patience = *moved ? 1 : 2 * walls->patience;
    walls->wait = walls->patience;
    return status;
}

static bool is_enough(const struct search *s)
{
    return s->options.enough > 0.0 && s->out->half_square <= s->options.enough;
}

/* Nothing to be done at the start. */
static enum bf_status enough_there(struct search *s, bool *enough, struct bf_error *err)
{
    *enough = false;
    if (!(s->options.enough > 0.0))
        return BF_OK;
    s->out->values++;
    const enum bf_status status = s->problem->value(s->problem->context, s->x, &s->out->half_square, err);
    *enough = !status && is_enough(s);
    return status;
}

static enum bf_status descend(struct search *s, struct bf_error *err)
{
    bool enough;
    enum bf_status status = enough_there(s, &enough, err);
    if (status || enough)
        return status;
    status = linearise(s, err);
    s->out->end = OPTIMISE_ITERATIONS;
    struct pace pace = {.square = s->out->half_square};
    struct walls walls = {.patience = 1};
    for (int i = 0; i < s->options.iterations && !status; i++) {
        if (small_enough(s) || creeps(s, &pace)) {
            s->out->end = OPTIMISE_CONVERGED;
            break;
        }
        if (interrupted(s->problem) || give_up_above(s)) {
            s->out->end = interrupted(s->problem) ? OPTIMISE_INTERRUPTED : OPTIMISE_GAVE_UP;
            break;
        }
        bool moved;
        const double before = s->out->half_square;
        status = step(s, &walls, &moved, err);
        if (!status && !moved && s->radius < 1e-10) {
            s->out->end = OPTIMISE_STALLED;
            break;
        }
        if (!status && moved && is_enough(s)) {
            s->out->end = OPTIMISE_CONVERGED;
            break;
        }
        if (!status && moved)
            status = arrive(s, before, err);
        pace.steps += moved && s->out->half_square < before; /* a step that was taken back is none */
    }
    if (!status && s->out->end == OPTIMISE_ITERATIONS && small_enough(s))
        s->out->end = OPTIMISE_CONVERGED;
    return status;
}

enum bf_status optimise_local(const struct least_squares *problem, const struct optimise_options *options, double x[],
                              struct optimise_result *out, struct bf_error *err)
{
    const size_t n = problem->n;
    *out = (struct optimise_result){.end = OPTIMISE_CONVERGED};
    struct optimise_options o = options ? *options : (struct optimise_options){0};
    o.iterations = o.iterations > 0 ? o.iterations : 50;
    o.radius = o.radius > 0.0 ? o.radius : 0.5;
    o.radius_max = o.radius_max > 0.0 ? o.radius_max : 4.0;
    o.tolerance = o.tolerance > 0.0 ? o.tolerance : 1e-6;
    o.rank = o.rank > 0.0 ? o.rank : QUADRATIC_RANK;
    if (n == 0)
        return problem->value(problem->context, x, &out->half_square, err);
    double *work = bf_alloc(5 * n + n * n, sizeof *work);
    struct search s = {.problem = problem,
                       .options = o,
                       .x = x,
                       .trial = work,
                       .gradient = work + n,
                       .low = work + 2 * n,
                       .high = work + 3 * n,
                       .step = work + 4 * n,
                       .gram = work + 5 * n,
                       .radius = o.radius,
                       .out = out};
    for (size_t i = 0; i < n && problem->lower && problem->upper; i++)
        x[i] = fmin(fmax(x[i], problem->lower[i]), problem->upper[i]);
    const enum bf_status status = descend(&s, err);
    free(work);
    return status;
}
