/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The menu: what an experimenter could do next, in the model's own inputs and within what the records show was possible. */
#include "discriminate_state.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Without records: a small hammer, a piezo amplifier, four seconds at the paper's rate. */
static const double default_force_N = 5.0, default_moment_V = 20.0, default_duration_s = 4.0, default_dt_s = 1.0 / 1024;
enum { MOST_SAMPLES = 16384, LEAST_SAMPLES = 256 };

/* Levels relative to the largest one: well below, as far as the records go, and beyond. */
static const double levels[] = {0.25, 1.0, 4.0};
enum { LEVELS = sizeof levels / sizeof *levels };
/* Places of a hit and of sensors, relative to the length. The free end itself would be missed by a hammer. */
static const double hit_places[] = {0.25, 0.5, 0.95}, sensor_places[] = {0.25, 0.5, 1.0};
enum {
    HIT_PLACES = sizeof hit_places / sizeof *hit_places,
    SENSOR_PLACES = sizeof sensor_places / sizeof *sensor_places
};
static const double same_place = 0.03; /* of the length: nearer is no other place */
/* Width of a hit in samples: the first zero of a raised cosine's spectrum, 2/width, at a quarter of the sampling rate. */
static const double hard_samples = 8.0, soft_samples = 32.0;
static const double least_width_s = 0.5e-3; /* a steel tip on aluminium */
static const double pulled = 0.01;    /* deflection of the tip before release, of the length: small against any bend */
static const double top_share = 0.35; /* of the sampling rate: highest frequency of chirp and multisine */
static const double driven_share = 0.75; /* of the record; the rest decays freely */

const char *drive_kind_name(enum drive_kind kind)
{
    static const char *const names[DRIVE_KINDS] = {"hit", "soft_hit", "release", "chirp", "multisine"};
    return kind < DRIVE_KINDS ? names[kind] : NULL;
}

bool record_has_known_inputs(const struct record *record)
{
    const char *excitation = record_meta(record, "excitation");
    return excitation == NULL || (strcmp(excitation, "free_decay") != 0 && strcmp(excitation, "unknown_level") != 0);
}

static double largest_level(const struct discriminate_state *w, size_t input)
{
    const struct model_input *in = &w->baseline->inputs[input];
    const bool force = in->kind == INPUT_POINT_FORCE;
    const double wanted = force ? w->options->force_N : w->options->moment_V;
    if (wanted > 0.0)
        return wanted;
    double most = 0.0;
    for (size_t r = 0; r < w->n_records; r++) {
        const double *u = record_column(&w->records[r], in->name);
        for (size_t k = 0; u != NULL && k < w->records[r].n && record_has_known_inputs(&w->records[r]); k++)
            most = fmax(most, fabs(u[k]));
    }
    return most > 0.0 ? most : force ? default_force_N : default_moment_V;
}

static void add_drive(struct discriminate_state *w, struct drive drive)
{
    struct discrimination *d = w->d;
    const char *input = w->baseline->inputs[drive.input].name,
               *flag = drive.beyond ? ", beyond the largest so far" : "";
    switch (drive.kind) {
    case DRIVE_HIT:
    case DRIVE_SOFT_HIT:
        (void)snprintf(drive.name, sizeof drive.name, "hit %s at %.3f m, %.3g N peak%s%s", input, drive.at_m,
                       drive.level, drive.kind == DRIVE_SOFT_HIT ? ", soft tip" : "", flag);
        break;
    case DRIVE_RELEASE:
        (void)snprintf(drive.name, sizeof drive.name, "pull with %s at %.3f m by %.3g N and let go%s", input,
                       drive.at_m, drive.level, flag);
        break;
    default:
        (void)snprintf(drive.name, sizeof drive.name, "%s on %s, %.3g V peak%s", drive_kind_name(drive.kind), input,
                       drive.level, flag);
    }
    d->drives = bf_grow(d->drives, d->n_drives + 1, sizeof *d->drives);
    d->drives[d->n_drives++] = drive;
}

static void add_levels(struct discriminate_state *w, struct drive drive, double most)
{
    if (w->options->without[drive.kind])
        return;
    /* the largest allowed first: it is what reference_drive() finds */
    static const size_t order[LEVELS] = {1, 0, 2};
    for (size_t i = 0; i < LEVELS; i++) {
        drive.level = most * levels[order[i]];
        drive.relative = levels[order[i]];
        drive.beyond = drive.relative > 1.0;
        add_drive(w, drive);
    }
}

static void add_hits(struct discriminate_state *w, size_t input)
{
    const double length = w->baseline->length_m, most = largest_level(w, input);
    struct drive hit = {.kind = DRIVE_HIT, .input = input, .at_m = w->baseline->inputs[input].at_m};
    const double present = hit.at_m;
    hit.width_s = fmax(hard_samples * w->dt_s, least_width_s);
    add_levels(w, hit, most);
    for (size_t i = 0; i < HIT_PLACES; i++) {
        hit.at_m = hit_places[i] * length;
        if (fabs(hit.at_m - present) > same_place * length)
            add_levels(w, hit, most);
    }
    hit = (struct drive){.kind = DRIVE_SOFT_HIT, .input = input, .at_m = present};
    hit.width_s = fmax(soft_samples * w->dt_s, least_width_s);
    add_levels(w, hit, most);
}

