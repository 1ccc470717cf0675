/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "maths/maths.h"
#include "fit_best.h"
#include "fit_law.h"
#include "fit_once.h"
#include "fit_result.h"
#include "fit_search.h"
#include "fit_stages.h"
#include "fit_starts.h"
#include "fit_work.h"
#include "noise/noise.h"
#include "ground/ground.h"
#include "refit_horizon.h"
#include "refit_law.h"
#include "refit_search.h"

static const double reached = 1.1;    /* noise_ratio below which no search follows the staircase */
static const double at_optimum = 0.1; /* distance from the optimum, in standard errors, that counts as there */
enum { SEARCH_MINIMA = 8 };           /* that a search keeps */

/* ---- Errors per channel ---- */

static double total_noise_ratio(const struct fit_work *w)
{
    double error, ratio;
    size_t n;
    struct fit_channel_error *errors = fit_channel_errors(&w->problem, w->noise, &n);
    fit_totals(errors, n, &error, &ratio);
    free(errors);
    return ratio;
}

/* Leaves out the rows that no model can predict. */
static enum bf_status leave_out_unpredictable(struct fit_work *w, const struct fit_options *options,
                                              struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    double *theta = bf_alloc(w->n_refs, sizeof *theta);
    bool any;
    for (size_t i = 0; i < w->n_refs; i++)
        theta[i] = w->refs[i].value;
    enum bf_status status = horizon_find(p, &options->predict, theta, &any, err);
    starts_to_x(p, theta, w->x);
    if (!status && any)
        status = fit_problem_stage(p, 0.0, 0.0, w->x, err);
    free(theta);
    return status;
}

enum bf_status fit_errors(const struct model *model, const struct record records[], size_t n_records,
                          const struct fit_options *options, struct fit_channel_error **channels, size_t *n_channels,
                          struct bf_error *err)
{
    struct fit_work w;
    *channels = NULL, *n_channels = 0;
    if (n_records == 0)
        return BF_OK;
    enum bf_status status = fit_work_new(&w, model, records, n_records, options, err);
    double square;
    if (!status)
        status = fit_problem_stage(&w.problem, 0.0, 0.0, w.x, err);
    if (!status && model_has_law(model))
        status = leave_out_unpredictable(&w, options, err);
    if (!status)
        status = fit_problem_evaluate(&w.problem, w.x, false, &square, err);
    if (!status) {
        *channels = fit_channel_errors(&w.problem, w.noise, n_channels);
    }
    fit_work_free(&w);
    return status;
}

/* ---- The fit ---- */

/* Other minima, once the chosen one is known; their noise ratios come from χ² over rows. */
static void keep_minima(const struct fit_work *w, const struct minima *minima, double best, struct fit_result *out)
{
    const struct fit_problem *p = &w->problem;
    out->minima = bf_alloc(minima->n, sizeof *out->minima);
    for (size_t k = 0; k < minima->n; k++) {
        if (minima->half_square[k] <= best + fmax(1.0, 0.01 * best))
            continue;
        struct fit_minimum *m = &out->minima[out->n_minima++];
        m->noise_ratio = sqrt(2.0 * minima->half_square[k] / (double)p->n_rows);
        m->value = bf_alloc(p->n_refs, sizeof *m->value);
        memcpy(m->value, minima->theta + k * p->n_refs, p->n_refs * sizeof *m->value);
    }
}

/* Whole records at once from the given values: where the shortest window leads astray they may be near enough. */
static enum bf_status add_nearest(struct fit_problem *p, const struct staircase *stairs, const double start[],
                                  struct minima *minima, struct bf_error *err)
{
    struct optimise_result end;
    double *x = bf_alloc(p->n_unknowns, sizeof *x);
    fit_problem_to_x(p, start, x);
    const enum bf_status status = staircase_last(p, stairs, x, &end, err);
    if (!status) {
        double *theta = tried_theta(p, x);
        minima_add(minima, p, theta, end.half_square);
        free(theta);
    }
    free(x);
    return status == BF_NUMERIC ? BF_OK : status;
}

