/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Which effects are worth a refit on top of a hypothesis: linear ones by score test and a few Gauss–Newton steps, laws by
 * the equation-error trial along the measured motion. Both only rank and give start values; refits decide.
 */
#include "diagnose_work.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "progress.h"

/*
 * A candidate is refitted when what it leaves (rms, after its few steps) is at most this many times what the best one
 * leaves. docs/diagnose.md, 'Short list': the true effect was within 2.1 of the best in every hidden case.
 */
static const double worth = 3.0;
/* Scores with a family-wise p above this are not refitted. Generous: a refit is cheap, an omission is final. */
static const double hopeless_p = 0.05;
/* A first-order score is worth something below this noise ratio (diagnosis.md: χ²/n below 100); above, all are refitted. */
static const double score_limit = 10.0;
static const double motion_floor = 0.01;
enum { REFINED = 12, REFINE_STEPS = 3, TRIAL_ROUNDS = 2 };

struct shortlist {
    struct diagnose_work *w;
    const struct hypothesis *from;
    size_t n_effects; /* of the new hypotheses */
    struct candidate_list list;
    struct score_base *base;
    struct score *scores;   /* [list.n] */
    size_t *order, n_order; /* of the linear candidates, best first */
    struct trial *trials;   /* best first */
    size_t n_trials;
    bool scored;      /* false: the misfit is too large for scores */
    double best_left; /* rms in units of the noise that the best of all leaves */
};

static double score_left(const struct shortlist *s, size_t i)
{
    const struct score *score = &s->scores[i];
    const double rows = (double)s->from->fit.n_rows;
    if (score->refined && isfinite(score->chi_square))
        return sqrt(score->chi_square / rows);
    double freedom;
    return sqrt(fmax(score_base_misfit(s->base, &freedom) - score->LM, rows) / rows);
}

static int by_left(const void *a, const void *b, void *context)
{
    const struct shortlist *s = context;
    const double x = score_left(s, *(const size_t *)a), y = score_left(s, *(const size_t *)b);
    return (x > y) - (x < y);
}

static enum bf_status score_linear(struct shortlist *s, struct bf_error *err)
{
    struct diagnose_work *w = s->w;
    const struct score_options options = {.sigma = w->sigma, .threads = w->threads, .predict = w->options->predict};
    enum bf_status status = score_base_new(&s->from->model, w->d->records, w->d->n_records, &options, &s->base, err);
    s->scores = bf_alloc(s->list.n, sizeof *s->scores);
    s->order = bf_alloc(s->list.n, sizeof *s->order);
    if (status)
        return status;
    score_run(s->base, s->list.candidates, s->list.n, s->scores);
    s->n_order = score_rank(s->list.candidates, s->scores, s->list.n, s->order);
    for (size_t i = 0; i < s->list.n; i++)
        w->n_tried += s->scores[i].n_tried;
    for (size_t k = 0; k < s->n_order && k < REFINED && !progress_interrupted(); k++) {
        struct score *score = &s->scores[s->order[k]];
        if (score->p_value > hopeless_p)
            break;
        status = score_refine(s->base, &s->list.candidates[s->order[k]], REFINE_STEPS, score, err);
        if (status == BF_NUMERIC)
            status = BF_OK;
        if (status)
            return status;
    }
    qsort_r(s->order, s->n_order < REFINED ? s->n_order : REFINED, sizeof *s->order, by_left, s);
    return BF_OK;
}

static bool excluded(const struct diagnose_work *w, const char *id)
{
    for (size_t i = 0; i < w->options->n_without; i++)
        if (strcmp(w->options->without[i], id) == 0)
            return true;
    return false;
}

/* Laws, along the motion that the hypothesis and its residual tell; none when the hypothesis itself has a law. */
static enum bf_status try_laws(struct shortlist *s, struct bf_error *err)
{
    struct diagnose_work *w = s->w;
    struct predictor *predictor;
    struct motion motion;
    for (size_t e = 0; e < s->from->model.n_effects; e++)
        if (s->from->model.effects[e].effect->law != NULL)
            return BF_OK;
    enum bf_status status =
        predictor_new(&s->from->model, w->d->records, w->d->n_records, &w->options->predict, &predictor, err);
    if (status)
        return status;
    status = motion_new(predictor, s->from->fit.value, w->sigma, motion_floor, &motion, err);
    if (!status) {
        const struct trial_options options = {.rounds = TRIAL_ROUNDS};
        status = trial_all(&motion, &options, &s->trials, &s->n_trials, err);
        motion_free(&motion);
    } else if (status == BF_USAGE) {
        status = BF_OK; /* free decays only: no motion */
    }
    predictor_free(predictor);
    size_t kept = 0;
    for (size_t i = 0; i < s->n_trials; i++) {
        w->n_tried += s->trials[i].forces;
        if (excluded(w, s->trials[i].effect->id) || !s->trials[i].possible)
            trial_free(&s->trials[i]);
        else
            s->trials[kept++] = s->trials[i];
    }
    s->n_trials = kept;
    return status;
}

