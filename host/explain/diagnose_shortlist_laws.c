/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The laws of a short list: their trials along the measured motion, and which of them are refitted. */
#include "diagnose_shortlist.h"

#include <math.h>

#include "ground/ground.h"

enum { TRIAL_ROUNDS = 3 }; /* renewals of a trial's motion */

enum bf_status shortlist_try_laws(struct shortlist *s, struct bf_error *err)
{
    struct diagnose_state *w = s->w;
    struct predictor *predictor;
    struct motion motion;
    if (s->tried || shortlist_reaches(&s->from->model, KIND_NONLINEAR_CHAIN))
        return BF_OK;
    s->tried = true;
    enum bf_status status =
        predictor_new(&s->from->model, w->d->records, w->d->n_records, &w->options->predict, &predictor, err);
    if (status)
        return status;
    status = motion_new(predictor, s->from->fit.value, w->sigma, MOTION_FLOOR, &motion, err);
    if (!status) {
        const struct trial_options options = {.rounds = TRIAL_ROUNDS};
        status = trial_all(&motion, &options, &s->trials, &s->n_trials, err);
        motion_free(&motion);
    }
    predictor_free(predictor);
    size_t kept = 0;
    for (size_t i = 0; i < s->n_trials; i++) {
        w->n_tried += s->trials[i].forces;
        if (diagnose_leaves_out(w, s->trials[i].effect) || !s->trials[i].possible)
            trial_free(&s->trials[i]);
        else
            s->trials[kept++] = s->trials[i];
    }
    s->n_trials = kept;
    return status;
}

/* The candidate with the effect's default channels. */
static const struct candidate *candidate_of(const struct shortlist *s, const struct beam_effect *effect)
{
    for (size_t i = 0; i < s->list.n; i++)
        if (s->list.candidates[i].effect == effect && s->list.candidates[i].channel[0] == '\0')
            return &s->list.candidates[i];
    return NULL;
}

/*
 * The refit of a law that leaves much takes a minute and names nothing, so a trial must leave at most a fifth of the excess
 * over the noise, and take at least so much of what it is given as half of that excess is of the whole: its weights have a floor, under which
 * what is given to it may lie below the noise.
 */
static bool trial_promises(const struct trial *trial, const struct hypothesis *from)
{
    const double left = trial->unexplained * trial->unexplained;
    const double before = left * trial->chi_square_baseline / trial->chi_square;
    const double excess = hypothesis_excess(&from->fitted) / (1.0 + hypothesis_excess(&from->fitted));
    return left - 1.0 <= search_limits.fifth * (before - 1.0) && trial->share >= search_limits.half * excess;
}

static bool law_is_likely(const struct shortlist *s, const struct trial *trial, double best)
{
    return shortlist_is_worth_refit(s, trial->unexplained, best) && trial->p_value <= shortlist_highest_p &&
           !(s->linear && !effect_law_is_of_degree_one(trial->effect));
}

static bool push_law(const struct shortlist *s, const struct trial *trial, bool doubtful, struct refit_job **jobs,
                     size_t *n)
{
    struct bf_error err;
    struct refit_job job;
    const struct candidate *candidate = candidate_of(s, trial->effect);
    if (candidate == NULL || shortlist_job_of(s, candidate, trial->p, &job, &err) != BF_OK)
        return false;
    job.doubtful = doubtful;
    /* at the noise the optimum lies beside the baseline, if anywhere */
    job.near = s->from->fitted.noise_ratio <= diagnose_at_noise;
    shortlist_push(jobs, n, &job);
    return true;
}

/* Along the measured motion it takes nearly as much as the best of the trials, which promises enough: what is named stands against it. */
static bool rivals_best(const struct shortlist *s, const struct trial *trial)
{
    return trial_promises(&s->trials[0], s->from) && trial->share >= (1.0 - search_limits.fifth) * s->trials[0].share;
}

void shortlist_choose_laws(struct shortlist *s, size_t most, double best, struct refit_job **jobs, size_t *n)
{
    for (; s->refitted_laws < s->n_trials && most > 0; s->refitted_laws++) {
        const struct trial *trial = &s->trials[s->refitted_laws];
        const bool promises = trial_promises(trial, s->from);
        if (law_is_likely(s, trial, best) && (promises || rivals_best(s, trial)) &&
            push_law(s, trial, !promises, jobs, n))
            most--;
    }
}

/* What a trial leaves is in units of its own weights; the share that it takes of what it is given can be compared. The likely one, but for `than`, that takes most; NULL: none is. */
static const struct trial *takes_most(const struct shortlist *s, double best, const struct trial *than)
{
    const struct trial *most = NULL;
    for (size_t i = 0; i < s->n_trials; i++) {
        const struct trial *trial = &s->trials[i];
        if (trial != than && law_is_likely(s, trial, best) && (most == NULL || trial->share > most->share))
            most = trial;
    }
    return most;
}

void shortlist_choose_last(const struct shortlist *s, double best, struct refit_job **jobs, size_t *n)
{
    const struct trial *first = takes_most(s, best, NULL), *second = takes_most(s, best, first);
    if (first == NULL || trial_promises(first, s->from))
        return;
    (void)push_law(s, first, true, jobs, n);
    if (second != NULL && !trial_promises(second, s->from) &&
        second->share >= (1.0 - search_limits.fifth) * first->share)
        (void)push_law(s, second, true, jobs, n);
}