static enum bf_status search(struct fit_work *w, const struct staircase *stairs, struct progress *bar,
                             struct optimise_result *best, struct fit_result *out, struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    struct minima minima = minima_new(SEARCH_MINIMA, p);
    double *theta = tried_theta(p, w->x);
    minima_add(&minima, p, theta, best->half_square);
    for (size_t i = 0; i < p->n_refs; i++)
        theta[i] = w->refs[i].value;
    out->searched = true;
    enum bf_status status = search_run(p, w->model, stairs, bar, theta, &minima, err);
    if (!status && !progress_interrupted())
        status = add_nearest(p, stairs, theta, &minima, err);
    if (!status) {
        fit_problem_to_x(p, minima.theta, w->x);
        const double lowest = minima.half_square[0];
        if (!progress_interrupted())
            status = staircase_last(p, stairs, w->x, best, err);
        else
            status = fit_problem_stage(p, 0.0, 0.0, w->x, err);
        keep_minima(w, &minima, lowest, out);
    }
    minima_free(&minima);
    free(theta);
    return status;
}

/* Stationarity, told by the gradient and by a method that shares nothing with the search. */
static enum bf_status verify(struct fit_work *w, const struct optimise_result *found, struct fit_result *out,
                             struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    double square;
    enum bf_status status = BF_OK;
    if (!fit_problem_interrupted(p) && p->n_unknowns > 0)
        status = best_polish(p, w->x, found->half_square, &out->polish_gain, err);
    if (!status)
        status = fit_problem_evaluate(p, w->x, true, &square, err);
    if (status)
        return status;
    const double spread = fit_problem_spread(p);
    const double remaining = fmax(found->decrement - out->polish_gain, 0.0);
    out->distance = sqrt(2.0 * fmax(remaining, out->polish_gain) / spread);
    out->converged = !out->interrupted && found->end == OPTIMISE_CONVERGED && out->distance < at_optimum;
    return BF_OK;
}

/* A nonlinear effect needs starts of its own, see refit_search.h. */
static enum bf_status descend_to_law(struct fit_work *w, const struct fit_options *options,
                                     const struct staircase *stairs, struct progress *bar, double theta[],
                                     struct optimise_result *found, struct bf_error *err)
{
    struct refit_search search = {
        .p = &w->problem, .stairs = *stairs, .theta0 = theta, .predict = options->predict, .bar = bar};
    double *baseline = bf_alloc(w->n_refs, sizeof *baseline);
    bool possible;
    enum bf_status status = fit_without_law(&w->problem, &options->predict, theta, baseline, &possible, err);
    search.baseline = possible ? baseline : NULL;
    if (!status)
        status = refit_search_run(&search, w->x, found, err);
    free(baseline);
    return status;
}

static enum bf_status first_descent(struct fit_work *w, const struct fit_options *options,
                                    const struct staircase *stairs, struct progress *bar, struct optimise_result *found,
                                    struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    if (options->start == FIT_NEAR) {
        fit_problem_release(p);
        return staircase_last(p, stairs, w->x, found, err);
    }
    double *theta = bf_alloc(w->n_refs, sizeof *theta);
    for (size_t i = 0; i < w->n_refs; i++)
        theta[i] = w->refs[i].value;
    enum bf_status status = BF_OK;
    if (law_is_new(p, 0)) {
        status = descend_to_law(w, options, stairs, bar, theta, found, err);
    } else {
        if (p->predictor != NULL) /* what a list does not tell stays where it is */
            status = starts_restore_vanished(p, theta, err);
        starts_to_x(p, theta, w->x);
        if (!status)
            status = staircase_run(p, stairs, bar, w->x, found, err);
        if (status ==
            BF_NUMERIC) { /* a window has led where nothing can be computed (a patch 1e5 times as stiff as the beam) */
            starts_to_x(p, theta, w->x);
            status = staircase_last(p, stairs, w->x, found, err);
        }
    }
    free(theta);
    return status;
}

/* The file's bounds alone from here on: what lies on another one goes on beyond it. */
static enum bf_status go_beyond(struct fit_work *w, const struct staircase *stairs, struct optimise_result *found,
                                struct bf_error *err)
{
    const bool presses = fit_problem_presses(&w->problem, w->x);
    fit_problem_release(&w->problem);
    return presses && !progress_interrupted() ? staircase_last(&w->problem, stairs, w->x, found, err) : BF_OK;
}

/*
 * The first descent and the search, where it is wanted. tried: the start, which is known on whole records; the ends of windows, which
 * are looked at where the noise is missed.
 */
