/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "refit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "dense.h"
#include "fit_own.h"
#include "fit_result.h"
#include "fit_stages.h"
#include "fit_starts.h"
#include "refit_law.h"

enum { SCAN_VALUES = 96, RANK_ITERATIONS = 8 };
static const double hopeless = 4.0;   /* times the ½χ² of the best start: not followed */
static const double reached = 1.1;    /* root mean square in noises up to which no other start is tried */
static const double at_optimum = 0.1; /* distance from the optimum, in standard errors, that counts as there */

struct refit_work {
    const struct refit_options *options;
    struct model model; /* a copy: places of new effects are free */
    size_t n_records;
    const char **names;
    struct parameter_ref *refs;
    size_t n_refs;
    struct predictor *predictor;
    struct fit_problem problem;
    struct staircase stairs;
    double *theta0; /* [n_refs] of the model */
    double *x;      /* [n_unknowns] the best so far */
    struct optimise_result found;
    bool have; /* x is one */
    size_t tried;
};

static void work_free(struct refit_work *w)
{
    fit_problem_free(&w->problem);
    predictor_free(w->predictor);
    free(w->names), free(w->refs), free(w->theta0), free(w->x);
    model_free(&w->model);
}

static enum bf_status open_model(struct refit_work *w, const struct model *model, struct bf_error *err)
{
    const enum bf_status status = model_copy(model, &w->model, err);
    for (size_t e = w->options->first_new; e < w->model.n_effects && !status; e++) {
        struct model_effect *effect = &w->model.effects[e];
        for (int i = 0; i < effect->effect->n_parameters; i++)
            if (is_position(&effect->effect->parameters[i]))
                effect->parameters[i].fixed = false;
    }
    return status;
}

static enum bf_status work_new(struct refit_work *w, const struct model *model, const struct record records[],
                               size_t n_records, const struct refit_options *options, struct bf_error *err)
{
    *w = (struct refit_work){.options = options, .n_records = n_records};
    enum bf_status status = open_model(w, model, err);
    if (status)
        return status;
    struct predict_options predict = options->predict;
    predict.threads = options->threads > 0 ? options->threads : 1;
    predict.quiet = true;
    w->names = bf_alloc(n_records, sizeof *w->names);
    for (size_t r = 0; r < n_records; r++)
        w->names[r] = record_base_name(&records[r]);
    w->n_refs = model_parameters(&w->model, w->names, n_records, &w->refs);
    status = predictor_new(&w->model, records, n_records, &predict, &w->predictor, err);
    if (!status)
        status = fit_problem_new(&w->problem, &w->model, w->predictor, records, n_records, w->names, w->refs, w->n_refs,
                                 options->sigma, err);
    if (status)
        return status;
    struct fit_problem *p = &w->problem;
    p->interrupted = options->interrupted, p->context = options->context;
    p->abandon_above = options->abandon_above;
    w->stairs = staircase_for(&w->model, records, n_records);
    w->stairs.relative = 2e-3;
    w->stairs.iterations = options->quick ? 5 : 15;
    w->stairs.rounds = options->quick ? 1 : 4;
    w->theta0 = bf_alloc(w->n_refs, sizeof *w->theta0);
    for (size_t i = 0; i < w->n_refs; i++)
        w->theta0[i] = w->refs[i].value;
    w->x = bf_alloc(p->n_unknowns, sizeof *w->x);
    return BF_OK;
}

/* ---- Starts ---- */

static bool is_new(const struct refit_work *w, size_t unknown)
{
    const struct parameter_ref *ref = &w->refs[w->problem.unknowns[unknown].ref];
    return ref->role == ROLE_EFFECT && ref->owner >= w->options->first_new;
}

/*
 * A baseline that lacks something may have driven a positive parameter to where it does nothing; its logarithm has no gradient
 * there and would stay. It begins where it changes the signals by about half the floor.
 */