static struct refit_job *push(struct refit_job **jobs, size_t *n)
{
    *jobs = bf_grow(*jobs, *n + 1, sizeof **jobs);
    return &(*jobs)[(*n)++];
}

static enum bf_status job_of_score(const struct shortlist *s, size_t i, struct refit_job *job, struct bf_error *err)
{
    *job = (struct refit_job){.n_effects = s->n_effects, .n_tried = s->w->n_tried};
    const enum bf_status status = score_model(s->base, &s->list.candidates[i], &s->scores[i], &job->model, err);
    job->first_new = job->model.n_effects; /* the score's start is near */
    return status;
}

/* Far from the noise a score cannot tell: the catalogue's start, and the refit finds its own. */
static enum bf_status job_unscored(const struct shortlist *s, const struct candidate *candidate, struct refit_job *job,
                                   struct bf_error *err)
{
    *job = (struct refit_job){.n_effects = s->n_effects,
                              .n_tried = s->w->n_tried,
                              .first_new = s->from->model.n_effects,
                              .abandon_above = pow(worth * s->best_left, 2.0)};
    return candidate_model(&s->from->model, candidate, candidate->start, &job->model, err);
}

static enum bf_status job_of_trial(const struct shortlist *s, const struct trial *trial, struct refit_job *job,
                                   struct bf_error *err)
{
    *job = (struct refit_job){.n_effects = s->n_effects, .n_tried = s->w->n_tried};
    for (size_t i = 0; i < s->list.n; i++) {
        const struct candidate *candidate = &s->list.candidates[i];
        if (candidate->effect != trial->effect || candidate->channel[0] != '\0')
            continue;
        job->first_new = s->from->model.n_effects;
        return candidate_model(&s->from->model, candidate, trial->p, &job->model, err);
    }
    return bf_fail(err, BF_USAGE, "effect %s cannot act on this model", trial->effect->id);
}

/* What the best of a list leaves, and of the refits so far that have as many effects. */
static void update_best(struct shortlist *s)
{
    const struct diagnosis *d = s->w->d;
    double best = s->from->fitted.noise_ratio;
    if (s->scored && s->n_order > 0)
        best = fmin(best, score_left(s, s->order[0]));
    if (s->n_trials > 0)
        best = fmin(best, s->trials[0].unexplained);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects == s->n_effects)
            best = fmin(best, d->hypotheses[i].fitted.noise_ratio);
    s->best_left = fmax(best, 1.0);
}

static bool bends(const struct beam_effect *effect)
{
    return effect->law != NULL || effect->drive != NULL || effect->map != NULL;
}

/* Candidates that act without a law; which: only those that are not linear, only those that are, or both. */
enum which { LINEAR_ONES, BENT_ONES };

static void choose_linear(struct shortlist *s, enum which which, size_t most, struct refit_job **jobs, size_t *n)
{
    struct bf_error err;
    struct refit_job job;
    const bool all = s->w->options->everything;
    for (size_t i = 0; !s->scored && i < s->list.n; i++) {
        const struct candidate *candidate = &s->list.candidates[i];
        if (candidate->effect->law == NULL && bends(candidate->effect) == (which == BENT_ONES) &&
            job_unscored(s, candidate, &job, &err) == BF_OK)
            *push(jobs, n) = job;
    }
    for (size_t k = 0; s->scored && k < s->n_order && (all || *n < most); k++) {
        const size_t i = s->order[k];
        if (bends(s->list.candidates[i].effect) != (which == BENT_ONES))
            continue;
        if (!all && (score_left(s, i) > worth * s->best_left || s->scores[i].p_value > hopeless_p))
            continue;
        if (job_of_score(s, i, &job, &err) == BF_OK)
            *push(jobs, n) = job;
    }
}

static void choose_laws(struct shortlist *s, size_t most, struct refit_job **jobs, size_t *n)
{
    struct bf_error err;
    struct refit_job job;
    const bool all = s->w->options->everything;
    for (size_t k = 0; k < s->n_trials && (all || k < most); k++) {
        if (!all && (s->trials[k].unexplained > worth * s->best_left || s->trials[k].p_value > hopeless_p))
            continue;
        if (job_of_trial(s, &s->trials[k], &job, &err) == BF_OK)
            *push(jobs, n) = job;
    }
}