/* A cantilever pulled at its tip: w = F ℓ³/(3 EI). Other supports have no end to pull at. */
static void add_release(struct discriminate_state *w, size_t input)
{
    const struct model *model = w->baseline;
    if (model->support != SUPPORT_CLAMPED_FREE || model->n_regions == 0)
        return;
    const double EI = model_material(model, model->regions[model->n_regions - 1].name)->EI.value;
    const double force = 3.0 * EI * pulled / (model->length_m * model->length_m);
    const struct drive pull = {.kind = DRIVE_RELEASE, .input = input, .at_m = model->length_m};
    add_levels(w, pull, fmin(force, largest_level(w, input)));
}

static void add_sweeps(struct discriminate_state *w, size_t input)
{
    const double duration = (double)w->n * w->dt_s;
    struct drive sweep = {.kind = DRIVE_CHIRP, .input = input, .from_Hz = 2.0 / duration, .to_Hz = top_share / w->dt_s};
    add_levels(w, sweep, largest_level(w, input));
    sweep.kind = DRIVE_MULTISINE;
    add_levels(w, sweep, largest_level(w, input));
}

static bool have_sensor(const struct model *model, enum output_kind kind, double at_m)
{
    for (size_t o = 0; o < model->n_outputs; o++)
        if (model->outputs[o].kind == kind && fabs(model->outputs[o].at_m - at_m) < same_place * model->length_m)
            return true;
    return false;
}

static void add_sensors(struct discriminate_state *w)
{
    static const enum output_kind kinds[] = {OUTPUT_DISPLACEMENT, OUTPUT_VELOCITY, OUTPUT_ACCELERATION};
    struct discrimination *d = w->d;
    const struct model *model = w->baseline;
    const bool end_moves = model->support == SUPPORT_CLAMPED_FREE || model->support == SUPPORT_FREE_FREE;
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        for (size_t i = 0; i < SENSOR_PLACES; i++) {
            struct model_output sensor = {.kind = kinds[k], .at_m = sensor_places[i] * model->length_m};
            if ((sensor_places[i] == 1.0 && !end_moves) || have_sensor(model, sensor.kind, sensor.at_m))
                continue;
            (void)snprintf(sensor.name, sizeof sensor.name, "added_%s_%zu", model_output_kind_name(sensor.kind), i);
            d->sensors = bf_grow(d->sensors, d->n_sensors + 1, sizeof *d->sensors);
            d->sensors[d->n_sensors++] = sensor;
        }
    }
}

static enum bf_status nothing_to_do(const struct discriminate_state *w, struct bf_error *err)
{
    char kinds[DISCRIMINATE_NAME] = "";
    for (int k = 0; k < DRIVE_KINDS; k++)
        if (!w->options->without[k])
            (void)snprintf(kinds + strlen(kinds), sizeof kinds - strlen(kinds), "%s%s", kinds[0] ? ", " : "",
                           drive_kind_name((enum drive_kind)k));
    return bf_fail(
        err, BF_USAGE,
        "no input of the model can give %s: hits and releases need a point_force input (releases also a free "
        "end), chirps and multisines a patch_moment input",
        kinds[0] ? kinds : "a drive");
}

enum bf_status menu_make(struct discriminate_state *w, struct bf_error *err)
{
    const struct model *model = w->baseline;
    w->dt_s = w->n_records > 0 ? w->records[0].dt_s : default_dt_s;
    const double duration = w->options->duration_s > 0.0 ? w->options->duration_s
                            : w->n_records > 0           ? (double)w->records[0].n * w->dt_s
                                                         : default_duration_s;
    w->n = (size_t)fmin(fmax(round(duration / w->dt_s), LEAST_SAMPLES), MOST_SAMPLES);
    w->d->duration_s = (double)w->n * w->dt_s;
    w->n_outputs = model->n_outputs;
    size_t force = model->n_inputs, patch = model->n_inputs;
    for (size_t i = model->n_inputs; i-- > 0;)
        *(model->inputs[i].kind == INPUT_POINT_FORCE ? &force : &patch) = i;
    if (force < model->n_inputs)
        add_hits(w, force);
    if (patch < model->n_inputs)
        add_sweeps(w, patch);
    if (force < model->n_inputs)
        add_release(w, force);
    if (w->d->n_drives == 0)
        return nothing_to_do(w, err);
    if (!w->options->no_sensors)
        add_sensors(w);
    return BF_OK;
}

const struct drive *reference_drive(const struct discriminate_state *w)
{
    const struct drive *found = &w->d->drives[0];
    for (size_t i = 0; i < w->d->n_drives; i++) {
        const struct drive *drive = &w->d->drives[i];
        if (drive->kind == DRIVE_HIT && !drive->beyond && drive->at_m > found->at_m)
            found = drive;
    }
    return found;
}

/* ---- Signals ---- */

