/* SPDX-License-Identifier: GPL-3.0-or-later */
/* watch_jobs.c — what the page of `beamfit watch` can ask for: compare, pick records, fit, diagnose, add, undo, save. */
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "watch.h"

enum { STEPS_SHOWN = 4, CHANNELS_SHOWN = 12 };

static struct watch_step *last_step(const struct watch *w)
{
    return w->steps[w->n_steps - 1];
}

static void say(struct watch *w, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void say(struct watch *w, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    pthread_mutex_lock(&w->lock);
    (void)vsnprintf(w->said, sizeof w->said, format, args);
    pthread_mutex_unlock(&w->lock);
    va_end(args);
}

/* ---- Records ---- */

static enum bf_status select_records(struct watch *w, struct bf_error *err)
{
    size_t n = 0;
    for (size_t i = 0; i < w->n_records; i++)
        if (w->use[i] == WATCH_FIT)
            w->selected[n++] = w->records[i];
    w->n_fitted = n;
    for (size_t i = 0; i < w->n_records; i++)
        if (w->use[i] == WATCH_CHECK)
            w->selected[n++] = w->records[i];
    w->n_held_out = n - w->n_fitted;
    if (n == 0)
        return bf_fail(err, BF_USAGE, "choose at least one record");
    return BF_OK;
}

/* ---- What is shown ---- */

static void take_errors(struct watch_step *step, const struct comparison *c)
{
    step->nrmse = c->nrmse;
    step->noise_ratio = c->noise_ratio;
    step->check_nrmse = c->check_nrmse;
    step->check_noise_ratio = c->check_noise_ratio;
}

static char *curves_text(const struct explanations *e, size_t *n)
{
    static const double bytes_here = 24e6; /* on this machine: every sample of most records */
    struct curves curves = explanations_curves(e, CHANNELS_SHOWN);
    curves.bytes = bytes_here;
    struct bf_error ignored;
    char *text = NULL;
    FILE *f = open_memstream(&text, n);
    if (f == NULL)
        return NULL;
    (void)json_print_line_and_free(curves_json(&curves), f, &ignored);
    (void)fclose(f);
    return text;
}

/* The last models and what the diagnosis found, on the records chosen; then the page has them. */
static enum bf_status look(struct watch *w, struct bf_error *err)
{
    const size_t from = w->n_steps > STEPS_SHOWN ? w->n_steps - STEPS_SHOWN : 0;
    struct explanations e;
    enum bf_status status = select_records(w, err);
    explanations_begin(&e, w->selected, w->n_fitted + w->n_held_out, w->n_held_out, &w->predict);
    for (size_t i = from; i < w->n_steps && status == BF_OK; i++)
        status = explanations_add(&e, w->steps[i]->name, &w->steps[i]->model, err);
    if (status != BF_OK) {
        explanations_free(&e);
        return status;
    }
    e.before = e.n > 1 ? e.n - 2 : 0;
    const size_t n_steps = e.n;
    if (w->diagnosis != NULL)
        explanations_add_diagnosis(&e, w->diagnosis);
    size_t n = 0;
    char *text = curves_text(&e, &n);
    pthread_mutex_lock(&w->lock);
    for (size_t i = 0; i < n_steps; i++)
        take_errors(w->steps[from + i], e.comparisons[i]);
    explanations_free(&w->explanations);
    w->explanations = e;
    free(w->curves);
    w->curves = text;
    w->n_curves = n;
    w->version++;
    pthread_mutex_unlock(&w->lock);
    return BF_OK;
}

static void forget_diagnosis(struct watch *w)
{
    pthread_mutex_lock(&w->lock);
    for (size_t i = 0; i < w->explanations.n; i++)
        w->explanations.hypothesis[i] = -1;
    struct diagnosis *old = w->diagnosis;
    w->diagnosis = NULL;
    pthread_mutex_unlock(&w->lock);
    if (old != NULL)
        diagnose_free(old);
    free(old);
}

/* ---- Jobs ---- */

static enum bf_status compare(struct watch *w, const char *argument, struct bf_error *err)
{
    (void)argument;
    if (look(w, err) != BF_OK)
        return err->status;
    say(w, "%.3g times the noise is left", last_step(w)->noise_ratio);
    return BF_OK;
}

/* argument: one letter a record: f fitted, c held out, anything else not used. */
static enum bf_status pick(struct watch *w, const char *argument, struct bf_error *err)
{
    if (strlen(argument) != w->n_records || strcspn(argument, "fc") == w->n_records)
        return bf_fail(err, BF_USAGE, "choose at least one record");
    forget_diagnosis(w);
    pthread_mutex_lock(&w->lock);
    for (size_t i = 0; i < w->n_records; i++)
        w->use[i] = argument[i] == 'f' ? WATCH_FIT : argument[i] == 'c' ? WATCH_CHECK : WATCH_OFF;
    pthread_mutex_unlock(&w->lock);
    return compare(w, "", err);
}

static enum bf_status diagnose(struct watch *w, const char *argument, struct bf_error *err)
{
    const struct diagnose_options options = {.predict = w->predict};
    struct diagnosis *d = bf_alloc(1, sizeof *d);
    (void)argument;
    forget_diagnosis(w);
    enum bf_status status = select_records(w, err);
    if (status == BF_OK && w->n_fitted == 0)
        status = bf_fail(err, BF_USAGE, "choose at least one record to fit");
    if (status == BF_OK)
        status = diagnose_run(&last_step(w)->model, w->selected, w->n_fitted, w->selected + w->n_fitted, w->n_held_out,
                              &options, d, err);
    if (status == BF_OK && d->interrupted)
        status = bf_fail(err, BF_NUMERIC, "stopped; nothing was found yet");
    if (status != BF_OK) {
        diagnose_free(d);
        free(d);
        return status;
    }
    say(w, "%.1900s", d->text != NULL ? d->text : verdict_name(d->verdict));
    pthread_mutex_lock(&w->lock);
    w->diagnosis = d;
    pthread_mutex_unlock(&w->lock);
    return look(w, err);
}

/* Fits the model to the records chosen, as `beamfit fit` does, with its errors on those held out. */
static enum bf_status fit(struct watch *w, struct model *model, enum fit_start start, struct bf_error *err)
{
    const struct fit_options options = {.start = start, .predict = w->predict};
    const struct record *held_out = w->selected + w->n_fitted;
    struct fit_check check = {.records = held_out, .n = w->n_held_out};
    struct fit_channel_error *channels = NULL;
    struct own_values own = {0};
    struct fit_result result;
    if (fit_run(model, w->selected, w->n_fitted, &options, &result, err) != BF_OK)
        return err->status;
    enum bf_status status = BF_OK;
    if (result.interrupted)
        status = bf_fail(err, BF_NUMERIC, "stopped; nothing was changed");
    else if (!fit_learned(&result))
        status = bf_fail(err, BF_NO, "nothing was fitted: the records determine none of the free parameters");
    if (status == BF_OK) {
        fit_into_model(&result, w->selected, &check, model);
        status = own_values_find(model, held_out, w->n_held_out, &options, &own, err);
    }
    if (status == BF_OK)
        status = fit_errors(own.model, held_out, w->n_held_out, &options, &channels, &check.n_channels, err);
    if (status == BF_OK) {
        check.channels = channels, check.notes = own.notes, check.n_notes = own.n_notes;
        fit_into_model(&result, w->selected, &check, model);
    }
    free(channels);
    own_values_free(&own);
    fit_free(&result);
    return status;
}

/* The step becomes the model that is looked at; the diagnosis was of another. */
static enum bf_status push(struct watch *w, struct watch_step *step, struct bf_error *err)
{
    forget_diagnosis(w);
    pthread_mutex_lock(&w->lock);
    w->steps = bf_grow(w->steps, w->n_steps + 1, sizeof *w->steps);
    w->steps[w->n_steps++] = step;
    pthread_mutex_unlock(&w->lock);
    return compare(w, "", err);
}

static enum bf_status fit_and_push(struct watch *w, const struct model *from, const char *name, enum fit_start start,
                                   struct bf_error *err)
{
    struct watch_step *step = bf_alloc(1, sizeof *step);
    (void)snprintf(step->name, sizeof step->name, "%.300s", name);
    step->nrmse = step->noise_ratio = step->check_nrmse = step->check_noise_ratio = NAN;
    enum bf_status status = select_records(w, err);
    if (status == BF_OK && w->n_fitted == 0)
        status = bf_fail(err, BF_USAGE, "choose at least one record to fit");
    if (status == BF_OK)
        status = model_copy(from, &step->model, err);
    if (status == BF_OK)
        status = fit(w, &step->model, start, err);
    if (status == BF_OK)
        return push(w, step, err);
    model_free(&step->model);
    free(step);
    return status;
}

static enum bf_status refit(struct watch *w, const char *argument, struct bf_error *err)
{
    char name[WATCH_TEXT];
    (void)argument;
    (void)snprintf(name, sizeof name, "%.280s, fitted", last_step(w)->name);
    return fit_and_push(w, &last_step(w)->model, name, FIT_GIVEN, err);
}

/* argument: the explanation's place in the table. */
static enum bf_status add(struct watch *w, const char *argument, struct bf_error *err)
{
    char name[WATCH_TEXT], *end = NULL;
    const long k = strtol(argument, &end, 10);
    if (end == argument || *end != '\0' || k < 0 || (size_t)k >= w->explanations.n || w->diagnosis == NULL ||
        w->explanations.hypothesis[k] < 0)
        return bf_fail(err, BF_USAGE, "that is no explanation of the last diagnosis; diagnose again");
    (void)snprintf(name, sizeof name, "+ %.300s", w->explanations.names[k]);
    return fit_and_push(w, &w->diagnosis->hypotheses[w->explanations.hypothesis[k]].model, name, FIT_NEAR, err);
}

static enum bf_status undo(struct watch *w, const char *argument, struct bf_error *err)
{
    (void)argument;
    if (w->n_steps < 2)
        return bf_fail(err, BF_USAGE, "this is the model that watch began with");
    forget_diagnosis(w);
    pthread_mutex_lock(&w->lock);
    struct watch_step *gone = w->steps[--w->n_steps];
    pthread_mutex_unlock(&w->lock);
    const enum bf_status status = compare(w, "", err);
    model_free(&gone->model);
    free(gone);
    return status;
}

/* argument: a name without folders; the rule of OUTPUTS (ground.h) holds for it. */
static enum bf_status save(struct watch *w, const char *argument, struct bf_error *err)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    const size_t n = strlen(argument);
    char path[WATCH_TEXT + 600];
    if (n == 0 || n > 100 || strspn(argument, letters) != n || argument[0] == '.' || argument[0] == '-')
        return bf_fail(err, BF_USAGE, "a name has letters, digits, '.', '_', '-', and does not begin with '.' or '-'");
    const bool ends = n > 5 && strcmp(argument + n - 5, ".yaml") == 0;
    (void)snprintf(path, sizeof path, "%.500s/%s%s", w->folder, argument, ends ? "" : ".yaml");
    if (model_write(path, &last_step(w)->model, err) != BF_OK)
        return err->status;
    say(w, "saved as %.300s", path);
    return BF_OK;
}

