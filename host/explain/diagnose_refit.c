/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Refits on all threads: each worker takes the next job; answers are appended to the diagnosis under a lock. */
#include "diagnose_relatives.h"
#include "diagnose_shortlist.h"
#include "plausible.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "ground/ground.h"

/*
 * A law that is there is found in 40 to 130 evaluations (simulated rigs; the air's drag on a measured strip in 290, beside a second effect in 420);
 * another takes up to two thousand, each a step through time, to end far off. Fewer are enough beside an explanation that leaves little, of a
 * law that promises little, of one of degree one beside a linear effect that leads, and when all laws together have had twice as many.
 */
enum { LAW_RUNS = 600, RIVAL_LAW_RUNS = 150, ALL_LAW_RUNS = 2 * LAW_RUNS };

struct refit_queue {
    struct diagnose_state *w;
    struct refit_job *jobs;
    size_t n, next, done;
    double begin, span; /* of the progress bar */
    pthread_mutex_t lock;
    atomic_bool explained; /* a hypothesis has come down from a large misfit to the noise, or to nearly nothing */
};

static bool is_superseded(void *queue)
{
    return atomic_load(&((struct refit_queue *)queue)->explained);
}

static bool is_explained(const struct diagnosis *d, const struct hypothesis *h)
{
    const bool at_noise = h->fitted.noise_ratio <= diagnose_at_noise &&
                          (h->check.n_channels == 0 || h->check.noise_ratio <= search_limits.alike);
    return diagnose_is_far(&d->baseline) && (at_noise || hypothesis_takes_nearly_all(d, h)) && !is_stand_in(h);
}

/*
 * The refit of a law takes seconds to minutes and is stopped once another hypothesis explains the records. A linear effect added to a law
 * is not stopped: it may be the simpler case of that hypothesis.
 */
static bool takes_long(const struct hypothesis *h)
{
    return effect_kind(h->effects[h->n_effects - 1]) == KIND_LAW;
}

enum { ALONG = 4 }; /* places along the span, sixths of it from the root */

/* [ALONG][n_parameters] of the model, with its last effect at each of them. Caller frees. */
static double *starts_along(const struct diagnosis *d, const struct model *model)
{
    const size_t last = model->n_effects - 1;
    const int place = effect_slot(model->effects[last].effect, BEAM_ROLE_PLACE);
    const char **names = record_base_names(d->records, d->n_records);
    struct parameter_ref *refs;
    const size_t n = model_parameters(model, names, d->n_records, &refs);
    double *starts = bf_alloc(ALONG * n + 1, sizeof *starts);
    for (size_t k = 0; k < ALONG; k++)
        for (size_t i = 0; i < n; i++) {
            const bool moved = refs[i].role == ROLE_EFFECT && refs[i].owner == last && refs[i].slot == place;
            starts[k * n + i] = moved ? model->length_m * (double)(k + 1) / SIXTHS : refs[i].value;
        }
    free(refs), free(names);
    return starts;
}

/* A hypothesis whose fit has no value is dropped: the others decide, and the diagnosis is no longer sure. */
static bool fit_job(struct refit_queue *queue, struct refit_job *job, int threads, double abandon_above,
                    struct hypothesis *h)
{
    const struct diagnose_state *w = queue->w;
    const struct diagnosis *d = w->d;
    struct bf_error err;
    struct refit_options options = {.sigma = w->sigma,
                                    .threads = threads,
                                    .abandon_above = abandon_above,
                                    .raise_below = search_limits.half * d->baseline.fit.chi2_per_row,
                                    .most_runs = job->most_runs,
                                    .first_new = job->first_new,
                                    .near = job->near,
                                    .errors = job->near,
                                    .predict = w->options->predict};
    *h = (struct hypothesis){.n_base = d->baseline.n_base, .n_effects = job->n_effects, .n_tried = job->n_tried};
    h->model = job->model;
    job->model = (struct model){0};
    for (size_t i = 0; i < h->n_effects; i++)
        h->effects[i] = h->model.effects[h->n_base + i].effect;
    if (takes_long(h) && !w->options->everything)
        options.interrupted = is_superseded, options.context = queue;
    double *starts = job->along ? starts_along(d, &h->model) : NULL;
    options.n_starts = job->along ? ALONG : 0, options.starts = starts;
    const enum bf_status status = refit_run(&h->model, d->records, d->n_records, &options, &h->fit, &err);
    free(starts);
    if (status != BF_OK)
        return false;
    refit_into_model(d->records, d->n_records, h->fit.value, h->fit.sd, &h->model);
    h->n_added = h->fit.n_unknowns > d->baseline.fit.n_unknowns ? h->fit.n_unknowns - d->baseline.fit.n_unknowns : 1;
    h->refitted = true;
    h->tone_replaces_mode = tone_replaces_mode(h);
    h->places_tried = job->places_tried;
    return hypothesis_measure(w, h, &err) == BF_OK;
}

