/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Cross-validation over whole records, for a diagnosis without held-out ones. Records are left out in groups (one each, as
 * long as there are few), the model is fitted to the others from where it stands, and predicts those left out. It is not done where a record
 * alone has an input or an output of unknown gain: the others do not tell what it is predicted with.
 */
#include "diagnose_state.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "estimate/estimate.h"
#include "ground/ground.h"

enum {
    MOST_FOLDS = 6, /* each costs a refit of every hypothesis that is checked */
    MOST_CHECKED = 4
};

/* Some of the records with their share of the noise. */
struct record_set {
    size_t n;
    struct record *records; /* [n] views */
    const char **names;     /* [n] */
    double *sigma;          /* of their channels */
    size_t n_channels;
    size_t *channel; /* [n_channels] index among the channels of all records */
};

struct fold_job {
    struct hypothesis *h;
    size_t fold;
    bool done, failed;                  /* neither: interrupted */
    struct fit_channel_error *channels; /* of the records left out, order of predictor_channels() */
    size_t n_channels, evaluations;
};

struct fold_queue {
    struct diagnose_state *w;
    struct fold_job *jobs;
    size_t n, next, finished;
    double begin, span; /* of the progress bar */
    pthread_mutex_t lock;
};

static size_t folds(const struct diagnosis *d)
{
    return d->n_records < MOST_FOLDS ? d->n_records : MOST_FOLDS;
}

/* The record has this channel, and something is in it. */
static bool has_signal(const struct record *record, const char *name)
{
    const double *x = record_column(record, name);
    for (size_t k = 0; x != NULL && k < record->n; k++)
        if (fabs(x[k]) > 0.0)
            return true;
    return false;
}

/* The record has it, and none does that is kept when it is left out. */
static bool is_alone(const struct diagnosis *d, size_t r, const char *name)
{
    if (!has_signal(&d->records[r], name))
        return false;
    for (size_t q = 0; q < d->n_records; q++)
        if (q % folds(d) != r % folds(d) && has_signal(&d->records[q], name))
            return false;
    return true;
}

/* Nothing but records tells it. */
static bool is_open(const struct parameter *p)
{
    return !p->fixed && !(p->prior > 0.0);
}

static bool gain_is_open(const struct channel_parameters *own)
{
    return own->lists_gain && is_open(&own->gain);
}

/* Of a record, an input or output whose size the others do not tell. A sensor that is known has a place and a gain: what others show predicts it. */
static const char *alone_in(const struct diagnosis *d, size_t r)
{
    const struct model *model = d->model;
    for (size_t i = 0; i < model->n_inputs; i++) {
        const struct model_input *input = &model->inputs[i];
        const bool moment = input->kind == INPUT_PATCH_MOMENT && is_open(&model->KB);
        if ((moment || gain_is_open(&input->own)) && is_alone(d, r, input->name))
            return input->name;
    }
    for (size_t o = 0; o < model->n_outputs; o++) {
        const struct model_output *output = &model->outputs[o];
        const bool strain = output->kind == OUTPUT_PATCH_STRAIN && is_open(&model->Ks);
        if ((strain || gain_is_open(&output->own)) && is_alone(d, r, output->name))
            return output->name;
    }
    return NULL;
}

/* Records were not held out, and there are some to leave out. */
static bool is_crossed(const struct diagnosis *d)
{
    return d->n_checks == 0 && d->n_records >= 2;
}

const char *diagnose_alone(const struct diagnosis *d, size_t *record)
{
    const char *name = NULL;
    if (!is_crossed(d))
        return NULL;
    for (*record = 0; *record < d->n_records; (*record)++)
        if ((name = alone_in(d, *record)) != NULL)
            return name;
    return NULL;
}

/* ---- The records of a fold, and the others ---- */

static void set_free(struct record_set *set)
{
    free(set->records), free(set->names), free(set->sigma), free(set->channel);
}

/* Channels are in the order of the records, so those of some records are in the same order. */
static struct record_set set_new(const struct diagnose_state *w, size_t fold, bool left_out)
{
    const struct diagnosis *d = w->d;
    const size_t n_folds = folds(d);
    struct record_set set = {.records = bf_alloc(d->n_records, sizeof *set.records),
                             .names = bf_alloc(d->n_records, sizeof *set.names),
                             .sigma = bf_alloc(d->n_channels, sizeof *set.sigma),
                             .channel = bf_alloc(d->n_channels, sizeof *set.channel)};
    for (size_t r = 0; r < d->n_records; r++) {
        if ((r % n_folds == fold) != left_out)
            continue;
        set.names[set.n] = record_base_name(&d->records[r]);
        set.records[set.n++] = d->records[r];
    }
    for (size_t c = 0; c < d->n_channels; c++) {
        if ((d->baseline.fit.channels[c].record % n_folds == fold) != left_out)
            continue;
        set.sigma[set.n_channels] = w->sigma[c];
        set.channel[set.n_channels++] = c;
    }
    return set;
}

