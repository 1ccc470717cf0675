/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- The quadratic model min gᵀp + ½ pᵀHp within bounds and a ball ---- */

struct quadratic {
    size_t n;
    const double *g, *H, *low, *high; /* low ≤ p ≤ high */
    double radius, rank;
};

/* Work space of one subspace solve; every array has room for n (or n²) numbers. */
struct subspace {
    size_t *index; /* free unknowns */
    double *g, *H, *values, *vectors, *along, *p;
};

static struct subspace subspace_new(size_t n)
{
    return (struct subspace){.index = bf_alloc(n, sizeof(size_t)),
                             .g = bf_alloc(n, sizeof(double)),
                             .H = bf_alloc(n * n, sizeof(double)),
                             .values = bf_alloc(n, sizeof(double)),
                             .vectors = bf_alloc(n * n, sizeof(double)),
                             .along = bf_alloc(n, sizeof(double)),
                             .p = bf_alloc(n, sizeof(double))};
}

static void subspace_free(struct subspace *s)
{
    free(s->index), free(s->g), free(s->H), free(s->values), free(s->vectors), free(s->along), free(s->p);
}

/* ‖p(λ)‖ with p = −Σ v (vᵀg)/(d + λ) over the directions that count. */
static double step_norm(size_t m, const double values[], const double along[], double least, double lambda)
{
    double sum = 0.0;
    for (size_t i = 0; i < m; i++)
        if (values[i] > least)
            sum += pow(along[i] / (values[i] + lambda), 2.0);
    return sqrt(sum);
}

/* λ ≥ 0 with ‖p(λ)‖ ≤ radius, by bisection in log λ: the norm falls monotonically. */
static double damping_for(size_t m, const double values[], const double along[], double least, double radius)
{
    if (step_norm(m, values, along, least, 0.0) <= radius)
        return 0.0;
    double low = 1e-20 * values[m - 1], high = values[m - 1];
    while (step_norm(m, values, along, least, high) > radius)
        high *= 16.0;
    for (int i = 0; i < 80 && high > 1.001 * low; i++) {
        const double middle = sqrt(low * high);
        if (step_norm(m, values, along, least, middle) > radius)
            low = middle;
        else
            high = middle;
    }
    return high;
}

/* Solves in the m free unknowns; the held ones have moved by p already, which changes the gradient seen here. */
static enum bf_status solve_free(const struct quadratic *q, struct subspace *s, size_t m, double p[],
                                 struct bf_error *err)
{
    for (size_t a = 0; a < m; a++) {
        const size_t i = s->index[a];
        double g = q->g[i];
        for (size_t j = 0; j < q->n; j++)
            g += q->H[i + j * q->n] * p[j]; /* p is 0 for the free ones */
        s->g[a] = g;
        for (size_t b = 0; b < m; b++)
            s->H[a + b * m] = q->H[i + s->index[b] * q->n];
    }
    const enum bf_status status = dense_symmetric_eigen(m, s->H, NULL, s->values, s->vectors, err);
    if (status)
        return status;
    const double least = fmax(q->rank * s->values[m - 1], 0.0);
    dense_gemv(true, m, m, 1.0, s->vectors, s->g, 0.0, s->along);
    const double lambda = damping_for(m, s->values, s->along, least, q->radius);
    for (size_t i = 0; i < m; i++)
        s->along[i] = s->values[i] > least ? -s->along[i] / (s->values[i] + lambda) : 0.0;
    dense_gemv(false, m, m, 1.0, s->vectors, s->along, 0.0, s->p);
    for (size_t a = 0; a < m; a++)
        p[s->index[a]] = s->p[a];
    return BF_OK;
}

/* Solve, hold what leaves its bounds at the bound, solve again; at most n rounds. */
static enum bf_status bounded_step(const struct quadratic *q, double p[], struct bf_error *err)
{
    struct subspace s = subspace_new(q->n);
    bool *held = bf_alloc(q->n, sizeof *held);
    double *fixed = bf_alloc(q->n, sizeof *fixed);
    for (size_t i = 0; i < q->n; i++) {
        held[i] = (q->low[i] >= 0.0 && q->g[i] > 0.0) || (q->high[i] <= 0.0 && q->g[i] < 0.0);
        fixed[i] = 0.0;
    }
    enum bf_status status = BF_OK;
    for (bool again = true; again && !status;) {
        size_t m = 0;
        for (size_t i = 0; i < q->n; i++) {
            p[i] = held[i] ? fixed[i] : 0.0;
            if (!held[i])
                s.index[m++] = i;
        }
        again = false;
        if (m == 0)
            break;
        status = solve_free(q, &s, m, p, err);
        for (size_t i = 0; i < q->n && !status; i++) {
            if (held[i] || (p[i] >= q->low[i] && p[i] <= q->high[i]))
                continue;
            held[i] = again = true;
            fixed[i] = p[i] < q->low[i] ? q->low[i] : q->high[i];
        }
    }
    subspace_free(&s);
    free(held), free(fixed);
    return status;
}

