/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A free decay whose first samples are not the beam's alone: the blow, or the answer of the recorder's filter to the moment of release, is not over there. What
 * swings freely follows from what it does later: each sample is a linear function of those after it (Kumaresan and Tufts 1982, backward prediction), the same
 * one for all. The first samples of such a record do not follow, by many times what the others are off by.
 */
#include "noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"
#include "maths/maths.h"

enum {
    ORDER = 40,       /* samples after it that one is predicted from: twice the modes in a band, and room for noise */
    ROWS_A_TERM = 12, /* of the record for each of them, at least */
    LEAST_ORDER = 16,
    LOOKED_AT = 4096, /* samples of a record: its beginning is what is asked for */
    LATEST = 32,      /* samples of the beginning that are predicted, and have no part in the prediction */
    LONGEST = 16      /* of which so many may be cut: a mode that dies away fast goes on, and a filter does not */
};

static const struct start_limits {
    double noises; /* times what the others are off by, as rms: not one of 10,000 samples of noise */
    double worst;  /* the same, of the worst sample: what is less is hardly seen in a fit */
    double trifle; /* of the channel's rms: what is less matters nowhere */
} limits = {.noises = 5.0, .worst = 10.0, .trifle = 2e-3};

/* error[n − order] of each sample but the last `order` of z[n], predicted from those after it; the first LATEST are left out of the fit. */
static enum bf_status predict_backward(const double z[], size_t n, size_t order, double error[], struct bf_error *err)
{
    const size_t rows = n - order - LATEST;
    double *A = bf_alloc(rows * order, sizeof *A), *coefficient = bf_alloc(order, sizeof *coefficient);
    for (size_t j = 0; j < order; j++)
        memcpy(A + j * rows, z + LATEST + 1 + j, rows * sizeof *A);
    const enum bf_status status = dense_least_squares(rows, order, A, z + LATEST, 1e-8, coefficient, NULL, err);
    for (size_t i = 0; i < n - order && !status; i++) {
        error[i] = z[i];
        for (size_t j = 0; j < order; j++)
            error[i] -= coefficient[j] * z[i + 1 + j];
    }
    free(A), free(coefficient);
    return status;
}

/* Samples of z[n] that do not follow; *times what the others are off by the worst of them is off. */
static enum bf_status cut_of(const double z[], size_t n, size_t *cut, double *times, struct bf_error *err)
{
    n = n < LOOKED_AT ? n : LOOKED_AT;
    const size_t order = n / ROWS_A_TERM < ORDER ? n / ROWS_A_TERM : ORDER;
    *cut = 0, *times = 0.0;
    if (order < LEAST_ORDER)
        return BF_OK;
    double *error = bf_alloc(n - order, sizeof *error);
    const enum bf_status status = predict_backward(z, n, order, error, err);
    const size_t near = n - order - LATEST < 8 * LATEST ? n - order - LATEST : 8 * LATEST;
    const double usual = status ? 0.0 : root_mean_square(error + LATEST, near),
                 least = limits.trifle * root_mean_square(z, n);
    for (size_t i = 0; i < LATEST && !status; i++)
        if (fabs(error[i]) > fmax(limits.noises * usual, least)) {
            *cut = i + 1;
            *times = fmax(*times, fabs(error[i]) / usual);
        }
    if (*cut > LONGEST || *times < limits.worst)
        *cut = 0;
    free(error);
    return status;
}

static bool is_asked(const struct record *record)
{
    return record->kind == RECORD_SAMPLES && record_is_free_decay(record) && record_meta(record, "free_from_s") == NULL;
}

/* The longest cut of its channels. */
static enum bf_status look_at(const struct model *model, const struct record *record, struct decay_start *out,
                              struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *out = (struct decay_start){.record = record};
    for (size_t o = 0; o < model->n_outputs && !status; o++) {
        const double *z = record_column(record, model->outputs[o].name);
        size_t cut = 0;
        double times = 0.0;
        if (z != NULL)
            status = cut_of(z, record->n, &cut, &times, err);
        if (cut > out->n)
            *out = (struct decay_start){.record = record, .channel = model->outputs[o].name, .n = cut, .times = times};
    }
    return status;
}

enum bf_status decay_starts_cut(const struct model *model, struct record *const records[], size_t n_records,
                                struct decay_start_list *out, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *out = (struct decay_start_list){.all = bf_alloc(n_records + 1, sizeof *out->all)};
    for (size_t r = 0; r < n_records && !status; r++) {
        struct decay_start *start = &out->all[out->n];
        if (!is_asked(records[r]))
            continue;
        status = look_at(model, records[r], start, err);
        if (status || start->n == 0)
            continue;
        record_set_free_from(records[r], start->n);
        out->n++;
    }
    return status;
}

void decay_starts_free(struct decay_start_list *list)
{
    free(list->all);
    *list = (struct decay_start_list){0};
}