/* ---- One fold ---- */

/*
 * What was estimated in all records is estimated again: a refit frees places that the model holds. sd: of the model's parameters
 * with the records kept, as all records know them; free().
 */
static double *free_estimated(const struct diagnosis *d, const struct hypothesis *h, const struct record_set *kept,
                              struct model *model)
{
    const char **names = record_base_names(d->records, d->n_records);
    struct parameter_ref *all, *some;
    const size_t n = model_parameters(&h->model, names, d->n_records, &all),
                 m = model_parameters(model, kept->names, kept->n, &some);
    double *sd = bf_alloc(m, sizeof *sd);
    for (size_t i = 0, j = 0; i < n; i++) {
        if (all[i].role == ROLE_EFFECT && h->fit.estimated[i])
            model->effects[all[i].owner].parameters[all[i].slot].fixed = false;
        if (j < m && strcmp(all[i].label, some[j].label) == 0) /* the same order, without the values of the others */
            sd[j++] = h->fit.sd[i];
    }
    free(all), free(some), free(names);
    return sd;
}

/* Values of one record alone, such as a phase, are not known of a record left out. */
static void forget_own(struct model *model, const struct record_set *out)
{
    for (size_t e = 0; e < model->n_effects; e++) {
        struct model_effect *effect = &model->effects[e];
        size_t kept = 0;
        for (size_t i = 0; i < effect->n_per_record; i++) {
            bool known = true;
            for (size_t r = 0; r < out->n; r++)
                known = known && strcmp(effect->per_record[i].record, out->names[r]) != 0;
            if (known)
                effect->per_record[kept++] = effect->per_record[i];
        }
        effect->n_per_record = kept;
    }
}

static enum bf_status refit_without(const struct diagnose_state *w, const struct record_set *kept, int threads,
                                    struct model *model, struct fold_job *job, struct bf_error *err)
{
    double *sd = free_estimated(w->d, job->h, kept, model);
    const struct refit_options options = {.sigma = kept->sigma,
                                          .threads = threads,
                                          .near = true,
                                          .known_sd = job->h->n_effects > 1 ? NULL : sd,
                                          .first_new = model->n_effects,
                                          .predict = w->options->predict};
    struct refit_result fit;
    const enum bf_status status = refit_run(model, kept->records, kept->n, &options, &fit, err);
    free(sd);
    if (status)
        return status;
    refit_into_model(kept->records, kept->n, fit.value, NULL, model);
    job->evaluations = fit.evaluations;
    refit_free(&fit);
    return BF_OK;
}

static enum bf_status predict_left_out(const struct diagnose_state *w, const struct record_set *out, int threads,
                                       const struct model *model, struct fold_job *job, struct bf_error *err)
{
    struct fit_options options = {.quiet = true, .sigma = out->sigma, .predict = w->options->predict};
    struct own_values own;
    options.predict.threads = threads;
    options.predict.quiet = true;
    enum bf_status status = own_values_find(model, out->records, out->n, &options, &own, err);
    if (!status)
        status = fit_errors(own.model, out->records, out->n, &options, &job->channels, &job->n_channels, err);
    own_values_free(&own);
    return status;
}

static void run_fold(const struct diagnose_state *w, struct fold_job *job, int threads)
{
    struct record_set kept = set_new(w, job->fold, false), out = set_new(w, job->fold, true);
    struct model model;
    struct bf_error err;
    enum bf_status status = model_copy(&job->h->model, &model, &err);
    if (!status) {
        forget_own(&model, &out);
        status = refit_without(w, &kept, threads, &model, job, &err);
        if (!status && !progress_interrupted())
            status = predict_left_out(w, &out, threads, &model, job, &err);
        model_free(&model);
    }
    job->failed = status != BF_OK && !progress_interrupted();
    job->done = !status && !progress_interrupted();
    set_free(&kept), set_free(&out);
}

/* ---- All folds of some hypotheses, on all threads ---- */