/* It leaves far more than the model without it: it has come nowhere, and what its facts say is no measure of it. */
static bool is_lost(const struct diagnosis *d, const struct hypothesis *h)
{
    return !(h->fitted.noise_ratio <= search_limits.far * d->baseline.fitted.noise_ratio);
}

/* It takes all but a hundredth of the misfit, or most of it and leaves little more than a free linear model. */
static bool is_promising(const struct diagnosis *d, const struct hypothesis *h)
{
    const double left = hypothesis_excess(&h->fitted), before = hypothesis_misfit(&d->baseline.fitted);
    const bool at_floor = d->attainable.modes > 0 && h->fitted.noise_ratio <= search_limits.alike * diagnose_floor(d);
    return left <= search_limits.hundredth * before || (at_floor && left <= search_limits.half * before);
}

/* What it has come to by then is a hypothesis: of laws the best one tells something, even if none explains the records. */
static void bound_law(const struct diagnose_state *w, struct refit_job *job, size_t runs)
{
    if (job->most_runs > 0 || w->options->everything || !model_has_law(&job->model))
        return;
    job->most_runs = runs;
    job->kept = true;
}

/*
 * A quick look that had come down to nearly nothing, and to where it is of use, when its evaluations ran out has found what was looked for: it goes on from
 * there, and is done in a few.
 */
static bool run_job(struct refit_queue *queue, struct refit_job *job, int threads, double abandon_above,
                    struct hypothesis *h)
{
    struct bf_error ignored;
    const bool usable = fit_job(queue, job, threads, abandon_above, h);
    struct refit_job rest = *job;
    const bool of_use = !(job->useless > 0.0) || (usable && h->fitted.noise_ratio <= job->useless);
    if (!usable || job->most_runs == 0 || !h->fit.interrupted || progress_interrupted() || !of_use ||
        !is_promising(queue->w->d, h) || model_copy(&h->model, &rest.model, &ignored) != BF_OK)
        return usable;
    rest.most_runs = 0;
    rest.near = true;
    rest.first_new = rest.model.n_effects;
    bound_law(queue->w, &rest, LAW_RUNS);
    const size_t evaluations = h->fit.evaluations;
    hypothesis_free(h);
    const bool found = fit_job(queue, &rest, threads, abandon_above, h);
    h->fit.evaluations += evaluations;
    return found;
}

static double lower(double limit, double other)
{
    return other > 0.0 && (limit == 0.0 || other < limit) ? other : limit;
}

/*
 * χ²/n above which a linear effect alone takes next to nothing, where another takes most; 0: no other does. Not of a law: its steps go uphill between windows,
 * and one that takes most in the end promises nothing on the way (the air's drag on a measured strip).
 */
static double next_to_nothing(const struct diagnosis *d, const struct refit_job *job, double best)
{
    const double before = d->baseline.fit.chi2_per_row;
    const bool outdone = job->n_effects == 1 && best > 0.0 && best <= (1.0 - search_limits.half) * before;
    return outdone && !model_has_law(&job->model) ? (1.0 - search_limits.tenth) * before : 0.0;
}

/* χ²/n, stand-ins apart; 0: there is none with so many effects. */
static double least_left(const struct diagnosis *d, size_t n_effects)
{
    double least = 0.0;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (h->n_effects == n_effects && !is_stand_in(h))
            least = lower(least, fmax(h->fit.chi2_per_row, 1.0));
    }
    return least;
}

double diagnose_out_of_reach(const struct diagnosis *d, size_t n_effects)
{
    return search_limits.far * search_limits.far * least_left(d, n_effects);
}