static enum bf_status lift_sunken(struct refit_work *w, struct bf_error *err)
{
    static const double floor = 0.02, sunken = 0.1, lifted = 0.5, most = 1e6;
    struct fit_problem *p = &w->problem;
    double square;
    starts_to_x(p, w->theta0, w->x);
    enum bf_status status = fit_problem_stage(p, 0.0, floor, w->x, err);
    if (!status)
        status = fit_problem_evaluate(p, w->x, true, &square, err);
    for (size_t i = 0; i < p->n_unknowns && !status; i++) {
        const struct unknown *u = &p->unknowns[i];
        const enum parameter_role role = p->refs[u->ref].role;
        const double size = dense_norm(p->n_rows, p->jacobian + i * p->n_rows) / sqrt((double)p->n_rows);
        if (!u->logarithmic || role == ROLE_EFFECT || size > sunken)
            continue;
        const double factor = fmin(lifted / size, most);
        w->theta0[u->ref] *= role == ROLE_EI ? 1.0 / factor : factor;
    }
    return status;
}

/* What the linearised problem says about the amount of the new effects, before small steps creep there. */
static enum bf_status leap(struct refit_work *w, double theta[], struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
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
        if (!is_new(w, i) || u->logarithmic || !is_strength(effect_parameter(p, i)))
            continue;
        const double there = fmin(fmax(x[i] + step[i], p->lower[i]), p->upper[i]);
        if (fabs(there) > fabs(x[i]))
            theta[u->ref] = there * u->scale;
    }
    free(x), free(gradient), free(gram), free(step);
    return status;
}

/* A few steps in the window as it is. */
static enum bf_status try_start(struct refit_work *w, const double theta[], struct starts *kept, struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    double *x = bf_alloc(p->n_unknowns, sizeof *x), *moved = bf_alloc(w->n_refs, sizeof *moved);
    const struct optimise_options options = {.iterations = 4, .tolerance = 1e-2, .relative = 1e-2};
    struct optimise_result result;
    memcpy(moved, theta, w->n_refs * sizeof *moved);
    enum bf_status status = leap(w, moved, err);
    if (!status) {
        const struct least_squares view = fit_problem_view(p);
        starts_to_x(p, moved, x);
        status = optimise_local(&view, &options, x, &result, err);
    }
    if (!status) {
        fit_problem_to_theta(p, x, moved);
        starts_add(kept, moved, result.half_square);
    }
    w->tried++;
    free(x), free(moved);
    return status == BF_NUMERIC ? BF_OK : status; /* a start without a value is no start */
}

/* Ranks the model's values, the caller's starts and a grid of thresholds and places in a short window. */
static enum bf_status rank_starts(struct refit_work *w, struct starts *kept, struct bf_error *err)
{
    static const double floor = 0.02;
    struct fit_problem *p = &w->problem;
    double *theta = bf_alloc(w->n_refs, sizeof *theta), *x = bf_alloc(p->n_unknowns, sizeof *x);
    memcpy(theta, w->theta0, w->n_refs * sizeof *theta);
    starts_to_x(p, theta, x);
    phases_hold(p, x);
    struct start_grid grid = start_grid_new(p, w->options->first_new, 1, false);
    fit_problem_to_theta(p, x, theta);
    enum bf_status status = BF_OK;
    if (grid.n + w->options->n_starts <= 1) {
        starts_add(kept, theta, 0.0);
    } else {
        status = fit_problem_stage(p, w->stairs.first_ps, floor, x, err);
        for (size_t k = 0; k < w->options->n_starts && !status; k++)
            status = try_start(w, w->options->starts + k * w->n_refs, kept, err);
        for (size_t k = 0; k < grid.n && !status && !fit_problem_interrupted(p); k++) {
            start_grid_at(&grid, p, k, theta);
            status = try_start(w, theta, kept, err);
        }
    }
    start_grid_free(&grid);
    free(theta), free(x);
    return status;
}

/* The same for nonlinear effects: the caller's starts, and those of law_starts(), all after a few steps. */
static enum bf_status rank_laws(struct refit_work *w, struct starts *kept, struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    struct starts found = starts_new(w->options->quick ? 3 : 6, w->n_refs, w->refs, w->options->first_new);
    const double last_ps = 1.0 / w->stairs.longest_s;
    double scanned_ps;
    w->stairs.gentle = true;
    enum bf_status status = law_starts(p, w->options->first_new, SCAN_VALUES, 3.0 * w->stairs.first_ps, last_ps,
                                       w->theta0, &found, &scanned_ps, err);
    w->stairs.first_ps = scanned_ps;
    for (size_t k = 0; k < w->options->n_starts && !status; k++)
        status = try_start(w, w->options->starts + k * w->n_refs, kept, err);
    for (size_t k = 0; k < found.n && !status && !fit_problem_interrupted(p); k++)
        status = try_start(w, found.theta + k * w->n_refs, kept, err);
    starts_free(&found);
    return status;
}