/* Some refit with one effect more than the root leaves nothing that matters. */
static bool explained(const struct shortlist *s)
{
    const struct diagnosis *d = s->w->d;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects == s->n_effects && d->hypotheses[i].explains)
            return true;
    return false;
}

static void refit(struct shortlist *s, struct refit_job **jobs, size_t *n, double span)
{
    diagnose_refits(s->w, *jobs, *n, span);
    free(*jobs);
    *jobs = NULL, *n = 0;
    diagnose_rank(s->w->d, s->w->n_tried);
    update_best(s);
}

/*
 * What records of different level say comes first: a beam that is not linear needs an effect that is not, and only when
 * none explains it the others are tried; a linear beam needs no law unless its trial is as good as the best refit.
 */
static void waves(struct shortlist *s, size_t most_linear, size_t most_laws, double span)
{
    struct refit_job *jobs = NULL;
    size_t n = 0;
    const bool bent = s->from->n_effects == 0 && s->w->d->linearity.verdict == LINEARITY_NONLINEAR;
    update_best(s);
    if (bent || s->w->options->everything) {
        choose_laws(s, most_laws, &jobs, &n);
        choose_linear(s, BENT_ONES, most_linear, &jobs, &n);
        refit(s, &jobs, &n, 0.5 * span);
        if (explained(s) && !s->w->options->everything)
            return;
        choose_linear(s, LINEAR_ONES, most_linear, &jobs, &n);
    } else {
        choose_linear(s, LINEAR_ONES, most_linear, &jobs, &n);
        choose_linear(s, BENT_ONES, most_linear, &jobs, &n);
        refit(s, &jobs, &n, 0.5 * span);
        choose_laws(s, most_laws, &jobs, &n);
    }
    refit(s, &jobs, &n, 0.5 * span);
}

static void debug(const struct shortlist *s)
{
    if (getenv("BF_DEBUG") == NULL)
        return;
    double f;
    fprintf(stderr, "== base misfit %.4g rows %zu\n", s->base ? score_base_misfit(s->base, &f) : 0.0,
            s->from->fit.n_rows);
    for (size_t k = 0; k < s->n_order; k++) {
        const struct score *c = &s->scores[s->order[k]];
        fprintf(stderr, "%-22s %-10s LM %.4g p %.2g est %.3g left %.4g ref %d\n",
                s->list.candidates[s->order[k]].effect->id, s->list.candidates[s->order[k]].channel, c->LM, c->p_value,
                c->estimate, score_left(s, s->order[k]), c->refined);
    }
    for (size_t k = 0; k < s->n_trials; k++)
        fprintf(stderr, "law %-22s share %.4g p %.2g strength %.3g±%.2g unexpl %.4g\n", s->trials[k].effect->id,
                s->trials[k].share, s->trials[k].p_value, s->trials[k].strength, s->trials[k].strength_sd,
                s->trials[k].unexplained);
    if (getenv("BF_DEBUG")[0] == '2')
        exit(0);
}

static void shortlist_free(struct shortlist *s)
{
    for (size_t i = 0; s->scores && i < s->list.n; i++)
        score_free(&s->scores[i]);
    for (size_t i = 0; i < s->n_trials; i++)
        trial_free(&s->trials[i]);
    free(s->scores), free(s->order), free(s->trials);
    if (s->base)
        score_base_free(s->base);
    candidate_list_free(&s->list);
}

enum bf_status diagnose_extend(struct diagnose_work *w, const struct hypothesis *from, size_t most_linear,
                               size_t most_laws, double span, struct bf_error *err)
{
    struct shortlist s = {.w = w, .from = from, .n_effects = from->n_effects + 1};
    double lines[16];
    size_t n_lines = 0;
    for (size_t i = 0; i < w->d->linearity.n_added && n_lines < 16; i++)
        if (w->d->linearity.added[i].frequency_Hz > 0.0)
            lines[n_lines++] = w->d->linearity.added[i].frequency_Hz;
    const struct candidate_options options = {
        .without = w->options->without, .n_without = w->options->n_without, .line_Hz = lines, .n_lines = n_lines};
    enum bf_status status = candidate_list_new(&from->model, w->d->records, w->d->n_records, &options, &s.list, err);
    s.scored = !w->options->everything && from->fitted.noise_ratio < score_limit;
    if (!status && s.scored)
        status = score_linear(&s, err);
    if (!status && most_laws > 0)
        status = try_laws(&s, err);
    debug(&s);
    if (!status)
        waves(&s, most_linear, most_laws, span);
    shortlist_free(&s);
    return status;
}