static double raised_cosine(double t, double width)
{
    return t > 0.0 && t < width ? 0.5 * (1.0 - cos(2.0 * M_PI * t / width)) : 0.0;
}

/* Rises over `rise`, falls over `fall` to be 0 at `end`. */
static double plateau(double t, double rise, double end, double fall)
{
    if (t <= 0.0 || t >= end)
        return 0.0;
    const double up = t < rise ? 0.5 * (1.0 - cos(M_PI * t / rise)) : 1.0;
    return end - t < fall ? up * 0.5 * (1.0 - cos(M_PI * (end - t) / fall)) : up;
}

/* Sinusoids of equal amplitude on the lines of the driven part, phases after Schroeder (1970). */
static void multisine(const struct discriminate_state *w, const struct drive *drive, double u[])
{
    const double end = driven_share * (double)w->n * w->dt_s;
    const size_t first = (size_t)fmax(1.0, ceil(drive->from_Hz * end)), last = (size_t)floor(drive->to_Hz * end);
    const double tones = last >= first ? (double)(last - first + 1) : 1.0;
    for (size_t line = first; line <= last; line++) {
        const double j = (double)(line - first);
        const double step = 2.0 * M_PI * (double)line / end * w->dt_s, phase = -M_PI * j * j / tones;
        for (size_t k = 0; k < w->n; k++)
            u[k] += cos(phase + step * (double)k);
    }
}

/* u[n], level included. */
static void signal_of(const struct discriminate_state *w, const struct drive *drive, double u[])
{
    const double total = (double)w->n * w->dt_s, driven = driven_share * total, fade = 0.02 * total;
    double peak = 0.0;
    memset(u, 0, w->n * sizeof *u);
    if (drive->kind == DRIVE_MULTISINE)
        multisine(w, drive, u);
    for (size_t k = 0; k < w->n; k++) {
        const double t = (double)k * w->dt_s;
        if (drive->kind == DRIVE_HIT || drive->kind == DRIVE_SOFT_HIT)
            u[k] = raised_cosine(t - 0.01 * total, drive->width_s);
        else if (drive->kind == DRIVE_RELEASE)
            u[k] = plateau(t, 0.2 * total, 0.25 * total, 4.0 * w->dt_s);
        else if (drive->kind == DRIVE_CHIRP)
            u[k] = sin(2.0 * M_PI * (drive->from_Hz + 0.5 * (drive->to_Hz - drive->from_Hz) * t / driven) * t);
        if (drive->kind == DRIVE_CHIRP || drive->kind == DRIVE_MULTISINE)
            u[k] *= plateau(t, fade, driven, fade);
        peak = fmax(peak, fabs(u[k]));
    }
    for (size_t k = 0; k < w->n; k++)
        u[k] *= drive->level / peak;
}

void menu_record(const struct discriminate_state *w, const struct drive *drive, bool with_outputs, struct record *out)
{
    double *u = bf_alloc(w->n, sizeof *u), *zeros = bf_alloc(w->n, sizeof *zeros);
    char place[64];
    *out = (struct record){.path = bf_strdup(""), .n = w->n, .dt_s = w->dt_s};
    signal_of(w, drive, u);
    for (size_t i = 0; i < w->baseline->n_inputs; i++)
        record_add_column(out, w->baseline->inputs[i].name, i == drive->input ? u : zeros);
    for (size_t o = 0; with_outputs && o < w->n_outputs; o++)
        record_add_column(out, w->baseline->outputs[o].name, zeros);
    for (size_t s = 0; with_outputs && s < w->d->n_sensors; s++)
        record_add_column(out, w->d->sensors[s].name, zeros);
    const char *filter = w->n_records > 0 ? record_meta(&w->records[0], RECORD_FILTER) : NULL;
    if (with_outputs && filter != NULL)
        record_add_meta(out, RECORD_FILTER, filter);
    if (!with_outputs) {
        record_add_meta(out, "experiment", drive->name);
        (void)snprintf(place, sizeof place, "%.6g", drive->at_m);
        if (w->baseline->inputs[drive->input].kind == INPUT_POINT_FORCE)
            record_add_meta(out, "at_m", place);
    }
    free(u), free(zeros);
}

enum bf_status menu_model(const struct discriminate_state *w, const struct model *rival, const struct drive *drive,
                          struct model *out, struct bf_error *err)
{
    const enum bf_status status = model_copy(rival, out, err);
    if (status)
        return status;
    if (out->inputs[drive->input].kind == INPUT_POINT_FORCE && out->inputs[drive->input].at_m != drive->at_m) {
        out->inputs[drive->input].at_m = drive->at_m;
        for (size_t i = 0; i < out->n_residuals; i++) /* local deformation at the old place says nothing of the new */
            if (out->residuals[i].input == drive->input)
                out->residuals[i].compliance.value = 0.0;
    }
    out->outputs = bf_grow(out->outputs, out->n_outputs + w->d->n_sensors, sizeof *out->outputs);
    for (size_t s = 0; s < w->d->n_sensors; s++)
        out->outputs[out->n_outputs++] = w->d->sensors[s];
    return BF_OK;
}
