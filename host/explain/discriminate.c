/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The order of work: noise, rivals, every drive of the menu on all threads, the choice. */
#include "discriminate_state.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "estimate/estimate.h"
#include "ground/ground.h"

/* An added sensor is proposed when it multiplies the evidence by at least this: putting it on takes an afternoon. */
static const double sensor_worth = 1.5;

static double now_s(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- All drives ---- */

struct drive_queue {
    struct discriminate_state *w;
    struct experiment *experiments; /* [n_drives][n_sensors + 1] */
    bool *usable;                   /* [n_drives] */
    size_t next, done;
    struct progress *bar;
    struct bf_error err; /* of the last drive that failed */
    pthread_mutex_t lock;
};

static void *work(void *argument)
{
    struct drive_queue *queue = argument;
    const struct discrimination *d = queue->w->d;
    (void)pthread_mutex_lock(&queue->lock);
    while (queue->next < d->n_drives && !progress_interrupted()) {
        const size_t drive = queue->next++;
        struct bf_error err;
        (void)pthread_mutex_unlock(&queue->lock);
        const enum bf_status status =
            drive_experiments(queue->w, drive, queue->experiments + drive * (d->n_sensors + 1), &err);
        (void)pthread_mutex_lock(&queue->lock);
        queue->usable[drive] = status == BF_OK;
        if (status)
            queue->err = err;
        queue->done++;
        if (queue->bar)
            progress_update(queue->bar, 0.5 + 0.5 * (double)queue->done / (double)d->n_drives, d->drives[drive].name);
    }
    (void)pthread_mutex_unlock(&queue->lock);
    return NULL;
}

static void run_queue(struct drive_queue *queue)
{
    (void)pthread_mutex_init(&queue->lock, NULL);
    workers_run(queue->w->options->threads, queue->w->d->n_drives, work, queue);
    (void)pthread_mutex_destroy(&queue->lock);
}

static int by_evidence(const void *a, const void *b)
{
    const struct experiment *x = a, *y = b;
    if (x->evidence != y->evidence)
        return x->evidence < y->evidence ? 1 : -1;
    return x->drive != y->drive ? (x->drive > y->drive ? 1 : -1) : (x->sensor > y->sensor) - (x->sensor < y->sensor);
}

static enum bf_status all_drives(struct discriminate_state *w, struct progress *bar, struct bf_error *err)
{
    struct discrimination *d = w->d;
    const size_t sets = d->n_sensors + 1;
    struct drive_queue queue = {.w = w, .bar = bar, .err = {BF_NUMERIC, "interrupted"}};
    queue.experiments = bf_alloc(d->n_drives * sets, sizeof *queue.experiments);
    queue.usable = bf_alloc(d->n_drives, sizeof *queue.usable);
    run_queue(&queue);
    for (size_t i = 0; i < d->n_drives * sets; i++) {
        if (queue.usable[i / sets])
            queue.experiments[d->n++] = queue.experiments[i];
        else
            free(queue.experiments[i].pairs);
    }
    for (size_t i = 0; i < d->n_drives; i++)
        d->n_failed += !queue.usable[i];
    free(queue.usable);
    d->experiments = queue.experiments;
    if (d->n == 0)
        return bf_fail(err, BF_NUMERIC, "no experiment of the menu can be predicted: %s", queue.err.text);
    qsort(d->experiments, d->n, sizeof *d->experiments, by_evidence);
    return BF_OK;
}

/* Within the limits; another sensor only where that is worth it. */
static void choose(struct discrimination *d)
{
    size_t plain = d->n, sensor = d->n;
    for (size_t i = d->n; i-- > 0;) {
        const struct experiment *x = &d->experiments[i];
        if (d->drives[x->drive].beyond)
            continue;
        *(x->sensor == d->n_sensors ? &plain : &sensor) = i;
    }
    d->best = plain < d->n ? plain : sensor < d->n ? sensor : 0;
    if (plain < d->n && sensor < d->n &&
        d->experiments[sensor].evidence > sensor_worth * d->experiments[plain].evidence)
        d->best = sensor;
}

/* ---- Rivals ---- */

static void present_pairs(const struct discriminate_state *w)
{
    struct discrimination *d = w->d;
    size_t p = 0;
    d->present = bf_alloc(d->n_pairs, sizeof *d->present);
    for (size_t a = 0; a < d->n_rivals; a++)
        for (size_t b = a + 1; b < d->n_rivals; b++, p++) {
            const double evidence = 2.0 * fabs(w->half_square[a] - w->half_square[b]);
            d->present[p] = (struct discriminate_pair){a, b, evidence, 0.5 * erfc(sqrt(evidence / 8.0))};
        }
}

/* A baseline that was never fitted is fitted first, as `diagnose` does. */
static enum bf_status fitted_baseline(struct discriminate_state *w, struct model *own, struct bf_error *err)
{
    if (w->n_records == 0 || w->baseline->fit.n_records > 0)
        return BF_OK;
    const struct fit_options options = {
        .quiet = true, .never_search = true, .sigma = w->sigma, .predict = w->options->predict};
    static const struct fit_check nothing_held_out;
    struct fit_result fit;
    enum bf_status status = fit_run(w->baseline, w->records, w->n_records, &options, &fit, err);
    if (status)
        return status;
    status = model_copy(w->baseline, own, err);
    if (!status) {
        fit_into_model(&fit, w->records, &nothing_held_out, own);
        w->baseline = own;
    }
    fit_free(&fit);
    return status;
}

static enum bf_status make_rivals(struct discriminate_state *w, const struct discriminate_rival rivals[],
                                  struct bf_error *err)
{
    struct discrimination *d = w->d;
    if (w->n_records > 0) {
        const enum bf_status status = rivals_refit(w, rivals, err);
        if (!status)
            present_pairs(w);
        return status;
    }
    bool guessed = false;
    for (size_t i = 0; i < d->n_rivals; i++)
        guessed = guessed || rivals[i].model == NULL;
    if (guessed) {
        d->warning = bf_alloc(2 * DISCRIMINATE_NAME, 1);
        (void)snprintf(
            d->warning, 2 * DISCRIMINATE_NAME,
            "no records were given: effects have strengths that change the response to '%.100s' by as much as "
            "the noise, and nothing is known of their parameters; give the records that cannot tell them apart",
            reference_drive(w)->name);
    }
    return rivals_scaled(w, rivals, err);
}

static enum bf_status check_rivals(const struct model *baseline, const struct discriminate_rival rivals[], size_t n,
                                   struct bf_error *err)
{
    if (n < 2)
        return bf_fail(err, BF_USAGE, "give at least two rival effects: one alone has nothing to be told apart from");
    if (n > DISCRIMINATE_RIVALS)
        return bf_fail(err, BF_USAGE, "%zu rivals; at most %d can be compared", n, DISCRIMINATE_RIVALS);
    for (size_t i = 0; i < n; i++) {
        const struct model *model = rivals[i].model;
        for (size_t k = 0; k < i; k++)
            if (strcmp(rivals[i].name, rivals[k].name) == 0)
                return bf_fail(err, BF_USAGE, "%s stands there twice", rivals[i].name);
        if (model == NULL)
            continue;
        bool same = model->n_inputs == baseline->n_inputs && model->n_outputs == baseline->n_outputs;
        for (size_t c = 0; same && c < model->n_inputs; c++)
            same = strcmp(model->inputs[c].name, baseline->inputs[c].name) == 0;
        for (size_t c = 0; same && c < model->n_outputs; c++)
            same = strcmp(model->outputs[c].name, baseline->outputs[c].name) == 0;
        if (!same)
            return bf_fail(err, BF_USAGE, "%s: the model's inputs and outputs are not those of %s",
                           model->path ? model->path : rivals[i].name,
                           baseline->path ? baseline->path : "the baseline");
    }
    return BF_OK;
}

static void prepare(struct discriminate_state *w, const struct discriminate_rival rivals[], size_t n)
{
    struct discrimination *d = w->d;
    d->n_rivals = n;
    d->n_pairs = n * (n - 1) / 2;
    d->names = bf_alloc(n, sizeof *d->names);
    d->models = bf_alloc(n, sizeof *d->models);
    d->noise_ratio = bf_alloc(n, sizeof *d->noise_ratio);
    w->information = bf_alloc(n, sizeof *w->information);
    w->half_square = bf_alloc(n, sizeof *w->half_square);
    for (size_t i = 0; i < n; i++) {
        (void)snprintf(d->names[i], sizeof d->names[i], "%s", rivals[i].name);
        d->noise_ratio[i] = (double)NAN;
    }
}

static enum bf_status run(struct discriminate_state *w, const struct discriminate_rival rivals[], struct progress *bar,
                          struct bf_error *err)
{
    struct discrimination *d = w->d;
    struct model own = {0};
    enum bf_status status = menu_make(w, err);
    if (!status)
        status = noise_from_records(w, err);
    if (!status)
        status = fitted_baseline(w, &own, err);
    if (bar)
        progress_update(bar, 0.1, "refitting the rivals");
    if (!status)
        status = make_rivals(w, rivals, err);
    if (!status)
        status = all_drives(w, bar, err);
    if (!status) {
        choose(d);
        menu_record(w, &d->drives[d->experiments[d->best].drive], false, &d->signal);
        d->text = discriminate_words(d, w);
    }
    model_free(&own);
    return status;
}

enum bf_status discriminate_run(const struct model *baseline, const struct discriminate_rival rivals[], size_t n_rivals,
                                const struct record records[], size_t n_records,
                                const struct discriminate_options *options, struct discrimination *out,
                                struct bf_error *err)
{
    const double begin = now_s();
    struct discriminate_state w = {
        .d = out, .options = options, .baseline = baseline, .records = records, .n_records = n_records};
    *out = (struct discrimination){0};
    enum bf_status status = check_rivals(baseline, rivals, n_rivals, err);
    if (status)
        return status;
    prepare(&w, rivals, n_rivals);
    struct progress *bar = options->quiet ? NULL : progress_begin("discriminate");
    status = run(&w, rivals, bar, err);
    if (bar)
        progress_end(bar);
    for (size_t i = 0; i < n_rivals; i++)
        free(w.information[i]);
    free(w.information), free(w.half_square), free(w.noise), free(w.sigma);
    out->seconds = now_s() - begin;
    return status;
}

void discrimination_free(struct discrimination *d)
{
    for (size_t i = 0; d->models != NULL && i < d->n_rivals; i++)
        model_free(&d->models[i]);
    for (size_t i = 0; i < d->n; i++)
        free(d->experiments[i].pairs);
    free(d->names), free(d->models), free(d->noise_ratio), free(d->present), free(d->drives), free(d->sensors);
    free(d->experiments), free(d->text), free(d->warning);
    record_free(&d->signal);
    *d = (struct discrimination){0};
}
