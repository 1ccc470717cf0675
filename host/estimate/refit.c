/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "maths/maths.h"
#include "fit_result.h"
#include "fit_starts.h"
#include "refit_search.h"

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
    struct refit_search search;
    double *theta0; /* [n_refs] of the model */
    double *x;      /* [n_unknowns] the best so far */
    struct optimise_result found;
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
    w->names = record_base_names(records, n_records);
    w->n_refs = model_parameters(&w->model, w->names, n_records, &w->refs);
    status = predictor_new(&w->model, records, n_records, &predict, &w->predictor, err);
    if (!status)
        status = fit_problem_new(&w->problem, &w->model, w->predictor, records, n_records, w->names, w->refs, w->n_refs,
                                 options->sigma, err);
    if (status)
        return status;
    struct fit_problem *p = &w->problem;
    p->interrupted = options->interrupted, p->context = options->context;
    p->abandon_above = options->abandon_above, p->most_runs = options->most_runs;
    w->theta0 = bf_alloc(w->n_refs, sizeof *w->theta0);
    for (size_t i = 0; i < w->n_refs; i++)
        w->theta0[i] = w->refs[i].value;
    w->x = bf_alloc(p->n_unknowns, sizeof *w->x);
    if (options->near)
        fit_problem_release(p);
    w->search = (struct refit_search){.p = p,
                                      .stairs = staircase_for(&w->model, records, n_records),
                                      .first_effect = options->first_new,
                                      .baseline = w->theta0,
                                      .quick = options->quick,
                                      .near = options->near,
                                      .predict = predict,
                                      .theta0 = w->theta0,
                                      .raise_below = options->raise_below,
                                      .n_starts = options->n_starts,
                                      .starts = options->starts};
    w->search.stairs.nats = 2e-3;
    w->search.stairs.iterations = options->quick ? 5 : 15;
    w->search.stairs.rounds = options->quick ? 1 : 4;
    return BF_OK;
}

/* What the records tell too badly keeps its value, unless that is everything. */
static enum bf_status hold_weak(struct refit_work *w, struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    struct fit_result statistics = {0};
    bool *weak = bf_alloc(p->n_unknowns, sizeof *weak);
    size_t n_weak = 0;
    double square;
    starts_to_x(p, w->theta0, w->x);
    enum bf_status status = fit_problem_stage(p, 0.0, 0.0, w->x, err);
    if (!status)
        status = fit_problem_evaluate(p, w->x, true, &square, err);
    if (!status)
        status = fit_statistics(p, &w->model, w->x, &statistics, err);
    for (size_t i = 0; i < p->n_unknowns && !status; i++) {
        const size_t r = p->unknowns[i].ref;
        const double here = statistics.parameters[r].sd;
        weak[i] = isnan(here) || here > REFIT_WEAK * w->options->known_sd[r];
        n_weak += weak[i];
    }
    for (size_t i = 0; i < p->n_unknowns && !status && n_weak < p->n_unknowns; i++)
        fit_problem_hold(p, i, weak[i]);
    fit_free(&statistics);
    free(weak);
    return status == BF_NUMERIC ? BF_OK : status; /* derivatives without sense say nothing about errors */
}

/* ---- The answer ---- */

static void fill_channels(const struct refit_work *w, struct refit_result *out)
{
    const struct fit_problem *p = &w->problem;
    double ratio = 0.0, channels = 0.0;
    out->n_rows = p->n_rows, out->n_used = p->n_used, out->n_channels = p->n_channels;
    out->residual = bf_alloc(p->n_rows, sizeof *out->residual);
    out->channels = bf_alloc(p->n_channels, sizeof *out->channels);
    out->horizon_s = bf_alloc(w->n_records, sizeof *out->horizon_s);
    memcpy(out->horizon_s, p->horizon_s, w->n_records * sizeof *out->horizon_s);
    memcpy(out->channels, p->channels, p->n_channels * sizeof *out->channels);
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        double square = 0.0, rows = 0.0;
        for (size_t k = channel->row; k < channel->row + channel->n; k++) {
            out->residual[k] = channel->measured[k - channel->row] - p->fitted[k];
            square += p->weight[k] > 0.0 ? out->residual[k] * out->residual[k] : 0.0;
            rows += p->weight[k] > 0.0;
        }
        ratio += rows > 0.0 ? square / rows / (p->sigma[c] * p->sigma[c]) : 0.0;
        channels += rows > 0.0;
    }
    out->noise_ratio = channels > 0.0 ? sqrt(ratio / channels) : 0.0;
    out->chi2_per_row = fit_problem_mean_square(p);
}

