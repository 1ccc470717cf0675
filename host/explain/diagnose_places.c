/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A refit stops when it is good enough to be compared, and the misfit has several minima over the place of an effect. The best
 * hypothesis is refitted from where it is and from other places, when it has not converged or one more effect would take a part of
 * what it leaves. A law is when it comes near the records: the motion of a model without it has told its place. On a weak misfit no
 * other linear effect is: the scan of first-order scores, which is exact there, has looked at every place.
 */
#include "diagnose_shortlist.h"
#include "diagnose_state.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_JOBS = 1 + DIAGNOSE_EFFECTS * (SIXTHS - 1) };
struct place_jobs {
    bool to_the_end; /* as of struct refit_job */
    size_t n;
    struct refit_job job[MOST_JOBS];
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

static bool is_wanted(const struct diagnosis *d, const struct hypothesis *best)
{
    return can_move(best) && (!best->fit.converged || !best->explains) && !diagnose_no_linear_outdoes(d);
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

/* With one place at each sixth of the length but the one where it stands. */
static enum bf_status push_places(const struct hypothesis *h, struct place_jobs *jobs, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t e = h->n_base; e < h->model.n_effects && !status; e++) {
        const struct model_effect *own = &h->model.effects[e];
        for (int i = 0; i < own->effect->n_parameters; i++) {
            if (!is_free_place(own, i))
                continue;
            const int here = (int)lround(own->parameters[i].value / h->model.length_m * SIXTHS);
            for (int k = 1; k <= SIXTHS && !status && jobs->n < MOST_JOBS; k++)
                if (k != here && (status = push_copy(h, jobs, err)) == BF_OK)
                    jobs->job[jobs->n - 1].model.effects[e].parameters[i].value =
                        fmin(h->model.length_m * k / SIXTHS, model_last_place_m(&h->model));
        }
    }
    return status;
}

/* Those, and from where it is. */
static enum bf_status push_jobs(const struct hypothesis *h, struct place_jobs *jobs, struct bf_error *err)
{
    const enum bf_status status = push_copy(h, jobs, err);
    return status ? status : push_places(h, jobs, err);
}

/* ---- Refits ---- */

enum bf_status diagnose_other_places(struct diagnose_state *w, double span, struct bf_error *err)
{
    struct hypothesis *best = w->d->n_hypotheses > 0 ? &w->d->hypotheses[0] : NULL;
    struct place_jobs jobs = {.to_the_end = true};
    if (best == NULL || !is_wanted(w->d, best))
        return BF_OK;
    const enum bf_status status = push_jobs(best, &jobs, err);
    best->places_tried = true;
    return diagnose_try(w, jobs.job, jobs.n, status, span);
}

/* A law at a place comes near the records and does not explain them. */
static bool may_be_elsewhere(const struct diagnosis *d, const struct hypothesis *best)
{
    return best->n_effects == 1 && hypothesis_has_law(best) && !isnan(hypothesis_only_place(best)) &&
           !best->places_tried && !diagnose_is_far(best) && !diagnose_explained(d, 1);
}

enum bf_status diagnose_law_places(struct diagnose_state *w, double span, struct bf_error *err)
{
    struct hypothesis *best = w->d->n_hypotheses > 0 ? &w->d->hypotheses[0] : NULL;
    struct place_jobs jobs = {0};
    if (best == NULL || !may_be_elsewhere(w->d, best))
        return BF_OK;
    const enum bf_status status = push_places(best, &jobs, err);
    best->places_tried = true;
    for (size_t k = 0; k < jobs.n; k++)
        jobs.job[k].most_runs = PLACE_RUNS;
    return diagnose_try(w, jobs.job, jobs.n, status, span);
}
