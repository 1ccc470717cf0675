/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Zero shifts: an accelerometer that a blow has thrown off its zero creeps back over seconds, and each record has another shift. No beam does
 * that: the acceleration of a held beam far below its first frequency falls with the square of the frequency.
 */
#include "noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "beam/beam.h"
#include "slow_part.h"
#include "steady_drive.h"

enum { LEAST_SAMPLES = 64, PARTS = 3 };

/* All that is set by hand. */
static const struct baseline_limits {
    double band;  /* of the model's first frequency: below, a beam does next to nothing, whatever sits at its tip */
    double onset; /* of an input's peak */
    double
        falls; /* the slowest third of the terms has at least so many times the power of the fastest: a beam's share rises */
    double share;  /* of the channel's rms */
    double noises; /* of the noise; from rest */
    double
        shared; /* of the largest mean over a record: means that scatter less are one offset, which is the sensor's */
    double of_drive; /* of the frequency of a drive in steady state: below */
    double
        follows; /* times its share of a drive's power: what a beam does far below its first frequency is less than one */
} limits = {.band = 0.1,
            .onset = 0.01,
            .falls = 30.0,
            .share = 0.02,
            .noises = 3.0,
            .shared = 0.3,
            .of_drive = 0.25,
            .follows = 10.0};

/* ---- One channel of one record ---- */

static size_t onset_of(const struct model *model, const struct record *record)
{
    size_t onset = record->n;
    for (size_t i = 0; i < model->n_inputs; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        double peak = 0.0;
        for (size_t k = 0; u != NULL && k < record->n; k++)
            peak = fmax(peak, fabs(u[k]));
        size_t first = 0;
        while (u != NULL && first < record->n && !(fabs(u[first]) > limits.onset * peak))
            first++;
        onset = u != NULL && first < onset ? first : onset;
    }
    return onset;
}

static double power_of(const struct slow_part *slow)
{
    return slow_part_power(slow, 0, slow->n_terms);
}

/* Falling with the frequency. Of few terms there is nothing to compare. */
static bool falls(const struct slow_part *slow)
{
    const size_t third = slow->n_terms / PARTS;
    return third > 0 &&
           slow_part_power(slow, 0, third) > limits.falls * slow_part_power(slow, slow->n_terms - third, slow->n_terms);
}

/* What a drive in steady state is like. */
struct drive {
    double slow_share; /* of the power of the input that has the most of its own below below_Hz */
    double below_Hz;
};

static enum bf_status look_at_drive(const struct model *model, const struct record *record, double below_Hz,
                                    struct drive *drive, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *drive = (struct drive){.below_Hz = below_Hz};
    for (size_t i = 0; i < model->n_inputs; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        const double periods = u != NULL ? 0.5 * (double)mean_crossings(u, record->n) : 0.0;
        if (u != NULL)
            drive->below_Hz = fmin(drive->below_Hz, limits.of_drive * periods / ((double)record->n * record->dt_s));
    }
    for (size_t i = 0; i < model->n_inputs && !status; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        const double rms = u != NULL ? root_mean_square(u, record->n) : 0.0;
        struct slow_part slow = slow_part_new(0, record->n, record->dt_s, drive->below_Hz);
        if (!(rms > 0.0))
            continue;
        status = slow_part_beside_motion(u, &slow, err);
        drive->slow_share = fmax(drive->slow_share, power_of(&slow) / (rms * rms));
    }
    return status;
}

/* ---- Several records ---- */

/* What is asked of a channel of a record, and what is found. */
struct shifted {
    struct record *record;
    double *z;
    struct slow_part slow;
    bool found;
};

static bool may_shift(const struct model *model, const struct record *record, const char *channel)
{
    const char *stated = record_meta(record, "baseline");
    return (stated == NULL || strcmp(stated, "keep") != 0) && record->kind == RECORD_SAMPLES &&
           !record_is_periodic(record) && record_column(record, channel) != NULL &&
           (!record_state_is_free(record) || drive_goes_on(model, record)) &&
           onset_of(model, record) + LEAST_SAMPLES <= record->n;
}

static double *own_column(struct record *record, const char *name)
{
    size_t i = 0;
    while (strcmp(record->columns[i].name, name) != 0) /* may_shift() has seen it */
        i++;
    return record->columns[i].x;
}

