/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One evaluation of a predictor. */
#include "predictor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static enum bf_status finish_channels(const struct run *run, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < run->p->n_channels; c++)
        status = channel_samples(run, &run->p->channels[c], err);
    for (size_t i = 0; status == BF_OK && i < run->p->n_rows; i++)
        if (!isfinite(run->p->y[i]))
            status = bf_fail(err, BF_NUMERIC,
                             "the model grows without bound at these parameters (negative damping or "
                             "an unstable effect)");
    return status;
}

/* After the system's evaluation. */
static void find_structural(const struct run *run)
{
    struct predictor *p = run->p;
    for (size_t j = 0; j < p->map.n; j++)
        p->structural[j] = run_wants(run, j) && (p->system->derivative[j].Z != NULL || p->moves[j]);
}

/* The system and what reaches it. */
static enum bf_status run_system(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    kernels_free(p);
    enum bf_status status = geometry_evaluate(run, err);
    if (status == BF_OK)
        status = system_evaluate(p->system, run->theta, run->want, err);
    if (status == BF_OK)
        status = drives_evaluate(run, err);
    if (status != BF_OK)
        return status;
    find_structural(run);
    kernels_new(p);
    functionals_evaluate(p->system, run_structure(run), p->inputs, p->n_sources);
    functionals_evaluate(p->system, run_structure(run), p->outputs, p->model.n_outputs);
    if (p->base_load != NULL)
        functionals_evaluate(p->system, run_structure(run), p->base_load, 1);
    states_find(p);
    return BF_OK;
}

static enum bf_status run_once(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    states_clear(p);
    enum bf_status status = run_system(run, err);
    if (status == BF_OK)
        status = predict_linear(run, err);
    if (status == BF_OK)
        status = predict_base(run, err);
    for (size_t r = 0; status == BF_OK && r < p->n_records; r++)
        if (p->plans[r].free_state)
            status = predict_decay(run, r, err);
    if (status == BF_OK && p->nonlinear)
        status = predict_laws(run, err);
    if (status == BF_OK)
        status = finish_channels(run, err);
    return status;
}

static bool by_clock(const struct run *run, size_t parameter)
{
    double by = run->p->geometry.clock_by[parameter];
    return run_wants(run, parameter) && (by < 0.0 || by > 0.0);
}

/* dy by one parameter of the clock: differences of order four, over 0.02 rad at the Nyquist frequency of the last sample. */
static enum bf_status difference_clock(const struct run *run, size_t parameter, double column[], struct bf_error *err)
{
    const double at[4] = {-2.0, -1.0, 1.0, 2.0}, weight[4] = {1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0};
    struct predictor *p = run->p;
    size_t longest = 1;
    for (size_t r = 0; r < p->n_records; r++)
        longest = p->plans[r].n > longest ? p->plans[r].n : longest;
    double h = 0.02 / (acos(-1.0) * (double)longest) / fabs(p->geometry.clock_by[parameter]);
    double *theta = bf_alloc(p->map.n, sizeof *theta);
    struct run moved = {.p = p, .theta = theta, .out = run->out};
    enum bf_status status = BF_OK;
    memcpy(theta, run->theta, p->map.n * sizeof *theta);
    for (int i = 0; status == BF_OK && i < 4; i++) {
        theta[parameter] = run->theta[parameter] + at[i] * h;
        status = run_once(&moved, err);
        for (size_t k = 0; status == BF_OK && k < p->n_rows; k++)
            column[k] += weight[i] / h * p->y[k];
    }
    free(theta);
    return status;
}

/* Laws have no derivative by the clock of their own: those columns are differences of whole runs. */
static enum bf_status run_with_clock(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    bool *analytic = bf_alloc(p->map.n, sizeof *analytic);
    double *columns = bf_alloc(p->map.n * p->n_rows, sizeof *columns);
    enum bf_status status = BF_OK;
    for (size_t j = 0; j < p->map.n; j++) {
        analytic[j] = run_wants(run, j) && !by_clock(run, j);
        if (status == BF_OK && by_clock(run, j))
            status = difference_clock(run, j, columns + j * p->n_rows, err);
    }
    struct run rest = *run;
    rest.want = analytic;
    if (status == BF_OK)
        status = run_once(&rest, err);
    for (size_t j = 0; status == BF_OK && j < p->map.n; j++)
        if (by_clock(run, j))
            memcpy(p->jacobian + j * p->n_rows, columns + j * p->n_rows, p->n_rows * sizeof *columns);
    free(analytic);
    free(columns);
    return status;
}

/* Nothing predicted yet; BF_NUMERIC where the last base failed. */
static enum bf_status begin(struct predictor *p, bool with_jacobian, const bool want[], struct prediction *out,
                            struct bf_error *err)
{
    single_room(p, with_jacobian);
    *out = (struct prediction){.n_rows = p->n_rows,
                               .n_parameters = p->map.n,
                               .n_nuisance = p->n_nuisance,
                               .y = p->y,
                               .nuisance = p->nuisance,
                               .first_state = p->first_state,
                               .amplitude = p->amplitude,
                               .bends = p->system != NULL && states_bend(p)};
    if (p->system == NULL)
        return bf_fail(err, BF_NUMERIC, "the model could not be evaluated at its last base; rebase it first");
    if (with_jacobian) {
        out->jacobian = p->jacobian;
        for (size_t j = 0; j < p->map.n; j++)
            if (p->whole == 0 || want == NULL ||
                want[j]) /* of a piece nobody reads the others, and they take no memory */
                memset(p->jacobian + j * p->n_rows, 0, p->n_rows * sizeof *p->jacobian);
    }
    return BF_OK;
}

enum bf_status single_run_system(struct predictor *p, const double theta[], bool with_jacobian, struct prediction *out,
                                 struct bf_error *err)
{
    const struct run run = {.p = p, .theta = theta, .out = out};
    const enum bf_status status = begin(p, with_jacobian, NULL, out, err);
    return status == BF_OK ? run_system(&run, err) : status;
}

enum bf_status single_run(struct predictor *p, const double parameters[], const bool want_jacobian[],
                          struct prediction *out, struct bf_error *err)
{
    const struct run run = {.p = p, .theta = parameters, .want = want_jacobian, .out = out};
    enum bf_status status = begin(p, want_jacobian != NULL, want_jacobian, out, err);
    if (status != BF_OK)
        return status;
    bool differences = false;
    for (size_t j = 0; p->nonlinear && j < p->map.n; j++)
        differences = differences || by_clock(&run, j);
    status = differences ? run_with_clock(&run, err) : run_once(&run, err);
    if (status == BF_OK && states_bend(p))
        states_take_out(&run);
    return status;
}