static void fill_values(const struct refit_work *w, struct refit_result *out)
{
    const struct fit_problem *p = &w->problem;
    const size_t n = w->n_refs;
    out->n_parameters = n, out->n_records = w->n_records, out->n_starts = w->search.tried;
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

/* Thresholds and places of an effect that is not there are not known, whatever the linearised problem says. */
static void forget_inner(const struct refit_work *w, size_t effect, struct refit_result *out)
{
    static const double significant = 2.0;
    const struct fit_problem *p = &w->problem;
    bool there = false;
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < p->n_unknowns; i++) {
            const struct parameter_ref *ref = &p->refs[p->unknowns[i].ref];
            const struct beam_parameter_info *info = effect_parameter(p, i);
            const size_t r = p->unknowns[i].ref;
            if (ref->role != ROLE_EFFECT || ref->owner != effect)
                continue;
            if (is_strength(info))
                there = there || info->neutral != 0.0 || fabs(out->value[r]) > significant * out->sd[r];
            else if (pass > 0 && !there && info->flags & BEAM_PARAMETER_INNER)
                out->sd[r] = nan("");
        }
    }
}

static enum bf_status fill_errors(struct refit_work *w, struct refit_result *out, struct bf_error *err)
{
    struct fit_result statistics = {0};
    enum bf_status status = fit_statistics(&w->problem, &w->model, w->x, &statistics, err);
    if (status ==
        BF_NUMERIC) { /* a motion that nobody can predict has derivatives without sense: values without errors */
        fit_free(&statistics);
        return BF_OK;
    }
    for (size_t i = 0; i < w->n_refs && !status; i++) {
        out->at_bound[i] = statistics.parameters[i].at_bound;
        if (out->estimated[i])
            out->sd[i] = statistics.parameters[i].sd;
    }
    fit_free(&statistics);
    for (size_t e = w->options->first_new; e < w->model.n_effects && !status; e++)
        forget_inner(w, e, out);
    return status;
}

static enum bf_status finish(struct refit_work *w, struct refit_result *out, struct bf_error *err)
{
    struct fit_problem *p = &w->problem;
    const bool values_only = w->options->quick || (w->options->near && !w->options->errors);
    double square;
    const enum bf_status status = fit_problem_evaluate(p, w->x, !values_only, &square, err);
    if (status)
        return status;
    fill_channels(w, out);
    fill_values(w, out);
    out->half_square = w->found.half_square;
    out->distance = sqrt(2.0 * w->found.decrement / fit_problem_spread(p));
    out->interrupted = fit_problem_interrupted(p);
    out->explained_s = p->explained_ps > 0.0 ? 1.0 / p->explained_ps : 0.0;
    out->abandoned = w->found.end == OPTIMISE_GAVE_UP;
    out->converged = !out->interrupted && w->found.end == OPTIMISE_CONVERGED && out->distance < at_optimum;
    /* where no step goes down although the gradient promises one, the derivatives say nothing about errors */
    const bool senseless = w->found.end == OPTIMISE_STALLED && out->chi2_per_row > 10.0;
    return values_only || senseless ? BF_OK : fill_errors(w, out, err);
}

enum bf_status refit_run(const struct model *model, const struct record records[], size_t n_records,
                         const struct refit_options *options, struct refit_result *out, struct bf_error *err)
{
    struct timespec begin, end;
    struct refit_work w;
    *out = (struct refit_result){0};
    clock_gettime(CLOCK_MONOTONIC, &begin);
    enum bf_status status = work_new(&w, model, records, n_records, options, err);
    if (!status && options->near && options->known_sd)
        status = hold_weak(&w, err);
    if (!status)
        status = refit_search_run(&w.search, w.x, &w.found, err);
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
    free(result->residual), free(result->channels), free(result->horizon_s);
    *result = (struct refit_result){0};
}

void refit_into_model(const struct record records[], size_t n_records, const double value[], const double sd[],
                      struct model *model)
{
    const char **names = record_base_names(records, n_records);
    struct parameter_ref *refs;
    const size_t n = model_parameters(model, names, n_records, &refs);
    model_set_parameters(model, refs, n, value, sd, names);
    free(refs), free(names);
}
