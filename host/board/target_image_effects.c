/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * target_image_effects.c — which effects of a model a controller can run, and where. What is linear and in the structure
 * stands in the matrices already; laws become ports, filters, maps, signals and drives become uses. An effect whose time or
 * phase begins with a recording cannot be deployed: a controller runs for weeks and has no first sample.
 */
#include "response/response.h"
#include "deployment.h"

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void target_note(struct target_image *image, const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    image->notes = bf_grow(image->notes, image->n_notes + 1, sizeof *image->notes);
    image->notes[image->n_notes++] = bf_strdup(text);
}

void target_say(struct target_effect *effect, bool runs, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    (void)vsnprintf(effect->fate, sizeof effect->fate, format, args);
    va_end(args);
    effect->runs = runs;
}

void target_values(const struct model_effect *effect, double p[BEAM_EFFECT_PARAMETERS])
{
    for (int s = 0; s < BEAM_EFFECT_PARAMETERS; s++)
        p[s] = s < effect->effect->n_parameters ? effect->parameters[s].value : 0.0;
}

/* ---- Which effects ---- */

static bool differ(double a, double b)
{
    return a < b || a > b;
}

/* Does the effect look at the clock at its present values? */
static bool depends_on_time(const struct model_effect *effect)
{
    static const double late_s = 1234.5;
    double p[BEAM_EFFECT_PARAMETERS];
    target_values(effect, p);
    if (effect->effect->law != NULL) {
        struct beam_law_input in = {.w = {1e-3, 1e-3}, .v = {1e-2, 1e-2}, .dt_s = 1e-3};
        struct beam_law_output early = {.f = {0.0}}, late = {.f = {0.0}};
        (void)effect->effect->law(p, &in, &early);
        in.t_s = late_s;
        (void)effect->effect->law(p, &in, &late);
        if (differ(early.f[0], late.f[0]) || differ(early.f[1], late.f[1]))
            return true;
    }
    for (int i = 0; effect->effect->signal != NULL && i < 8; i++) { /* several instants: one may be a whole period */
        struct beam_sample_output early = {.y = 0.0}, late = {.y = 0.0};
        (void)effect->effect->signal(p, 0.0, 0.1, &early);
        (void)effect->effect->signal(p, late_s * (1.0 + 0.31 * i), 0.1, &late);
        if (differ(early.y, late.y))
            return true;
    }
    return false;
}

static bool has_per_record(const struct beam_effect *effect)
{
    for (int s = 0; s < effect->n_parameters; s++)
        if (effect->parameters[s].flags & BEAM_PARAMETER_PER_RECORD)
            return true;
    return false;
}

/* Why an effect that acts through the board's channels cannot run there; NULL when it can. */
static const char *why_not(const struct model_effect *effect, bool on_drive)
{
    if (effect->effect->base != NULL)
        return "the clamp's motion has a phase that belongs to one recording, and the controller does not measure it";
    if (effect->effect->axial_inertia != NULL)
        return "its inertia along the beam is no force at points, so no step of the controller can carry it";
    if (effect->effect->geometry != NULL && on_drive && has_per_record(effect->effect))
        return "its shift belongs to one recording";
    if (depends_on_time(effect))
        return "its time or phase begins with a recording, and a controller has no such beginning";
    return NULL;
}

static bool in_list(const char *id, const struct target_options *options)
{
    for (size_t i = 0; i < options->n_without; i++)
        if (strcmp(options->without[i], id) == 0)
            return true;
    return false;
}

/* Keep effect e in the deployed model? When not, its `fate` says why. */
static enum bf_status judge_effect(const struct model *model, size_t e, size_t sensor, size_t drive,
                                   const struct target_options *options, struct target_effect *out, bool *keep,
                                   struct bf_error *err)
{
    const struct model_effect *effect = &model->effects[e];
    const struct beam_effect *kind = effect->effect;
    const bool on_sensor = effect_on_output(model, e, sensor), on_drive = effect_on_input(model, e, drive);
    const bool of_channels = kind->filter != NULL || kind->map != NULL || kind->signal != NULL || kind->drive != NULL;
    const bool of_beam = kind->terms != NULL || kind->law != NULL || kind->geometry != NULL || kind->base != NULL;
    out->id = kind->id;
    *keep = false;
    if (in_list(kind->id, options)) {
        target_say(out, false, "left out, as asked");
        return BF_OK;
    }
    if (of_channels && !of_beam && !on_sensor && !on_drive) {
        target_say(out, false, "left out: it sits on a channel that the controller does not have");
        return BF_OK;
    }
    if (kind->geometry != NULL && has_per_record(kind) && !on_drive) {
        target_say(out, false, "left out: it moves an input that the controller does not have");
        return BF_OK;
    }
    const char *reason = why_not(effect, on_drive);
    if (reason != NULL)
        return bf_fail_at(err, model->path ? model->path : "model", 0,
                          "effect %s cannot run on a controller: %s; give --without %s and the live residual will show "
                          "it, set what begins with a recording to 0, or take it out with beamfit drop",
                          kind->id, reason, kind->id);
    *keep = true;
    return BF_OK;
}