/* Longer windows by the factor, each with fewer starts; what is left goes down the staircase from there. */
static enum bf_status rank_again(struct refit_work *w, double longer, struct starts *starts, size_t room,
                                 struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    starts_prune(starts, hopeless);
    if (starts->n <= room)
        return BF_OK;
    struct starts fewer = starts_new(room, w->n_refs, w->refs, w->options->first_new);
    double *x = bf_alloc(p->n_unknowns, sizeof *x), *theta = bf_alloc(w->n_refs, sizeof *theta);
    enum bf_status status = BF_OK;
    memcpy(theta, w->theta0, w->n_refs * sizeof *theta);
    w->stairs.first_ps /= longer;
    for (size_t k = 0; k < starts->n && !status && !fit_problem_interrupted(p); k++) {
        struct optimise_result result;
        starts_to_x(p, starts->theta + k * w->n_refs, x);
        status = staircase_step(p, w->stairs.first_ps, RANK_ITERATIONS, x, &result, err);
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

/* Down the staircase from each, until one explains the records. */
static enum bf_status descend(struct refit_work *w, const struct starts *starts, struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    double *x = bf_alloc(p->n_unknowns, sizeof *x), *best = bf_alloc(w->n_refs, sizeof *best);
    enum bf_status status = BF_OK;
    for (size_t k = 0; k < starts->n && !status; k++) {
        struct optimise_result found;
        starts_to_x(p, starts->theta + k * w->n_refs, x);
        status = staircase_run(p, &w->stairs, NULL, x, &found, err);
        if (status == BF_NUMERIC && k + 1 < starts->n) {
            status = BF_OK;
            continue;
        }
        if (!status && (!w->have || found.half_square < w->found.half_square)) {
            memcpy(best, w->theta0, w->n_refs * sizeof *best);
            fit_problem_to_theta(p, x, best);
            w->found = found, w->have = true;
        }
        if (fit_problem_interrupted(p) || 2.0 * w->found.half_square <= reached * reached * (double)p->n_rows)
            break;
    }
    if (w->have)
        starts_to_x(p, best, w->x);
    free(x), free(best);
    return w->have ? BF_OK : status;
}

/* ---- The answer ---- */

static void fill_channels(const struct refit_work *w, struct refit_result *out)
{
    const struct fit_problem *p = &w->problem;
    double ratio = 0.0;
    out->n_rows = p->n_rows, out->n_channels = p->n_channels;
    out->residual = bf_alloc(p->n_rows, sizeof *out->residual);
    out->channels = bf_alloc(p->n_channels, sizeof *out->channels);
    memcpy(out->channels, p->channels, p->n_channels * sizeof *out->channels);
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        double *r = out->residual + channel->row;
        for (size_t k = 0; k < channel->n; k++)
            r[k] = channel->measured[k] - p->fitted[channel->row + k];
        ratio += dense_dot(channel->n, r, r) / (double)channel->n / (p->sigma[c] * p->sigma[c]);
    }
    out->noise_ratio = sqrt(ratio / (double)p->n_channels);
    out->chi2_per_row = fit_problem_mean_square(p);
}

static void fill_values(const struct refit_work *w, struct refit_result *out)
{
    const struct fit_problem *p = &w->problem;
    const size_t n = w->n_refs;
    out->n_parameters = n, out->n_records = w->n_records, out->n_starts = w->tried;
    out->value = bf_alloc(n, sizeof *out->value), out->sd = bf_alloc(n, sizeof *out->sd);
    out->estimated = bf_alloc(n, sizeof *out->estimated), out->at_bound = bf_alloc(n, sizeof *out->at_bound);
    out->level = bf_alloc(w->n_records, sizeof *out->level);
    memcpy(out->level, p->levels, w->n_records * sizeof *out->level);
    memcpy(out->value, w->theta0, n * sizeof *out->value);
    fit_problem_to_theta(p, w->x, out->value);
    for (size_t i = 0; i < n; i++)
        out->sd[i] = nan("");
    for (size_t i = 0; i < p->n_unknowns; i++) {
        out->estimated[p->unknowns[i].ref] = !p->held[i];
        out->n_unknowns += !p->held[i];
    }
}

static enum bf_status fill_errors(const struct refit_work *w, struct refit_result *out, struct bf_error *err)
{
    struct fit_result statistics = {0};
    const enum bf_status status = fit_statistics(&w->problem, &w->model, w->x, &statistics, err);
    for (size_t i = 0; i < w->n_refs && !status; i++) {
        out->at_bound[i] = statistics.parameters[i].at_bound;
        if (out->estimated[i])
            out->sd[i] = statistics.parameters[i].sd;
    }
    fit_free(&statistics);
    return status;
}

static enum bf_status finish(struct refit_work *w, struct refit_result *out, struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    double square;
    enum bf_status status = BF_OK;
    if (p->decay_ps != 0.0 || p->floor != 0.0)
        status = fit_problem_stage(p, 0.0, 0.0, w->x, err);
    if (!status)
        status = fit_problem_evaluate(p, w->x, !w->options->quick, &square, err);
    if (status)
        return status;
    fill_channels(w, out);
    fill_values(w, out);
    out->half_square = w->found.half_square;
    out->distance = sqrt(2.0 * w->found.decrement / fmax(1.0, out->chi2_per_row));
    out->interrupted = fit_problem_interrupted(p);
    out->abandoned = w->found.end == OPTIMISE_HOPELESS;
    out->converged = !out->interrupted && w->found.end == OPTIMISE_CONVERGED && out->distance < at_optimum;
    return w->options->quick ? BF_OK : fill_errors(w, out, err);
}

static enum bf_status search(struct refit_work *w, struct bf_error *err)
{
    const bool quick = w->options->quick, law = law_is_new(&w->problem, w->options->first_new);
    struct starts starts = starts_new(quick ? 3 : 6, w->n_refs, w->refs, w->options->first_new);
    enum bf_status status = law ? BF_OK : lift_sunken(w, err);
    if (!status)
        status = law ? rank_laws(w, &starts, err) : rank_starts(w, &starts, err);
    if (!status && law)
        status = rank_again(w, 3.0, &starts, quick ? 2 : 4, err);
    if (!status)
        status = rank_again(w, law ? 3.0 : 10.0, &starts, quick ? 1 : 2, err);
    if (!status)
        status = descend(w, &starts, err);
    starts_free(&starts);
    return status;
}

enum bf_status refit_run(const struct model *model, const struct record records[], size_t n_records,
                         const struct refit_options *options, struct refit_result *out, struct bf_error *err)
{
    struct timespec begin, end;
    struct refit_work w;
    *out = (struct refit_result){0};
    clock_gettime(CLOCK_MONOTONIC, &begin);
    enum bf_status status = work_new(&w, model, records, n_records, options, err);
    if (!status)
        status = search(&w, err);
    if (!status)
        status = finish(&w, out, err);
    out->evaluations = w.problem.runs;
    work_free(&w);
    clock_gettime(CLOCK_MONOTONIC, &end);
    out->seconds = (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    if (status)
        refit_free(out);
    return status;
}

void refit_free(struct refit_result *result)
{
    free(result->value), free(result->sd), free(result->estimated), free(result->at_bound), free(result->level);
    free(result->residual), free(result->channels);
    *result = (struct refit_result){0};
}

enum bf_status refit_check(const struct model *model, const struct record records[], size_t n_records,
                           const double sigma[], const struct predict_options *predict, double *chi2_per_row,
                           double *noise_ratio, struct bf_error *err)
{
    struct fit_options options = {.quiet = true};
    struct own_values own;
    struct fit_channel_error *channels = NULL;
    size_t n = 0;
    if (predict)
        options.predict = *predict;
    options.predict.quiet = true;
    enum bf_status status = own_values_find(model, records, n_records, &options, &own, err);
    options.sigma = sigma;
    if (!status)
        status = fit_errors(own.model, records, n_records, &options, &channels, &n, err);
    double square = 0.0, rows = 0.0, error;
    for (size_t c = 0; c < n; c++) {
        square += (double)channels[c].n * channels[c].noise_ratio * channels[c].noise_ratio;
        rows += (double)channels[c].n;
    }
    *chi2_per_row = rows > 0.0 ? square / rows : 0.0;
    fit_totals(channels, n, &error, noise_ratio);
    free(channels);
    own_values_free(&own);
    return status;
}
