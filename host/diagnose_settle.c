/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A refit stops when it is good enough to be compared, and a place on the beam has minima besides the lowest. The explanation
 * that is about to be named is refitted from where it is and with each of its places elsewhere, when it has not converged
 * and does not step through time.
 */
#include "diagnose_work.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 6, MOST_JOBS = 1 + DIAGNOSE_EFFECTS * (PLACES - 1) };

static bool worth_settling(const struct hypothesis *h)
{
    for (size_t i = 0; i < h->n_effects; i++)
        if (h->effects[i]->law != NULL)
            return false;
    return !h->fit.converged && !h->fit.interrupted;
}

static enum bf_status push_copy(const struct hypothesis *h, struct refit_job jobs[], size_t *n, struct bf_error *err)
{
    struct refit_job *job = &jobs[*n];
    *job = (struct refit_job){.n_effects = h->n_effects, .n_tried = h->n_tried, .to_the_end = true};
    const enum bf_status status = model_copy(&h->model, &job->model, err);
    job->first_new = h->model.n_effects; /* every value is a fitted one */
    *n += status == BF_OK;
    return status;
}

/* From where it is, and with one place at each sixth of the length but the one where it stands. */
static enum bf_status push_jobs(const struct hypothesis *h, struct refit_job jobs[], size_t *n, struct bf_error *err)
{
    enum bf_status status = push_copy(h, jobs, n, err);
    for (size_t e = h->n_base; e < h->model.n_effects && !status; e++) {
        const struct model_effect *own = &h->model.effects[e];
        for (int i = 0; i < own->effect->n_parameters; i++) {
            const struct parameter *at = &own->parameters[i];
            if (!(own->effect->parameters[i].flags & BEAM_PARAMETER_POSITION) || at->fixed)
                continue;
            const int here = (int)lround(at->value / h->model.length_m * PLACES);
            for (int k = 1; k <= PLACES && !status && *n < MOST_JOBS; k++)
                if (k != here && (status = push_copy(h, jobs, n, err)) == BF_OK)
                    jobs[*n - 1].model.effects[e].parameters[i].value = h->model.length_m * k / PLACES;
        }
    }
    return status;
}

static bool same_effects(const struct hypothesis *a, const struct hypothesis *b)
{
    if (a->model.n_effects != b->model.n_effects)
        return false;
    for (size_t i = 0; i < a->model.n_effects; i++)
        if (a->model.effects[i].effect != b->model.effects[i].effect ||
            strcmp(a->model.effects[i].channel, b->model.effects[i].channel) != 0)
            return false;
    return true;
}

/* Of the same effects the best refit stays. */
static void drop_repeats(struct diagnosis *d)
{
    size_t kept = 1;
    for (size_t i = 1; i < d->n_hypotheses; i++) {
        if (same_effects(&d->hypotheses[i], &d->hypotheses[0]))
            hypothesis_free(&d->hypotheses[i]);
        else
            d->hypotheses[kept++] = d->hypotheses[i];
    }
    d->n_hypotheses = kept;
}

enum bf_status diagnose_settle(struct diagnose_work *w, double span, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct refit_job jobs[MOST_JOBS];
    size_t n = 0;
    if (d->n_hypotheses == 0 || !worth_settling(&d->hypotheses[0]))
        return BF_OK;
    const enum bf_status status = push_jobs(&d->hypotheses[0], jobs, &n, err);
    for (size_t i = 0; status && i < n; i++)
        model_free(&jobs[i].model);
    if (status)
        return status;
    diagnose_refits(w, jobs, n, span);
    diagnose_rank(d, w->n_tried);
    drop_repeats(d);
    return BF_OK;
}