static enum bf_status check_without(const struct model *model, const struct target_options *options,
                                    struct bf_error *err)
{
    for (size_t i = 0; i < options->n_without; i++) {
        bool found = false;
        for (size_t e = 0; e < model->n_effects; e++)
            found = found || strcmp(model->effects[e].effect->id, options->without[i]) == 0;
        if (!found)
            return bf_fail(err, BF_USAGE, "--without %s: the model has no such effect", options->without[i]);
    }
    return BF_OK;
}

static enum bf_status choose_effects(const struct model *model, size_t sensor, size_t drive,
                                     const struct target_options *options, struct deployment *d,
                                     struct target_image *image, struct bf_error *err)
{
    bool *keep = bf_alloc(model->n_effects, sizeof *keep);
    enum bf_status status = check_without(model, options, err);
    image->n_effects = model->n_effects;
    image->effects = bf_alloc(model->n_effects, sizeof *image->effects);
    d->origin = bf_alloc(model->n_effects, sizeof *d->origin);
    for (size_t e = 0; status == BF_OK && e < model->n_effects; e++)
        status = judge_effect(model, e, sensor, drive, options, &image->effects[e], &keep[e], err);
    if (status == BF_OK) {
        d->model.n_effects = 0;
        for (size_t e = 0; e < model->n_effects; e++) {
            struct model_effect effect = d->model.effects[e];
            if (keep[e]) {
                d->origin[d->model.n_effects] = e;
                d->model.effects[d->model.n_effects++] = effect;
            } else {
                free(effect.per_record);
            }
        }
    }
    free(keep);
    return status;
}

/* ---- Which channels ---- */

static size_t index_of(const struct model *model, const char *name, bool output)
{
    size_t i = 0;
    while (strcmp(output ? model->outputs[i].name : model->inputs[i].name, name) != 0)
        i++;
    return i; /* target_board() has found it */
}

/* The path beside the modes from drive to sensor; those of other channels do not matter. */
static void judge_residual(const struct model *model, size_t sensor, size_t drive, struct target_image *image,
                           double *direct)
{
    *direct = 0.0;
    for (size_t r = 0; r < model->n_residuals; r++) {
        const struct model_residual *residual = &model->residuals[r];
        if (residual->output != sensor || residual->input != drive || !(fabs(residual->compliance.value) > 0.0))
            continue;
        if (model->outputs[sensor].kind == OUTPUT_PATCH_STRAIN || model->outputs[sensor].kind == OUTPUT_DISPLACEMENT)
            *direct = residual->compliance.value;
        else
            target_note(image,
                        "%s is left out: it multiplies derivatives of the drive, which a held drive does not have; the "
                        "sensor's step answer between two samples will differ",
                        residual->compliance.name);
    }
}

static enum bf_status shift_patch(struct deployment *d, struct target_image *image, struct bf_error *err)
{
    double shift_m = 0.0;
    for (size_t e = 0; e < d->model.n_effects; e++) {
        const struct model_effect *effect = &d->model.effects[e];
        struct target_effect *said = &image->effects[d->origin[e]];
        double p[BEAM_EFFECT_PARAMETERS];
        struct beam_geometry at = {0};
        if (effect->effect->geometry == NULL)
            continue;
        target_values(effect, p);
        if (effect->effect->geometry(p, &at) != 0)
            return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->effect->id);
        shift_m += at.patch_shift_m;
        image->clock_relative += at.clock_relative;
        target_say(said, false,
                   fabs(at.clock_relative) > 0.0 ? "in the sample interval" : "in the places of the patch");
    }
    if (!(fabs(shift_m) > 0.0))
        return BF_OK;
    struct model fixed;
    enum bf_status status = model_copy(&d->model, &fixed, err);
    if (status == BF_OK)
        status = model_move(&fixed, (const double[MODEL_MOVES]){[MOVE_SHIFT] = shift_m}, &d->model, err);
    model_free(&fixed);
    return status;
}

enum bf_status deploy_channels(const struct model *model, const struct target_options *options, struct deployment *d,
                               struct target_image *image, struct bf_error *err)
{
    const size_t sensor = index_of(model, image->board.sensor, true),
                 drive = index_of(model, image->board.drive, false);
    enum bf_status status = model_copy(model, &d->model, err);
    if (status == BF_OK)
        status = choose_effects(model, sensor, drive, options, d, image, err);
    judge_residual(model, sensor, drive, image, &d->direct);
    if (status == BF_OK)
        status = shift_patch(d, image, err);
    if (status != BF_OK)
        return status;
    double before[2] = {0.0, 0.0}, after[2] = {0.0, 0.0};
    (void)model_patch(&d->model, &before[0], &before[1]);
    d->model.outputs[0] = d->model.outputs[sensor];
    d->model.inputs[0] = d->model.inputs[drive];
    d->model.n_outputs = d->model.n_inputs = 1;
    d->model.n_residuals = 0;
    (void)model_patch(&d->model, &after[0], &after[1]);
    if (differ(before[0], after[0]) || differ(before[1], after[1]))
        return bf_fail_at(
            err, model->path ? model->path : "model", 0,
            "has several patches and no region named 'patch', so that effects on 'the patch' would move to "
            "another one; name the region");
    if (model->inputs[drive].level_per_record)
        target_note(image, "%s has an unknown level in each recording; the controller takes its D/A's value as it is",
                    model->inputs[drive].name);
    return BF_OK;
}