static double predicted_fall(size_t n, const double g[], const double H[], const double p[])
{
    double linear = 0.0, square = 0.0;
    for (size_t i = 0; i < n; i++) {
        double Hp = 0.0;
        for (size_t j = 0; j < n; j++)
            Hp += H[i + j * n] * p[j];
        linear += g[i] * p[i];
        square += p[i] * Hp;
    }
    return fmax(-linear - 0.5 * square, 0.0);
}

/* Room to move: low = lower − x, high = upper − x. */
static void room(const struct least_squares *problem, const double x[], double low[], double high[])
{
    for (size_t i = 0; i < problem->n; i++) {
        low[i] = problem->lower ? fmin(problem->lower[i] - x[i], 0.0) : -HUGE_VAL;
        high[i] = problem->upper ? fmax(problem->upper[i] - x[i], 0.0) : HUGE_VAL;
    }
}

static const double default_rank = 1e-13;

enum bf_status optimise_decrement(const struct least_squares *problem, const double x[], const double gradient[],
                                  const double gram[], double rank, double *decrement, double step[],
                                  struct bf_error *err)
{
    const size_t n = problem->n;
    double *low = bf_alloc(n, sizeof *low), *high = bf_alloc(n, sizeof *high), *p = bf_alloc(n, sizeof *p);
    room(problem, x, low, high);
    for (size_t i = 0; i < n; i++) { /* a bound further off says nothing about stationarity here */
        low[i] = low[i] < 0.0 ? -HUGE_VAL : 0.0;
        high[i] = high[i] > 0.0 ? HUGE_VAL : 0.0;
    }
    const struct quadratic q = {.n = n,
                                .g = gradient,
                                .H = gram,
                                .low = low,
                                .high = high,
                                .radius = INFINITY,
                                .rank = rank > 0.0 ? rank : default_rank};
    const enum bf_status status = bounded_step(&q, p, err);
    *decrement = status ? 0.0 : predicted_fall(n, gradient, gram, p);
    if (step)
        memcpy(step, p, n * sizeof *p);
    free(low), free(high), free(p);
    return status;
}

/* ---- Trust region ---- */

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
    room(s->problem, s->x, s->low, s->high);
    const struct quadratic q = {n, s->gradient, s->gram, s->low, s->high, s->radius, s->options.rank};
    const enum bf_status status = bounded_step(&q, s->step, err);
    *expected = status ? 0.0 : predicted_fall(n, s->gradient, s->gram, s->step);
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
    s->tried = value, s->expected = expected;
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

/* Steps are short, and the last one went up by little more than it was to fall: it ended on the wall of a valley, not somewhere else. */
static bool is_on_a_wall(const struct search *s)
{
    static const double short_step = 0.1, little_more = 10.0;
    return s->radius < short_step && s->tried - s->out->half_square <= little_more * s->expected;
}

/*
 * In a valley that bends, a step along its floor ends on its wall, and one that does not is short. From the wall the linearised problem leads back to
 * the floor: two steps along the bend instead of a hundred (a watchdog: Chamberlain et al., Mathematical Programming Study 16, 1982). *moved when
 * that is lower than where they began; else all is as it was. Cost: two derivatives and a value.
 */
static enum bf_status step_by_the_wall(struct search *s, bool *moved, struct bf_error *err)
{
    const size_t n = s->problem->n;
    const double before = s->out->half_square, length = dense_norm(n, s->step), radius = s->radius;
    double *start = bf_alloc(n, sizeof *start), value = HUGE_VAL, expected;
    memcpy(start, s->x, n * sizeof *start);
    memcpy(s->x, s->trial, n * sizeof *start);
    s->radius = length;
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

/* Steps by the wall that lead nowhere are tried less and less often. */
struct walls {
    int wait, patience; /* steps until the next may be tried; after the next failure, half as many */
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
    o.rank = o.rank > 0.0 ? o.rank : default_rank;
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
