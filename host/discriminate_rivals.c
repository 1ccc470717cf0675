/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The rivals as whole models: refitted to the records so far, or at typical strengths that matter alike. */
#include "discriminate_work.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "candidate.h"
#include "refit.h"

/* Without records: each effect changes the reference response by this many times the noise (rms, baseline refitted). */
static const double typical_change = 1.0;
enum { SCALE_ROUNDS = 5 };
/* χ²/n: a rival that leaves five times the noise is ruled out by the present records; its last digits do not matter. */
static const double ruled_out = 25.0;
static const double largest_factor = 1e3; /* of one round */

/* The first channel set that the catalogue proposes for the effect; strengths at `scale` times their start. */
static enum bf_status with_effect(const struct model *base, const struct beam_effect *effect,
                                  const struct record records[], size_t n_records, double scale, struct model *out,
                                  struct bf_error *err)
{
    struct candidate_list list;
    const struct candidate *found = NULL;
    enum bf_status status = candidate_list_new(base, records, n_records, NULL, &list, err);
    if (status)
        return status;
    for (size_t i = 0; i < list.n && found == NULL; i++)
        if (list.candidates[i].effect == effect && list.candidates[i].channel[0] == '\0')
            found = &list.candidates[i];
    if (found != NULL) {
        double p[BEAM_EFFECT_PARAMETERS];
        for (int j = 0; j < effect->n_parameters; j++) {
            const double factor = found->role[j] == CANDIDATE_STRENGTH  ? scale
                                  : found->role[j] == CANDIDATE_INVERSE ? 1.0 / scale
                                                                        : 1.0;
            p[j] = fmin(fmax(found->start[j] * factor, found->lower[j]), found->upper[j]);
        }
        status = candidate_model(base, found, p, out, err);
    } else {
        const char *reason = "it has no place there";
        for (size_t i = 0; i < list.n_refused; i++)
            if (list.refused[i].effect == effect)
                reason = list.refused[i].reason;
        status = bf_fail(err, BF_USAGE, "effect %s cannot act on this model: %s", effect->id, reason);
    }
    candidate_list_free(&list);
    return status;
}

static enum bf_status rival_model(const struct model *base, const struct discriminate_rival *rival,
                                  const struct record records[], size_t n_records, double scale, struct model *out,
                                  struct bf_error *err)
{
    enum bf_status status = model_copy(rival->model != NULL ? rival->model : base, out, err);
    for (size_t e = 0; rival->model == NULL && e < rival->n_effects && !status; e++) {
        struct model grown = {0};
        status = with_effect(out, rival->effects[e], records, n_records, scale, &grown, err);
        if (!status) {
            model_free(out);
            *out = grown;
        }
    }
    return status;
}

/* ---- With records ---- */

struct refit_task {
    const struct discriminate_work *w;
    size_t rival, first_new;
    enum bf_status status;
    struct bf_error err;
    pthread_t thread;
    bool started;
};

static void keep_fit(const struct discriminate_work *w, size_t rival, const struct refit_result *fit)
{
    struct model *model = &w->d->models[rival];
    struct parameter_ref *refs;
    const char **names = bf_alloc(w->n_records, sizeof *names);
    for (size_t r = 0; r < w->n_records; r++)
        names[r] = record_base_name(&w->records[r]);
    const size_t n = model_parameters(model, names, w->n_records, &refs);
    model_set_parameters(model, refs, n, fit->value, fit->sd, names);
    w->half_square[rival] = fit->half_square;
    w->d->noise_ratio[rival] = fit->noise_ratio;
    free(refs), free(names);
}

static void *refit(void *argument)
{
    struct refit_task *task = argument;
    const struct discriminate_work *w = task->w;
    struct model *model = &w->d->models[task->rival];
    const struct refit_options options = {.sigma = w->sigma,
                                          .threads = 1,
                                          .abandon_above = ruled_out,
                                          .first_new = task->first_new,
                                          .predict = w->options->predict};
    struct refit_result fit = {0};
    task->status = refit_run(model, w->records, w->n_records, &options, &fit, &task->err);
    if (!task->status)
        keep_fit(w, task->rival, &fit);
    refit_free(&fit);
    if (!task->status)
        task->status = present_information(w, model, &w->information[task->rival], &task->err);
    return NULL;
}