static const struct {
    const char *name;
    enum bf_status (*run)(struct watch *w, const char *argument, struct bf_error *err);
} jobs[] = {{"compare", compare}, {"pick", pick}, {"diagnose", diagnose}, {"fit", refit},
            {"add", add},         {"undo", undo}, {"save", save}};

bool watch_knows_job(const char *name, const char **known)
{
    for (size_t i = 0; i < sizeof jobs / sizeof *jobs; i++)
        if (strcmp(jobs[i].name, name) == 0) {
            *known = jobs[i].name;
            return true;
        }
    return false;
}

void watch_run_job(struct watch *w, const struct watch_job *job)
{
    struct bf_error err = {BF_OK, ""};
    for (size_t i = 0; i < sizeof jobs / sizeof *jobs; i++)
        if (strcmp(jobs[i].name, job->name) == 0)
            (void)jobs[i].run(w, job->argument, &err);
    pthread_mutex_lock(&w->lock);
    (void)snprintf(w->error, sizeof w->error, "%s", err.status != BF_OK ? err.text : "");
    pthread_mutex_unlock(&w->lock);
}

void watch_free(struct watch *w)
{
    explanations_free(&w->explanations);
    if (w->diagnosis != NULL)
        diagnose_free(w->diagnosis);
    free(w->diagnosis);
    for (size_t i = 0; i < w->n_steps; i++) {
        model_free(&w->steps[i]->model);
        free(w->steps[i]);
    }
    free(w->steps), free(w->use), free(w->selected), free(w->page), free(w->curves);
}
