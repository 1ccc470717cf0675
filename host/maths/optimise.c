/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The only file that sees NLopt; the Gauss–Newton search stands in optimise_local.c. */
#include "maths.h"

#include <math.h>
#include <nlopt.h>
#include <stdlib.h>
#include <string.h>

/* Directions with a smaller share of the largest eigenvalue of JᵀJ are not searched. */
static const double least_share = 1e-13;

static bool interrupted(const struct least_squares *problem)
{
    return problem->interrupted && problem->interrupted(problem->context);
}

struct nlopt_view {
    const struct least_squares *problem;
    struct bf_error *err;
    const double *center; /* whitened unknowns: x = center + T u; NULL: x = u */
    const double *T;      /* [n × m] */
    size_t m;
    double *x, *gradient, *gram, *best_x;
    double best;
    nlopt_opt handle;
};

static double nlopt_value(unsigned m, const double u[], double grad[], void *data)
{
    struct nlopt_view *v = data;
    const struct least_squares *problem = v->problem;
    const size_t n = problem->n;
    if (interrupted(problem))
        nlopt_force_stop(v->handle);
    if (v->center) {
        memcpy(v->x, v->center, n * sizeof *v->x);
        dense_gemv(false, n, m, 1.0, v->T, u, 1.0, v->x);
    } else {
        memcpy(v->x, u, n * sizeof *v->x);
    }
    double value = INFINITY;
    const enum bf_status status =
        grad ? problem->derivative(problem->context, v->x, &value, v->gradient, v->gram, v->err)
             : problem->value(problem->context, v->x, &value, v->err);
    if (status || !isfinite(value)) {
        if (grad)
            memset(grad, 0, m * sizeof *grad);
        return 1e300;
    }
    if (value < v->best) {
        v->best = value;
        memcpy(v->best_x, v->x, n * sizeof *v->x);
    }
    if (grad && v->center)
        dense_gemv(true, n, m, 1.0, v->T, v->gradient, 0.0, grad);
    else if (grad)
        memcpy(grad, v->gradient, n * sizeof *grad);
    return value;
}

static struct nlopt_view view_new(const struct least_squares *problem, const double x[], struct bf_error *err)
{
    const size_t n = problem->n;
    struct nlopt_view v = {.problem = problem, .err = err, .best = INFINITY};
    v.x = bf_alloc(n, sizeof(double)), v.gradient = bf_alloc(n, sizeof(double));
    v.gram = bf_alloc(n * n, sizeof(double)), v.best_x = bf_alloc(n, sizeof(double));
    memcpy(v.best_x, x, n * sizeof(double));
    return v;
}

static void view_free(struct nlopt_view *v)
{
    free(v->x), free(v->gradient), free(v->gram), free(v->best_x);
    nlopt_destroy(v->handle);
}

/* T = V d^(−½) over the directions that the data determine and the unknowns that no bound holds. */
static enum bf_status whitening(const struct least_squares *problem, const double x[], const double gradient[],
                                const double gram[], double T[], size_t *m, struct bf_error *err)
{
    const size_t n = problem->n;
    double *H = bf_alloc(n * n, sizeof *H), *values = bf_alloc(n, sizeof *values), *V = bf_alloc(n * n, sizeof *V);
    memcpy(H, gram, n * n * sizeof *H);
    for (size_t i = 0; i < n; i++) {
        const bool at_lower = problem->lower && x[i] <= problem->lower[i] && gradient[i] > 0.0;
        const bool at_upper = problem->upper && x[i] >= problem->upper[i] && gradient[i] < 0.0;
        for (size_t j = 0; j < n && (at_lower || at_upper); j++)
            H[i + j * n] = H[j + i * n] = 0.0;
    }
    const enum bf_status status = dense_symmetric_eigen(n, H, NULL, values, V, err);
    *m = 0;
    for (size_t j = 0; j < n && !status; j++) {
        if (values[j] <= least_share * values[n - 1] || values[j] <= 0.0)
            continue;
        for (size_t i = 0; i < n; i++)
            T[i + *m * n] = V[i + j * n] / sqrt(values[j]);
        (*m)++;
    }
    free(H), free(values), free(V);
    return status;
}