/*
 * χ²/n that is out of reach, or above what the job is of any use at, or next to what the model leaves without
 * the effect: the last digits of what takes nothing would cost as much as the search for what takes most.
 */
static double abandon_limit(const struct diagnosis *d, const struct refit_job *job)
{
    const double limit = lower(diagnose_out_of_reach(d, job->n_effects), job->useless * job->useless);
    return lower(limit, next_to_nothing(d, job, least_left(d, job->n_effects)));
}

/* Records of different level agree, and a linear effect takes most: the laws that are left do not depend on the level, and are found soon or not at all. */
static bool is_beside_linear(const struct diagnosis *d)
{
    return d->linearity.verdict == LINEARITY_LINEAR && d->n_hypotheses > 0 &&
           effect_is_linear(d->hypotheses[0].effects[0]) && d->hypotheses[0].explained >= search_limits.half;
}

static void *work(void *argument)
{
    struct refit_queue *queue = argument;
    struct diagnose_state *w = queue->w;
    (void)pthread_mutex_lock(&queue->lock);
    while (queue->next < queue->n && !progress_interrupted()) {
        struct refit_job *job = &queue->jobs[queue->next++];
        const size_t left = queue->n - queue->next + 1;
        const int threads = left >= (size_t)w->threads ? 1 : w->threads / (int)left;
        const double abandon_above = w->options->everything || job->to_the_end ? 0.0 : abandon_limit(w->d, job);
        const bool rival = job->doubtful || w->law_runs >= ALL_LAW_RUNS ||
                           diagnose_nearly_there(w->d, job->n_effects) || is_beside_linear(w->d);
        bound_law(w, job, rival ? RIVAL_LAW_RUNS : LAW_RUNS);
        (void)pthread_mutex_unlock(&queue->lock);
        struct hypothesis h;
        const bool usable = run_job(queue, job, threads, abandon_above, &h);
        job->unfinished = h.fit.interrupted && !progress_interrupted();
        job->left = usable ? h.fit.chi2_per_row : HUGE_VAL;
        const bool out_of_runs = job->most_runs > 0 && h.fit.evaluations >= job->most_runs;
        const bool superseded = job->unfinished && !(job->kept && out_of_runs);
        (void)pthread_mutex_lock(&queue->lock);
        struct diagnosis *d = w->d;
        d->evaluations += h.fit.evaluations;
        w->law_runs += hypothesis_has_law(&h) ? h.fit.evaluations : 0;
        const bool kept = usable && !superseded && !is_lost(d, &h);
        if (kept) {
            if (is_explained(d, &h))
                atomic_store(&queue->explained, true);
            d->hypotheses = bf_grow(d->hypotheses, d->n_hypotheses + 1, sizeof *d->hypotheses);
            d->hypotheses[d->n_hypotheses++] = h;
        } else {
            d->n_failed += !usable && !superseded;
            hypothesis_free(&h);
        }
        queue->done++;
        if (w->bar)
            progress_update(w->bar, queue->begin + queue->span * (double)queue->done / (double)queue->n,
                            kept ? h.effects[h.n_effects - 1]->id : NULL);
    }
    (void)pthread_mutex_unlock(&queue->lock);
    return NULL;
}

void diagnose_refits(struct diagnose_state *w, struct refit_job jobs[], size_t n, double span)
{
    struct refit_queue queue = {.w = w, .jobs = jobs, .n = n, .begin = w->done, .span = span};
    (void)pthread_mutex_init(&queue.lock, NULL);
    workers_run(w->threads, n, work, &queue);
    (void)pthread_mutex_destroy(&queue.lock);
    for (size_t i = 0; i < n; i++)
        model_free(&jobs[i].model);
    w->done += span;
}

enum bf_status diagnose_try(struct diagnose_state *w, struct refit_job jobs[], size_t n, enum bf_status status,
                            double span)
{
    for (size_t i = 0; status && i < n; i++)
        model_free(&jobs[i].model);
    if (status || n == 0)
        return status;
    diagnose_refits(w, jobs, n, span);
    diagnose_rank(w->d, w->n_tried);
    diagnose_drop_repeats(w->d);
    return BF_OK;
}
