/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The global stage: many starts at the cheapest window, the best few through the staircase. */
#include "fit_stages.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fit_starts.h"

enum {
    GRID_STARTS = 48,    /* per effect, at most */
    RANDOM_VALUES = 600, /* evaluations of the controlled random search, at the cheapest window */
    PROMISING = 4        /* starts that go through the whole staircase */
};
static const double box = 1.1;      /* half width in x of the random search: a factor of 3 */
static const double tied_box = 2.0; /* … in standard deviations of a prior */

/* ---- The list of minima ---- */

struct minima minima_new(size_t room, const struct fit_problem *p)
{
    return (struct minima){.room = room,
                           .half_square = bf_alloc(room, sizeof(double)),
                           .theta = bf_alloc(room * p->n_refs, sizeof(double))};
}

static bool same_minimum(const struct minima *minima, size_t i, const struct fit_problem *p, const double theta[],
                         double half_square)
{
    static const double near = 0.1; /* in x */
    const double *other = minima->theta + i * p->n_refs;
    if (fabs(minima->half_square[i] - half_square) > fmax(1.0, 0.01 * half_square))
        return false;
    for (size_t j = 0; j < p->n_unknowns; j++) {
        const struct unknown *u = &p->unknowns[j];
        const double a = theta[u->ref], b = other[u->ref];
        if (fabs(u->logarithmic ? log(a / b) : (a - b) / u->scale) > near)
            return false;
    }
    return true;
}

static void minima_remove(struct minima *minima, size_t i, size_t n_refs)
{
    minima->n--;
    for (; i < minima->n; i++) {
        minima->half_square[i] = minima->half_square[i + 1];
        memcpy(minima->theta + i * n_refs, minima->theta + (i + 1) * n_refs, n_refs * sizeof *minima->theta);
    }
}

void minima_add(struct minima *minima, const struct fit_problem *p, const double theta[], double half_square)
{
    const size_t n = p->n_refs;
    for (size_t i = 0; i < minima->n; i++) {
        if (!same_minimum(minima, i, p, theta, half_square))
            continue;
        if (minima->half_square[i] <= half_square)
            return;
        minima_remove(minima, i, n);
        break;
    }
    size_t at = 0;
    while (at < minima->n && minima->half_square[at] <= half_square)
        at++;
    if (at >= minima->room)
        return;
    if (minima->n < minima->room)
        minima->n++;
    for (size_t i = minima->n - 1; i > at; i--) {
        minima->half_square[i] = minima->half_square[i - 1];
        memcpy(minima->theta + i * n, minima->theta + (i - 1) * n, n * sizeof *theta);
    }
    minima->half_square[at] = half_square;
    memcpy(minima->theta + at * n, theta, n * sizeof *theta);
}

void minima_free(struct minima *minima)
{
    free(minima->half_square), free(minima->theta);
    *minima = (struct minima){0};
}

/* ---- Starts ---- */

struct search_state {
    struct fit_problem *p;
    const struct model *model;
    const struct staircase *stairs;
    const double *start; /* [n_unknowns] x, with the scales of the first stage */
    struct minima *promising;
    struct bf_error *err;
};

static void add_x(struct minima *minima, const struct fit_problem *p, const double x[], double half_square)
{
    double *theta = bf_alloc(p->n_refs, sizeof *theta);
    memcpy(theta, p->theta, p->n_refs * sizeof *theta);
    fit_problem_to_theta(p, x, theta);
    minima_add(minima, p, theta, half_square);
    free(theta);
}

/* A few steps from x at the cheapest window; what comes out is a candidate. */
static enum bf_status try_start(struct search_state *s, const double x[])
{
    const size_t n = s->p->n_unknowns;
    double *moved = bf_alloc(n, sizeof *moved);
    memcpy(moved, x, n * sizeof *x);
    const struct optimise_options options = {.iterations = 8, .tolerance = 1e-2, .relative = 1e-2};
    const struct least_squares view = fit_problem_view(s->p);
    struct optimise_result result;
    enum bf_status status = optimise_local(&view, &options, moved, &result, s->err);
    if (!status)
        add_x(s->promising, s->p, moved, result.half_square);
    free(moved);
    return status == BF_NUMERIC ? BF_OK : status; /* a start without a value is no start */
}