static enum bf_status descend(struct fit_work *w, const struct fit_options *options, struct progress *bar,
                              struct tried *tried, struct optimise_result *found, struct fit_result *out,
                              struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    struct staircase stairs = staircase_for(w->model, w->records, w->n_sampled);
    stairs.tried = tried;
    enum bf_status status = first_descent(w, options, &stairs, bar, found, err);
    if (status)
        return status;
    if (found->end == OPTIMISE_INTERRUPTED)
        status = fit_problem_stage(p, 0.0, 0.0, w->x, err);
    double square;
    if (!status)
        status = fit_problem_evaluate(p, w->x, false, &square, err);
    const bool missed = !status && total_noise_ratio(w) > reached;
    const bool wanted =
        options->start == FIT_SEARCH ||
        (missed && options->start == FIT_GIVEN && !options->never_search && !law_is_new(p, 0) && w->n_sampled > 0);
    if (!status && wanted && p->n_unknowns > 0 && !progress_interrupted())
        status = search(w, &stairs, bar, found, out, err);
    stairs.tried = NULL;
    if (!status)
        status = go_beyond(w, &stairs, found, err);
    if (!status && missed && p->predictor != NULL && !progress_interrupted())
        status = best_raise_vanished(p, &stairs, w->x, found, err);
    if (!missed)
        tried->n = 1;
    if (p->n_used < p->n_rows) /* other rows than those that the start was judged by */
        tried->half_square[0] = nan("");
    if (!status && !progress_interrupted())
        status = best_of_tried(tried, p, &stairs, w->x, found, err);
    out->interrupted = progress_interrupted();
    return status;
}

static enum bf_status estimate(struct fit_work *w, const struct fit_options *options, struct progress *bar,
                               struct fit_result *out, struct bf_error *err)
{
    struct optimise_result found;
    struct tried tried = {0};
    double *theta = bf_alloc(w->n_refs, sizeof *theta);
    for (size_t i = 0; i < w->n_refs; i++)
        theta[i] = w->refs[i].value;
    tried_add(&tried, &w->problem, theta);
    enum bf_status status = tried_value(&tried, &w->problem, err);
    if (!status)
        status = descend(w, options, bar, &tried, &found, out, err);
    tried_free(&tried);
    free(theta);
    return status ? status : verify(w, &found, out, err);
}

/* Steps that the laws need at the values found. */
static enum bf_status steps_at_end(const struct fit_work *w, const struct fit_options *options,
                                   const struct fit_result *out, int *steps, struct bf_error *err)
{
    struct fit_options how = *options;
    double *theta = bf_alloc(w->n_refs + 1, sizeof *theta);
    how.sigma = w->sigma;
    for (size_t i = 0; i < w->n_refs; i++)
        theta[i] = out->parameters[i].value;
    const enum bf_status status =
        fit_steps(w->model, w->records, w->n_records, &how, theta, w->problem.horizon_s, steps, err);
    free(theta);
    return status == BF_NUMERIC ? BF_OK : status;
}

enum bf_status fit_once(const struct model *model, const struct record records[], size_t n_records,
                        const struct fit_options *options, struct fit_result *out, int *finer, struct bf_error *err)
{
    struct timespec begin, end;
    *out = (struct fit_result){0};
    clock_gettime(CLOCK_MONOTONIC, &begin);
    struct fit_work w;
    struct progress *bar = options->quiet ? NULL : progress_begin("fit");
    enum bf_status status = fit_work_new(&w, model, records, n_records, options, err);
    if (!status)
        status = estimate(&w, options, bar, out, err);
    if (!status) {
        out->channels = fit_channel_errors(&w.problem, w.noise, &out->n_channels);
        fit_totals(out->channels, out->n_channels, &out->nrmse, &out->noise_ratio);
        out->noise_doubt = w.noise_doubt;
        out->intersample = options->predict.intersample;
        status = fit_statistics(&w.problem, model, w.x, out, err);
    }
    *finer = 0;
    if (!status && !out->interrupted)
        status = steps_at_end(&w, options, out, finer, err);
    if (bar)
        progress_end(bar);
    out->evaluations = w.problem.runs;
    fit_work_free(&w);
    clock_gettime(CLOCK_MONOTONIC, &end);
    out->seconds = (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    if (status)
        fit_free(out);
    return status;
}