/* From rest to rest a beam does nothing so slow. */
static bool shifts_from_rest(const struct model *model, double below_Hz, double rms, double noise, struct shifted *one)
{
    one->slow = slow_part_new(onset_of(model, one->record), one->record->n, one->record->dt_s, below_Hz);
    slow_part_project(one->z, &one->slow);
    return power_of(&one->slow) > fmax(pow(limits.share * rms, 2.0), pow(limits.noises * noise, 2.0)) &&
           falls(&one->slow);
}

/* In steady vibration a beam does move so slowly, but by a smaller share of its motion than the drive of its own. */
static enum bf_status shifts_in_motion(const struct model *model, double below_Hz, double rms, struct shifted *one,
                                       struct bf_error *err)
{
    struct drive drive;
    enum bf_status status = look_at_drive(model, one->record, below_Hz, &drive, err);
    if (status)
        return status;
    one->slow = slow_part_new(0, one->record->n, one->record->dt_s, drive.below_Hz);
    status = slow_part_beside_motion(one->z, &one->slow, err);
    const double share = power_of(&one->slow) / (rms * rms);
    one->found = !status && share > fmax(pow(limits.share, 2.0), limits.follows * drive.slow_share);
    return status;
}

static enum bf_status look_at(const struct model *model, const char *channel, double below_Hz, struct shifted *one,
                              struct bf_error *err)
{
    const double rms = root_mean_square(one->z, one->record->n);
    struct noise_estimate noise;
    if (record_state_is_free(one->record))
        return shifts_in_motion(model, below_Hz, rms, one, err);
    const enum bf_status status = noise_of_channel(model, one->record, channel, &noise, err);
    if (status)
        return status;
    one->found = shifts_from_rest(model, below_Hz, rms, noise.rms, one);
    noise_free(&noise);
    return BF_OK;
}

/* The same mean in all records is an offset of the sensor, which is physics that a model may lack; so is a single one. */
static bool are_one(const struct shifted all[], size_t n)
{
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < n; i++)
        low = fmin(low, all[i].slow.c[0]), high = fmax(high, all[i].slow.c[0]);
    return n < 2 || high - low < limits.shared * fmax(fabs(low), fabs(high));
}

static void take_off(struct shifted *one, const char *channel, struct baseline_list *out)
{
    const size_t n = one->record->n;
    const double rms = root_mean_square(one->z, n), power = power_of(&one->slow);
    out->all = bf_grow(out->all, out->n + 1, sizeof *out->all);
    struct baseline *found = &out->all[out->n++];
    *found = (struct baseline){.record = one->record,
                               .channel = channel,
                               .first = slow_part_at(&one->slow, one->slow.first),
                               .last = slow_part_at(&one->slow, n - 1),
                               .share = sqrt(power) / rms};
    for (size_t k = one->slow.first; k < n; k++)
        one->z[k] -= slow_part_at(&one->slow, k);
}

static enum bf_status take_off_channel(const struct model *model, const struct model_output *output, double below_Hz,
                                       struct record *const records[], size_t n_records, struct baseline_list *out,
                                       struct bf_error *err)
{
    struct shifted *all = bf_alloc(n_records + 1, sizeof *all);
    enum bf_status status = BF_OK;
    size_t n = 0;
    for (size_t r = 0; r < n_records && !status; r++) {
        if (!may_shift(model, records[r], output->name))
            continue;
        all[n] = (struct shifted){.record = records[r], .z = own_column(records[r], output->name)};
        status = look_at(model, output->name, below_Hz, &all[n++], err);
    }
    for (size_t i = 0; !status && !are_one(all, n) && i < n; i++)
        if (all[i].found)
            take_off(&all[i], output->name, out);
    free(all);
    return status;
}

enum bf_status baselines_take_off(const struct model *model, struct record *const records[], size_t n_records,
                                  struct baseline_list *out, struct bf_error *err)
{
    enum { SPLINES = 60 };
    double first_Hz;
    *out = (struct baseline_list){0};
    if (model->support == SUPPORT_FREE_FREE)
        return BF_OK;
    enum bf_status status = modes_frequencies(model, SPLINES, false, 1, &first_Hz, err);
    for (size_t o = 0; o < model->n_outputs && !status; o++)
        if (model->outputs[o].kind == OUTPUT_ACCELERATION)
            status = take_off_channel(model, &model->outputs[o], limits.band * first_Hz, records, n_records, out, err);
    if (status)
        baselines_free(out);
    return status;
}

void baselines_free(struct baseline_list *list)
{
    free(list->all);
    *list = (struct baseline_list){0};
}
