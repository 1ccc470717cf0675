/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Zero shifts: an accelerometer that a blow has thrown off its zero creeps back over seconds, and each record has another shift. No beam does
 * that: from rest, the acceleration of a held beam far below its first frequency falls with the square of the frequency.
 */
#include "noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "beam/beam.h"

enum { MOST_TERMS = 24, LEAST_SAMPLES = 64, PARTS = 3 };

/* All that is set by hand. */
static const struct baseline_limits {
    double band;  /* of the model's first frequency: below, a beam does next to nothing, whatever sits at its tip */
    double onset; /* of an input's peak */
    double
        falls; /* the slowest third of the terms has at least so many times the power of the fastest: a beam's share rises */
    double share;  /* of the channel's rms */
    double noises; /* of the noise */
    double
        shared; /* of the largest mean over a record: means that scatter less are one offset, which is the sensor's */
} limits = {.band = 0.1, .onset = 0.01, .falls = 30.0, .share = 0.02, .noises = 3.0, .shared = 0.3};

/* ---- One channel of one record ---- */

/* A half-range cosine series from the onset to the end: c[0] its mean. */
struct slow_part {
    size_t onset, n_terms;
    double c[MOST_TERMS];
};

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

static double term(const struct slow_part *slow, size_t j, size_t k, size_t n)
{
    return j == 0 ? 1.0 : cos(M_PI * (double)j * ((double)(k - slow->onset) + 0.5) / (double)(n - slow->onset));
}

static void find_slow_part(const struct record *record, const double z[], double below_Hz, struct slow_part *slow)
{
    const size_t n = record->n - slow->onset;
    const double terms = 1.0 + 2.0 * (double)n * record->dt_s * below_Hz;
    slow->n_terms = terms < MOST_TERMS ? (size_t)terms : MOST_TERMS;
    for (size_t j = 0; j < slow->n_terms; j++) {
        double sum = 0.0;
        for (size_t k = slow->onset; k < record->n; k++)
            sum += z[k] * term(slow, j, k, record->n);
        slow->c[j] = sum * (j == 0 ? 1.0 : 2.0) / (double)n;
    }
}

/* Mean square of the terms [from, to). */
static double power(const struct slow_part *slow, size_t from, size_t to)
{
    double sum = 0.0;
    for (size_t j = from; j < to; j++)
        sum += slow->c[j] * slow->c[j] * (j == 0 ? 1.0 : 0.5);
    return sum;
}

/* Large against the noise and a part of the signal, and falling with the frequency. Of few terms there is nothing to compare. */
static bool is_shift(const struct slow_part *slow, double rms, double noise)
{
    const size_t third = slow->n_terms / PARTS;
    const double all = power(slow, 0, slow->n_terms);
    return third > 0 &&
           all > fmax(limits.share * limits.share * rms * rms, limits.noises * limits.noises * noise * noise) &&
           power(slow, 0, third) > limits.falls * power(slow, slow->n_terms - third, slow->n_terms);
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
           !record_state_is_free(record) && !record_is_periodic(record) && record_column(record, channel) != NULL &&
           onset_of(model, record) + LEAST_SAMPLES <= record->n;
}

static double *own_column(struct record *record, const char *name)
{
    size_t i = 0;
    while (strcmp(record->columns[i].name, name) != 0) /* may_shift() has seen it */
        i++;
    return record->columns[i].x;
}

static enum bf_status look_at(const struct model *model, const char *channel, double below_Hz, struct shifted *one,
                              struct bf_error *err)
{
    struct noise_estimate noise;
    const enum bf_status status = noise_of_channel(model, one->record, channel, &noise, err);
    if (status)
        return status;
    one->slow.onset = onset_of(model, one->record);
    find_slow_part(one->record, one->z, below_Hz, &one->slow);
    one->found = is_shift(&one->slow, root_mean_square(one->z, one->record->n), noise.rms);
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
    const size_t n = one->record->n, terms = one->slow.n_terms;
    const double rms = root_mean_square(one->z, n);
    out->all = bf_grow(out->all, out->n + 1, sizeof *out->all);
    struct baseline *found = &out->all[out->n++];
    *found =
        (struct baseline){.record = one->record, .channel = channel, .share = sqrt(power(&one->slow, 0, terms)) / rms};
    for (size_t k = one->slow.onset; k < n; k++) {
        double shift = 0.0;
        for (size_t j = 0; j < terms; j++)
            shift += one->slow.c[j] * term(&one->slow, j, k, n);
        one->z[k] -= shift;
        found->first = k == one->slow.onset ? shift : found->first;
        found->last = shift;
    }
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
