/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The rivals as whole models: refitted to the records so far, or at typical strengths that matter alike. */
#include "discriminate_state.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "estimate/estimate.h"

/* Without records: each effect changes the reference response by this many times the noise (rms, baseline refitted). */
static const double typical_change = 1.0;
enum { SCALE_ROUNDS = 5 };
/* χ²/n: a rival that leaves five times the noise is ruled out by the present records; its last digits do not matter. */
static const double ruled_out = 25.0;
static const double largest_factor = 1e3; /* of one round */

/* names: all of them, "a, b". */
static bool is_channel(const struct model *model, bool input, const char *channel, char *names, size_t size)
{
    const size_t n = input ? model->n_inputs : model->n_outputs;
    bool found = false;
    size_t used = 0;
    for (size_t i = 0; i < n; i++) {
        const char *name = input ? model->inputs[i].name : model->outputs[i].name;
        found = found || strcmp(name, channel) == 0;
        if (used < size)
            used += (size_t)snprintf(names + used, size - used, "%s%s", i > 0 ? ", " : "", name);
    }
    return found;
}

static enum bf_status check_channel(const struct model *model, const struct beam_effect *effect, const char *channel,
                                    struct bf_error *err)
{
    char names[512] = "";
    const bool input = effect->channels == BEAM_CHANNELS_PATCH_INPUT || effect->channels == BEAM_CHANNELS_POINT_INPUT;
    if (effect->channels == BEAM_CHANNELS_NONE)
        return bf_fail(err, BF_USAGE, "%s@%.60s: %s acts on the beam, not on a channel; leave out @%.60s", effect->id,
                       channel, effect->id, channel);
    if (!is_channel(model, input, channel, names, sizeof names))
        return bf_fail(err, BF_USAGE, "%s@%.60s: the model has no such %s; it has %s", effect->id, channel,
                       input ? "input" : "output", names);
    return BF_OK;
}

/* On the channel, or on the effect's default channels (NULL); *named: there are candidates on single channels. */
static const struct candidate *find_candidate(const struct candidate_list *list, const struct beam_effect *effect,
                                              const char *channel, bool *named)
{
    const struct candidate *whole = NULL, *found = NULL;
    *named = false;
    for (size_t i = 0; i < list->n; i++) {
        const struct candidate *c = &list->candidates[i];
        if (c->effect != effect)
            continue;
        if (c->channel[0] == '\0')
            whole = c;
        else
            *named = true;
        if (channel != NULL && strcmp(c->channel, channel) == 0)
            found = c;
    }
    return found != NULL ? found : whole;
}

static enum bf_status no_candidate(const struct candidate_list *list, const struct beam_effect *effect, bool named,
                                   struct bf_error *err)
{
    if (named)
        return bf_fail(err, BF_USAGE, "effect %s has no default channel in this model; name one: %s@CHANNEL",
                       effect->id, effect->id);
    const char *reason = "it has no place there";
    for (size_t i = 0; i < list->n_refused; i++)
        if (list->refused[i].effect == effect)
            reason = list->refused[i].reason;
    return bf_fail(err, BF_USAGE, "effect %s cannot act on this model: %s", effect->id, reason);
}

/* The effect at its channel, or at its default ones; strengths at `scale` times their start. */
static enum bf_status with_effect(const struct model *base, const struct beam_effect *effect, const char *channel,
                                  const struct record records[], size_t n_records, double scale, struct model *out,
                                  struct bf_error *err)
{
    static const struct candidate_options each = {.each_channel = true};
    struct candidate_list list;
    bool named;
    enum bf_status status = channel != NULL ? check_channel(base, effect, channel, err) : BF_OK;
    if (!status)
        status = candidate_list_new(base, records, n_records, &each, &list, err);
    if (status)
        return status;
    const struct candidate *found = find_candidate(&list, effect, channel, &named);
    if (found != NULL) {
        struct candidate chosen = *found;
        double p[BEAM_EFFECT_PARAMETERS];
        if (channel != NULL)
            (void)snprintf(chosen.channel, sizeof chosen.channel, "%s", channel);
        for (int j = 0; j < effect->n_parameters; j++) {
            const double factor = found->role[j] == CANDIDATE_STRENGTH  ? scale
                                  : found->role[j] == CANDIDATE_INVERSE ? 1.0 / scale
                                                                        : 1.0;
            p[j] = fmin(fmax(found->start[j] * factor, found->lower[j]), found->upper[j]);
        }
        status = candidate_model(base, &chosen, p, out, err);
    } else {
        status = no_candidate(&list, effect, named, err);
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
        status = with_effect(out, rival->effects[e], rival->channels[e], records, n_records, scale, &grown, err);
        if (!status) {
            model_free(out);
            *out = grown;
        }
    }
    return status;
}

/* ---- With records ---- */

struct refit_task {
    const struct discriminate_state *w;
    size_t rival, first_new;
    enum bf_status status;
    struct bf_error err;
    pthread_t thread;
    bool started;
};

static void keep_fit(const struct discriminate_state *w, size_t rival, const struct refit_result *fit)
{
    struct model *model = &w->d->models[rival];
    refit_into_model(w->records, w->n_records, fit->value, fit->sd, model);
    w->half_square[rival] = fit->half_square;
    w->d->noise_ratio[rival] = fit->noise_ratio;
}

static void *refit(void *argument)
{
    struct refit_task *task = argument;
    const struct discriminate_state *w = task->w;
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

enum bf_status rivals_refit(struct discriminate_state *w, const struct discriminate_rival rivals[],
                            struct bf_error *err)
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
static enum bf_status change(const struct discriminate_state *w, const struct reference *reference,
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

static enum bf_status scale_rival(const struct discriminate_state *w, const struct reference *reference,
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

static enum bf_status make_reference(const struct discriminate_state *w, struct reference *r, struct bf_error *err)
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

enum bf_status rivals_scaled(struct discriminate_state *w, const struct discriminate_rival rivals[],
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
