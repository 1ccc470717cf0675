/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The computation must not be the misfit: friction and contact at the usual steps leave several times the noise at the true values, and
 * one law is then named for the other. What is about to be named, and what it stands against, is fitted again at the steps that it needs.
 */
#include "diagnose_state.h"

#include <stdlib.h>

#include "ground/ground.h"

static enum bf_status add_job(const struct diagnose_state *w, const struct hypothesis *h, struct refit_job jobs[],
                              size_t *n, struct bf_error *err)
{
    const struct diagnosis *d = w->d;
    const struct fit_options options = {.quiet = true, .sigma = w->sigma, .predict = w->options->predict};
    struct bf_error ignored;
    int steps;
    if (fit_steps(&h->model, d->records, d->n_records, &options, h->fit.value, h->fit.horizon_s, &steps, &ignored) ||
        steps == 0)
        return BF_OK;
    struct refit_job *job = &jobs[*n];
    *job = (struct refit_job){.n_effects = h->n_effects,
                              .n_tried = h->n_tried,
                              .first_new = h->model.n_effects,
                              .to_the_end = true,
                              .near = true};
    const enum bf_status status = model_copy(&h->model, &job->model, err);
    job->model.steps_per_sample = steps;
    *n += !status;
    return status;
}

enum bf_status diagnose_steps(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct refit_job jobs[SEARCH_RIVALS];
    size_t n = 0, seen = 0;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < d->n_hypotheses && seen < SEARCH_RIVALS && !status && !progress_interrupted(); i++) {
        struct hypothesis *h = &d->hypotheses[i];
        if (!hypothesis_has_law(h) || h->score <= d->baseline.score)
            continue;
        seen++;
        if (!h->explains && !h->steps_tried)
            status = add_job(w, h, jobs, &n, err);
        h->steps_tried = true;
    }
    status = diagnose_try(w, jobs, n, status, 0.0);
    diagnose_rank(d, w->n_tried); /* what was computed with more steps has taken another's rank */
    return status;
}