static bool inside(const struct least_squares *problem, const double x[])
{
    for (size_t i = 0; i < problem->n; i++)
        if ((problem->lower && x[i] < problem->lower[i]) || (problem->upper && x[i] > problem->upper[i]))
            return false;
    return true;
}

enum bf_status optimise_polish(const struct least_squares *problem, int evaluations, double x[], double *gain,
                               struct bf_error *err)
{
    const size_t n = problem->n;
    *gain = 0.0;
    if (n == 0)
        return BF_OK;
    struct nlopt_view v = view_new(problem, x, err);
    double *T = bf_alloc(n * n, sizeof *T), *u = bf_alloc(n, sizeof *u), start;
    memset(u, 0, n * sizeof *u);
    enum bf_status status = problem->derivative(problem->context, x, &start, v.gradient, v.gram, err);
    if (!status)
        status = whitening(problem, x, v.gradient, v.gram, T, &v.m, err);
    if (!status && v.m > 0) {
        v.center = x, v.T = T;
        v.handle = nlopt_create(NLOPT_LD_SLSQP, (unsigned)v.m);
        nlopt_set_min_objective(v.handle, nlopt_value, &v);
        nlopt_set_maxeval(v.handle, evaluations);
        nlopt_set_ftol_abs(v.handle, 1e-9 * fmax(1.0, start));
        nlopt_set_xtol_abs1(v.handle, 1e-4); /* in standard errors */
        double value = start;
        nlopt_optimize(v.handle, u, &value); /* its return code says how it stopped; the best point seen counts */
        if (v.best < start && inside(problem, v.best_x)) {
            *gain = start - v.best;
            memcpy(x, v.best_x, n * sizeof *x);
        }
    }
    view_free(&v);
    free(T), free(u);
    return status;
}

enum bf_status optimise_global(const struct least_squares *problem, enum optimise_search search, int evaluations,
                               double x[], double *half_square, struct bf_error *err)
{
    const size_t n = problem->n;
    for (size_t i = 0; i < n; i++)
        if (!problem->lower || !problem->upper || !isfinite(problem->lower[i]) || !isfinite(problem->upper[i]))
            return bf_fail(err, BF_USAGE, "a search over a box needs finite bounds for every unknown");
    struct nlopt_view v = view_new(problem, x, err);
    const nlopt_algorithm algorithm = search == OPTIMISE_CRS      ? NLOPT_GN_CRS2_LM
                                      : search == OPTIMISE_DIRECT ? NLOPT_GN_DIRECT_L
                                                                  : NLOPT_GD_MLSL_LDS;
    v.handle = nlopt_create(algorithm, (unsigned)n);
    nlopt_srand(1);
    nlopt_set_min_objective(v.handle, nlopt_value, &v);
    nlopt_set_lower_bounds(v.handle, problem->lower);
    nlopt_set_upper_bounds(v.handle, problem->upper);
    nlopt_set_maxeval(v.handle, evaluations);
    if (search == OPTIMISE_MLSL) {
        nlopt_opt local = nlopt_create(NLOPT_LD_LBFGS, (unsigned)n);
        nlopt_set_ftol_rel(local, 1e-4);
        nlopt_set_maxeval(local, 40);
        nlopt_set_local_optimizer(v.handle, local);
        nlopt_destroy(local);
    }
    double *u = bf_alloc(n, sizeof *u), value;
    for (size_t i = 0; i < n; i++)
        u[i] = fmin(fmax(x[i], problem->lower[i]), problem->upper[i]);
    nlopt_optimize(v.handle, u, &value);
    const bool found = isfinite(v.best);
    if (found) {
        memcpy(x, v.best_x, n * sizeof *x);
        *half_square = v.best;
    }
    view_free(&v);
    free(u);
    return found ? BF_OK : bf_fail(err, BF_NUMERIC, "the search found no point with a finite sum of squares");
}
