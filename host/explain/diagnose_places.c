/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A refit stops when it is good enough to be compared, and the misfit has several minima over the place of an effect. The best
 * hypothesis is refitted from where it is and from other places, when it has not converged or one more effect would take a part of
 * what it leaves. On a weak misfit so are the single effects that leave little more than the noise, because each may become the best.
 */
#include "diagnose_shortlist.h"
#include "diagnose_state.h"

#include <math.h>
#include <stdlib.h>

enum {
    PLACES = 6,
    MOST_JOBS = 1 + DIAGNOSE_EFFECTS * (PLACES - 1),
    MOST_WEAK = 3,
    MOST_SINGLES = 2,
    ALL_JOBS = (1 + MOST_WEAK) * MOST_JOBS
};
/* On a weak misfit a single effect that leaves at most this many times the noise may be the cause at a wrong place. */
static const double weak_ratio = 1.05;
struct place_jobs {
    bool to_the_end; /* as of struct refit_job */
    size_t n;
    struct refit_job job[ALL_JOBS];
};

/* ---- Places ---- */

static bool is_free_place(const struct model_effect *own, int i)
{
    return own->effect->parameters[i].role == BEAM_ROLE_PLACE && !own->parameters[i].fixed;
}

/* ---- Which hypotheses are refitted ---- */

static bool can_move(const struct hypothesis *h)
{
    return !h->places_tried && !hypothesis_has_law(h) && !h->fit.interrupted;
}

static bool is_wanted(const struct diagnosis *d, const struct hypothesis *h)
{
    const bool best = h == &d->hypotheses[0];
    if (!can_move(h))
        return false;
    if (best && (!h->fit.converged || !h->explains) && !diagnose_no_linear_outdoes(d))
        return true;
    return !diagnose_is_far(&d->baseline) && !isnan(hypothesis_only_place(h)) && h->fitted.noise_ratio <= weak_ratio;
}

static enum bf_status push_copy(const struct hypothesis *h, struct place_jobs *jobs, struct bf_error *err)
{
    struct refit_job *job = &jobs->job[jobs->n];
    *job = (struct refit_job){
        .n_effects = h->n_effects, .n_tried = h->n_tried, .to_the_end = jobs->to_the_end, .places_tried = true};
    const enum bf_status status = model_copy(&h->model, &job->model, err);
    job->first_new = h->model.n_effects; /* every value is a fitted one */
    jobs->n += status == BF_OK;
    return status;
}

/* From where it is, and with one place at each sixth of the length but the one where it stands. */
static enum bf_status push_jobs(const struct hypothesis *h, struct place_jobs *jobs, struct bf_error *err)
{
    enum bf_status status = push_copy(h, jobs, err);
    for (size_t e = h->n_base; e < h->model.n_effects && !status; e++) {
        const struct model_effect *own = &h->model.effects[e];
        for (int i = 0; i < own->effect->n_parameters; i++) {
            if (!is_free_place(own, i))
                continue;
            const int here = (int)lround(own->parameters[i].value / h->model.length_m * PLACES);
            for (int k = 1; k <= PLACES && !status && jobs->n < ALL_JOBS; k++)
                if (k != here && (status = push_copy(h, jobs, err)) == BF_OK)
                    jobs->job[jobs->n - 1].model.effects[e].parameters[i].value =
                        fmin(h->model.length_m * k / PLACES, model_last_place_m(&h->model));
        }
    }
    return status;
}

/* ---- Refits ---- */

enum bf_status diagnose_other_places(struct diagnose_state *w, double span, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct place_jobs jobs = {.to_the_end = true};
    enum bf_status status = BF_OK;
    for (size_t i = 0, chosen = 0; i < d->n_hypotheses && chosen <= MOST_WEAK && !status; i++)
        if (is_wanted(d, &d->hypotheses[i])) {
            status = push_jobs(&d->hypotheses[i], &jobs, err);
            d->hypotheses[i].places_tried = true;
            chosen++;
        }
    return diagnose_try(w, jobs.job, jobs.n, status, span);
}

enum bf_status diagnose_single_places(struct diagnose_state *w, double span, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct place_jobs jobs = {0};
    enum bf_status status = BF_OK;
    if (diagnose_modes_have_told(w)) /* they were asked for places all along the span */
        return BF_OK;
    diagnose_drop_repeats(d); /* one hypothesis of each effect */
    const double most_left = diagnose_worth * diagnose_best_left(d, 1);
    for (size_t i = 0, n = 0; i < d->n_hypotheses && n < MOST_SINGLES && !status; i++) {
        struct hypothesis *h = &d->hypotheses[i];
        if (isnan(hypothesis_only_place(h)) || !can_move(h) || h->fitted.noise_ratio > most_left)
            continue;
        status = push_jobs(h, &jobs, err);
        h->places_tried = true;
        n++;
    }
    return diagnose_try(w, jobs.job, jobs.n, status, span);
}
