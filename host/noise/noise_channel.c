/* SPDX-License-Identifier: GPL-3.0-or-later */
/* noise_channel.c — the noise of an output of the model in a record: what is asked, what is remembered. */
#include "noise_estimate.h"
#include "noise_memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* The noise that the coherence of a frequency response states; its level is taken to be known as well as its lines are many. */
static void take_coherence(const struct record *record, const double psd[], struct noise_estimate *out)
{
    double sum = 0.0;
    *out = (struct noise_estimate){.method = NOISE_COHERENCE, .n_bins = record->n / 2 + 1, .used_share = 1.0};
    out->df_Hz = 1.0 / ((double)record->n * record->dt_s);
    out->psd = bf_alloc(out->n_bins, sizeof *out->psd);
    memcpy(out->psd, psd, out->n_bins * sizeof *psd);
    for (size_t k = 0; k < out->n_bins; k++)
        sum += psd[k] * out->df_Hz;
    out->rms = sqrt(sum);
    out->rms_sd = 0.5 * out->rms / sqrt((double)out->n_bins);
    out->n_used = out->n_bins;
}

static const double *stated_noise(const struct record *record, const char *name)
{
    for (size_t i = 0; i < record->n_columns; i++)
        if (strcmp(record->columns[i].name, name) == 0)
            return record->columns[i].noise_psd;
    return NULL;
}

/* ---- What is asked ---- */

struct question {
    const double *z;
    size_t from, n_inputs;
    struct noise_channel_input inputs[NOISE_MOST_INPUTS];
};

static bool moves(const double *u, size_t n)
{
    for (size_t i = 1; i < n; i++)
        if (u[i] < u[0] || u[i] > u[0])
            return true;
    return false;
}

static struct question ask(const struct model *model, const struct record *record, const char *channel)
{
    const bool free_decay = record_is_free_decay(record);
    struct question q = {.z = record_column(record, channel), .from = record_free_from(record)};
    for (size_t i = 0; i < model->n_inputs && q.n_inputs < NOISE_MOST_INPUTS && !free_decay; i++) {
        const double *column = record_column(record, model->inputs[i].name);
        if (column != NULL && moves(column, record->n))
            q.inputs[q.n_inputs++] =
                (struct noise_channel_input){.u = column, .cells = record_column_noise(record, model->inputs[i].name)};
    }
    return q;
}

static struct noise_key key_of(const struct question *q, const struct record *record)
{
    return noise_memory_key(q->z, record->n, record->dt_s, q->inputs, q->n_inputs, q->from);
}

/* ---- All outputs of a record whose inputs have noise ---- */

static bool has_noisy_input(const struct question *q, size_t n)
{
    bool any = false;
    for (size_t i = 0; i < q->n_inputs && !any; i++)
        any = noise_rms_of(&q->inputs[i], n) > 0.0;
    return any;
}

/* all[n_outputs] without what is carried; rms[n_outputs]. */
static enum bf_status estimate_own(const struct model *model, const struct record *record, struct noise_estimate all[],
                                   double rms[], struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t o = 0; o < model->n_outputs && !status; o++) {
        const struct question q = ask(model, record, model->outputs[o].name);
        if (q.z != NULL)
            status = noise_estimate_own(q.z, record->n, record->dt_s, q.inputs, q.n_inputs, q.from, &all[o], err);
        rms[o] = all[o].rms;
    }
    return status;
}

static enum bf_status add_and_remember(const struct model *model, const struct record *record, size_t output,
                                       const struct noise_channel_input inputs[], struct noise_estimate *estimate,
                                       struct bf_error *err)
{
    const struct question q = ask(model, record, model->outputs[output].name);
    const enum bf_status status =
        q.z != NULL ? noise_add_inputs(q.z, inputs, q.n_inputs, record->n, record->dt_s, estimate, err) : BF_OK;
    if (q.z != NULL && !status)
        noise_memory_add(key_of(&q, record), estimate);
    return status;
}

/*
 * One free linear model tells all outputs of the record, so that all are estimated and remembered; the one that was asked for is found in the memory. Where there is no such model, P_y/P_u
 * has to do.
 */
static enum bf_status estimate_record(const struct model *model, const struct record *record, const struct question *q,
                                      struct bf_error *err)
{
    struct bf_error ignored;
    struct noise_estimate *all = bf_alloc(model->n_outputs, sizeof *all);
    struct noise_channel_input *inputs = bf_alloc(model->n_outputs * q->n_inputs, sizeof *inputs);
    double *rms = bf_alloc(model->n_outputs, sizeof *rms);
    for (size_t i = 0; i < model->n_outputs * q->n_inputs; i++)
        inputs[i] = q->inputs[i % q->n_inputs];
    enum bf_status status = estimate_own(model, record, all, rms, err);
    if (!status)
        (void)attainable_gains(model, record, rms, inputs, q->n_inputs, &ignored);
    for (size_t o = 0; o < model->n_outputs && !status; o++)
        status = add_and_remember(model, record, o, inputs + o * q->n_inputs, &all[o], err);
    for (size_t i = 0; i < model->n_outputs * q->n_inputs; i++)
        free(inputs[i].gain);
    for (size_t o = 0; o < model->n_outputs; o++)
        noise_free(&all[o]);
    free(all), free(inputs), free(rms);
    return status;
}

enum bf_status noise_of_channel(const struct model *model, const struct record *record, const char *channel,
                                struct noise_estimate *out, struct bf_error *err)
{
    *out = (struct noise_estimate){0};
    if (record_column(record, channel) == NULL)
        return bf_fail(err, BF_BAD_FILE, "%s: there is no column '%s'; name it in the header row", record->path,
                       channel);
    if (stated_noise(record, channel) != NULL) {
        take_coherence(record, stated_noise(record, channel), out);
        return BF_OK;
    }
    const struct question q = ask(model, record, channel);
    const struct noise_key key = key_of(&q, record);
    enum bf_status status = BF_OK;
    if (noise_memory_find(key, out))
        return BF_OK;
    if (has_noisy_input(&q, record->n))
        status = estimate_record(model, record, &q, err);
    if (status || noise_memory_find(key, out))
        return status;
    status = noise_estimate(q.z, record->n, record->dt_s, q.inputs, q.n_inputs, q.from, out, err);
    if (status == BF_OK)
        noise_memory_add(key, out);
    return status;
}