/* The product of the grids of one effect's free parameters. */
static enum bf_status scan_effect(struct search_state *s, size_t effect)
{
    struct fit_problem *p = s->p;
    double *x = bf_alloc(p->n_unknowns, sizeof *x), *theta = bf_alloc(p->n_refs, sizeof *theta);
    struct start_grid grid = start_grid_new(p, effect, effect + 1, 1, true);
    enum bf_status status = BF_OK;
    const size_t stride = (grid.n + GRID_STARTS - 1) / GRID_STARTS;
    memcpy(theta, p->theta, p->n_refs * sizeof *theta);
    fit_problem_to_theta(p, s->start, theta);
    for (size_t k = 0; k < grid.n && !status && !fit_problem_interrupted(p); k += stride) {
        start_grid_at(&grid, p, k, theta);
        fit_problem_to_x(p, theta, x);
        status = try_start(s, x);
    }
    start_grid_free(&grid);
    free(x), free(theta);
    return status;
}

/* NLopt over the structure's parameters and gains in a box around the start. */
static enum bf_status scan_box(struct search_state *s)
{
    const size_t n = s->p->n_unknowns;
    double *lower = bf_alloc(n, sizeof *lower), *upper = bf_alloc(n, sizeof *upper), *x = bf_alloc(n, sizeof *x);
    double value;
    for (size_t i = 0; i < n; i++) {
        const struct unknown *u = &s->p->unknowns[i];
        const double half = u->prior > 0.0 ? fmin(box, tied_box * u->prior) : box;
        lower[i] = fmax(s->p->lower[i], s->start[i] - half);
        upper[i] = fmin(s->p->upper[i], s->start[i] + half);
        x[i] = s->start[i];
    }
    struct least_squares view = fit_problem_view(s->p);
    view.lower = lower, view.upper = upper;
    enum bf_status status = optimise_global(&view, OPTIMISE_CRS, RANDOM_VALUES, x, &value, s->err);
    if (!status)
        status = try_start(s, x);
    free(lower), free(upper), free(x);
    return status == BF_NUMERIC ? BF_OK : status;
}

static enum bf_status climb(struct search_state *s, struct progress *bar, struct minima *minima)
{
    struct fit_problem *p = s->p;
    double *x = bf_alloc(p->n_unknowns, sizeof *x);
    enum bf_status status = BF_OK;
    for (size_t k = 0; k < s->promising->n && !status && !fit_problem_interrupted(p); k++) {
        struct optimise_result result;
        fit_problem_to_x(p, s->promising->theta + k * p->n_refs, x);
        status = staircase_run(p, s->stairs, bar, x, &result, s->err);
        if (!status)
            add_x(minima, p, x, result.half_square);
        else if (status == BF_NUMERIC)
            status = BF_OK;
    }
    free(x);
    return status;
}

enum bf_status search_run(struct fit_problem *p, const struct model *model, const struct staircase *stairs,
                          struct progress *bar, const double start[], struct minima *minima, struct bf_error *err)
{
    static const double floor = 0.02;
    struct minima promising = minima_new(PROMISING, p);
    double *x = bf_alloc(p->n_unknowns, sizeof *x);
    struct search_state s = {p, model, stairs, x, &promising, err};
    fit_problem_to_x(p, start, x);
    enum bf_status status = fit_problem_stage(p, stairs->first_ps, floor, x, err);
    if (!status)
        status = try_start(&s, x);
    for (size_t e = 0; e < model->n_effects && !status; e++)
        status = scan_effect(&s, e);
    if (!status)
        status = scan_box(&s);
    if (!status)
        status = climb(&s, bar, minima);
    minima_free(&promising);
    free(x);
    return status;
}