enum bf_status rivals_refit(struct discriminate_work *w, const struct discriminate_rival rivals[], struct bf_error *err)
{
    struct discrimination *d = w->d;
    struct refit_task tasks[DISCRIMINATE_RIVALS];
    memset(tasks, 0, sizeof tasks);
    for (size_t i = 0; i < d->n_rivals; i++) {
        const enum bf_status status =
            rival_model(w->baseline, &rivals[i], w->records, w->n_records, 1.0, &d->models[i], err);
        if (status)
            return status;
        tasks[i] = (struct refit_task){
            .w = w, .rival = i, .first_new = rivals[i].model ? d->models[i].n_effects : w->baseline->n_effects};
    }
    for (size_t i = 0; i < d->n_rivals; i++) {
        tasks[i].started = w->options->threads != 1 && i + 1 < d->n_rivals &&
                           pthread_create(&tasks[i].thread, NULL, refit, &tasks[i]) == 0;
        if (!tasks[i].started)
            (void)refit(&tasks[i]);
    }
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < d->n_rivals; i++) {
        if (tasks[i].started)
            (void)pthread_join(tasks[i].thread, NULL);
        if (tasks[i].status && !status)
            status = bf_fail(err, tasks[i].status, "refit with %s: %s", d->names[i], tasks[i].err.text);
    }
    return status;
}

/* ---- Without ---- */

/* The baseline under the reference drive. */
struct reference {
    struct record record;     /* as the baseline would give it: what ranges of thresholds and time constants refer to */
    struct forecast forecast; /* whitened */
    struct whitener *whiteners; /* [n_outputs + n_sensors] */
    double *H;
};

/* What a refit of the baseline could not absorb of the effect, in the present sensors: Σ over whitened rows. */
static enum bf_status change(const struct discriminate_work *w, const struct reference *reference,
                             const struct model *model, double *out, struct bf_error *err)
{
    struct forecast forecast;
    double *evidence = bf_alloc(w->d->n_sensors + 1, sizeof *evidence);
    enum bf_status status = forecast_make(w, model, reference_drive(w), false, &forecast, err);
    if (!status) {
        forecast_whiten(w, reference->whiteners, &forecast);
        status = pair_evidence(w, &forecast, &reference->forecast, reference->H, evidence, err);
    }
    *out = evidence[w->d->n_sensors];
    forecast_free(&forecast);
    free(evidence);
    return status;
}

static enum bf_status scale_rival(const struct discriminate_work *w, const struct reference *reference,
                                  const struct discriminate_rival *rival, struct model *out, struct bf_error *err)
{
    const double wanted = typical_change * typical_change * (double)(w->n_outputs * w->n);
    double scale = 1.0;
    enum bf_status status = rival_model(w->baseline, rival, &reference->record, 1, scale, out, err);
    for (int round = 0; round < SCALE_ROUNDS && !status && rival->model == NULL; round++) {
        double found;
        status = change(w, reference, out, &found, err);
        if (status || found <= 0.0)
            break;
        scale *= fmin(fmax(sqrt(wanted / found), 1.0 / largest_factor), largest_factor);
        struct model again;
        status = rival_model(w->baseline, rival, &reference->record, 1, scale, &again, err);
        if (!status) {
            model_free(out);
            *out = again;
        }
    }
    return status;
}

static enum bf_status make_reference(const struct discriminate_work *w, struct reference *r, struct bf_error *err)
{
    const struct drive *drive = reference_drive(w);
    enum bf_status status = forecast_make(w, w->baseline, drive, true, &r->forecast, err);
    if (status)
        return status;
    const size_t n = r->forecast.n_parameters;
    menu_record(w, drive, false, &r->record);
    for (size_t o = 0; o < w->n_outputs; o++)
        record_add_column(&r->record, w->baseline->outputs[o].name, r->forecast.y + o * w->n);
    r->whiteners = bf_alloc(w->n_outputs + w->d->n_sensors, sizeof *r->whiteners);
    noise_of_experiment(w, &r->forecast, 1, r->whiteners);
    forecast_whiten(w, r->whiteners, &r->forecast);
    r->H = bf_alloc(n * n, sizeof *r->H);
    forecast_information(w, &r->forecast, NULL, drive, r->H);
    return BF_OK;
}

enum bf_status rivals_scaled(struct discriminate_work *w, const struct discriminate_rival rivals[],
                             struct bf_error *err)
{
    struct reference reference = {0};
    enum bf_status status = make_reference(w, &reference, err);
    for (size_t i = 0; i < w->d->n_rivals && !status; i++)
        status = scale_rival(w, &reference, &rivals[i], &w->d->models[i], err);
    forecast_free(&reference.forecast);
    record_free(&reference.record);
    free(reference.whiteners), free(reference.H);
    return status;
}