static void *work(void *argument)
{
    struct fold_queue *queue = argument;
    struct diagnose_state *w = queue->w;
    (void)pthread_mutex_lock(&queue->lock);
    while (queue->next < queue->n && !progress_interrupted()) {
        struct fold_job *job = &queue->jobs[queue->next++];
        const size_t left = queue->n - queue->next + 1;
        const int threads = left >= (size_t)w->threads ? 1 : w->threads / (int)left;
        (void)pthread_mutex_unlock(&queue->lock);
        run_fold(w, job, threads);
        (void)pthread_mutex_lock(&queue->lock);
        w->d->evaluations += job->evaluations;
        queue->finished++;
        if (w->bar)
            progress_update(w->bar, queue->begin + queue->span * (double)queue->finished / (double)queue->n,
                            "leaving each record out");
    }
    (void)pthread_mutex_unlock(&queue->lock);
    return NULL;
}

static void run_jobs(struct diagnose_state *w, struct fold_job jobs[], size_t n, double span)
{
    struct fold_queue queue = {.w = w, .jobs = jobs, .n = n, .begin = w->done, .span = span};
    (void)pthread_mutex_init(&queue.lock, NULL);
    workers_run(w->threads, n, work, &queue);
    (void)pthread_mutex_destroy(&queue.lock);
    w->done += span;
}

/* The channels of all records from those of the folds. */
static void gather(const struct diagnose_state *w, const struct fold_job jobs[], struct hypothesis *h)
{
    const struct diagnosis *d = w->d;
    const size_t n_folds = folds(d);
    struct fit_channel_error *all = bf_alloc(d->n_channels, sizeof *all);
    size_t done = 0, found = 0;
    for (size_t fold = 0; fold < n_folds; fold++) {
        const struct fold_job *job = &jobs[fold];
        struct record_set out = set_new(w, fold, true);
        h->cross_failed = h->cross_failed || job->failed;
        done += job->done && job->n_channels == out.n_channels;
        for (size_t c = 0; job->done && c < out.n_channels && c < job->n_channels; c++, found++) {
            all[out.channel[c]] = job->channels[c];
            all[out.channel[c]].record += fold * d->n_records; /* it counts the fold's own records */
        }
        set_free(&out);
    }
    if (done == n_folds && found == d->n_channels) {
        hypothesis_take_check(h, all, d->noise, d->n_channels);
        w->d->check_kind = CHECK_CROSS;
    }
    free(all);
}

static void cross_validate(struct diagnose_state *w, struct hypothesis *const hypotheses[], size_t n, double span)
{
    const size_t n_folds = folds(w->d);
    struct fold_job *jobs = bf_alloc(n * n_folds, sizeof *jobs);
    for (size_t i = 0; i < n; i++)
        for (size_t fold = 0; fold < n_folds; fold++)
            jobs[i * n_folds + fold] = (struct fold_job){.h = hypotheses[i], .fold = fold};
    run_jobs(w, jobs, n * n_folds, span);
    for (size_t i = 0; i < n; i++)
        gather(w, jobs + i * n_folds, hypotheses[i]);
    for (size_t i = 0; i < n * n_folds; i++)
        free(jobs[i].channels);
    free(jobs);
}

/* ---- Which hypotheses are cross-validated ---- */

static bool lacks_check(const struct hypothesis *h)
{
    return h->refitted && h->check.n_channels == 0 && !h->cross_failed;
}

/* What is named; where nothing is, the best, if it could be: a record that was left out may confirm it. */
static size_t wanted(const struct diagnosis *d, struct hypothesis *out[], size_t room)
{
    static const double could_be = 0.3; /* probability */
    size_t n = 0;
    for (size_t i = 0; i < d->n_hypotheses && n < room; i++) {
        const bool named = d->n_named > 0 && (i == 0 || d->hypotheses[i].rival);
        const bool likely = d->verdict == VERDICT_UNKNOWN && d->hypotheses[i].probability > could_be;
        if ((named || likely) && lacks_check(&d->hypotheses[i]))
            out[n++] = &d->hypotheses[i];
    }
    return n;
}

void diagnose_cross(struct diagnose_state *w, double span)
{
    struct diagnosis *d = w->d;
    struct hypothesis *chosen[1 + MOST_CHECKED] = {&d->baseline};
    size_t n = 1, checked = 0, record;
    if (!is_crossed(d) || diagnose_alone(d, &record) != NULL)
        return;
    for (;;) {
        const size_t more = wanted(d, chosen + n, MOST_CHECKED - checked);
        if (more == 0)
            return;
        span *= 0.5;
        cross_validate(w, chosen, n + more, span);
        checked += more, n = 0;
        d->interrupted = progress_interrupted();
        diagnose_rank(d, w->n_tried);
        diagnose_decide(d);
        if (d->interrupted)
            return;
    }
}
