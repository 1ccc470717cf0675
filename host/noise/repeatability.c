/* SPDX-License-Identifier: GPL-3.0-or-later */
/* repeatability.c — repeated hits against the one response that is best for all of them. */
#include "noise.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_RECORDS = 64, BEFORE = 32, LEAST = 256 }; /* samples before the onset; of a record after it */

static const double onset = 0.02;  /* of the largest drive */
static const double ending = 9.2;  /* time constants in the shortest record: e^-9.2 is 1e-4 */
static const double drives = 0.02; /* an input that is weaker than this, of its largest in any record, is its noise */
static const double beyond = 3.0;  /* scatter of all over that without the odd one */
static const double told = 1e-3;   /* |U|² of the others over that of the odd one, in a line that they can judge */

struct group {
    const struct model *model;
    const struct record *records;
    size_t input, n;
    size_t record[MOST_RECORDS], from[MOST_RECORDS];
    size_t length; /* samples of each */
    double dt_s;
    double complex *U; /* [n][bins] */
    size_t size, bins; /* of the transform */
};

/* ---- Which records repeat one another ---- */

static double largest(const struct record *record, const char *name)
{
    const double *u = record_column(record, name);
    double most = 0.0;
    for (size_t k = 0; u != NULL && k < record->n; k++)
        most = fmax(most, fabs(u[k]));
    return most;
}

static bool alone(const struct group *g, size_t r)
{
    for (size_t i = 0; i < g->model->n_inputs; i++) {
        double most = 0.0;
        for (size_t q = 0; q < g->n; q++)
            most = fmax(most, largest(&g->records[q], g->model->inputs[i].name));
        const bool drive = most > 0.0 && largest(&g->records[r], g->model->inputs[i].name) >= drives * most;
        if (drive != (i == g->input))
            return false;
    }
    return true;
}

static bool states_a_place(const struct record *record)
{
    for (size_t m = 0; m < record->n_meta; m++) {
        const char *dot = strrchr(record->meta[m].key, '.');
        if (dot != NULL && strcmp(dot, ".at_m") == 0)
            return true;
    }
    return false;
}

static bool same_beam(const struct model *model)
{
    for (size_t e = 0; e < model->n_effects; e++)
        for (size_t p = 0; p < BEAM_EFFECT_PARAMETERS; p++)
            if (model->effects[e].by_record[p])
                return false;
    return true;
}

static bool usable(const struct group *g, size_t r)
{
    const struct record *record = &g->records[r];
    const char *excitation = record_meta(record, "excitation");
    return (excitation == NULL || strcmp(excitation, "recorded") == 0) && !record_state_is_free(record) &&
           !states_a_place(record) && alone(g, r);
}

static size_t onset_of(const double u[], size_t n, double most)
{
    size_t k = 0;
    while (k < n && !(fabs(u[k]) >= onset * most))
        k++;
    return k > BEFORE ? k - BEFORE : 0;
}

/* Fills record, from, length; n becomes their count. */
static void gather(struct group *g, size_t n_records)
{
    size_t n = 0;
    const char *name = g->model->inputs[g->input].name;
    g->length = SIZE_MAX;
    g->n = n_records;
    for (size_t r = 0; r < n_records && n < MOST_RECORDS; r++) {
        const struct record *record = &g->records[r];
        if (!usable(g, r) || (n > 0 && fabs(record->dt_s / g->dt_s - 1.0) > 1e-9))
            continue;
        const size_t from = onset_of(record_column(record, name), record->n, largest(record, name));
        if (record->n - from < LEAST)
            continue;
        g->dt_s = record->dt_s;
        g->record[n] = r, g->from[n++] = from;
        g->length = record->n - from < g->length ? record->n - from : g->length;
    }
    g->n = n;
}

/* ---- Spectra ---- */

static void transform(const struct group *g, const struct fft *plan, size_t k, const char *column, double *x,
                      double complex *X)
{
    const double *from = record_column(&g->records[g->record[k]], column) + g->from[k];
    const double rate = ending / (double)g->length;
    memset(x, 0, g->size * sizeof *x);
    for (size_t i = 0; i < g->length; i++)
        x[i] = from[i] * exp(-rate * (double)i);
    fft_forward(plan, x, X);
}

static double power(double complex z)
{
    return creal(z * conj(z));
}

/*
 * Scatter of the records without `skip` (SIZE_MAX: all) about their common response, as a share of the signal; and of the one that is skipped. The scatter has a
 * degree of freedom less than records, which is given back.
 */
static double scatter(const struct group *g, const double complex *Z, size_t skip, double *skipped)
{
    const double n = (double)g->n - (skip < g->n ? 1.0 : 0.0);
    double left = 0.0, all = 0.0, odd = 0.0, odd_all = 0.0;
    for (size_t b = 1; b < g->bins; b++) {
        double uu = 0.0;
        double complex uz = 0.0;
        for (size_t k = 0; k < g->n; k++)
            if (k != skip)
                uu += power(g->U[k * g->bins + b]), uz += conj(g->U[k * g->bins + b]) * Z[k * g->bins + b];
        for (size_t k = 0; k < g->n && uu > 0.0; k++) {
            const double complex u = g->U[k * g->bins + b], z = Z[k * g->bins + b];
            if (k != skip)
                left += power(z - uz / uu * u), all += power(z);
            else if (uu > told * power(u))
                odd += power(z - uz / uu * u), odd_all += power(z);
        }
    }
    *skipped = odd_all > 0.0 ? sqrt(odd / odd_all) : 0.0;
    return all > 0.0 ? sqrt(left / all * n / (n - 1.0)) : 0.0;
}

/* The odd one is that without which the others scatter least. */
static struct repeatability_channel judge(const struct group *g, const double complex *Z, size_t output)
{
    double odd;
    struct repeatability_channel out = {.input = g->input, .output = output, .n_records = g->n};
    out.nrmse = scatter(g, Z, SIZE_MAX, &odd);
    out.others_nrmse = HUGE_VAL;
    for (size_t k = 0; k < g->n && g->n >= 3; k++) {
        const double others = scatter(g, Z, k, &odd);
        if (others < out.others_nrmse)
            out.others_nrmse = others, out.odd = g->record[k], out.odd_nrmse = odd;
    }
    out.stands_out = out.others_nrmse * beyond < out.nrmse;
    return out;
}

static enum bf_status judge_output(const struct group *g, const struct fft *plan, size_t output,
                                   struct repeatability *out)
{
    const char *name = g->model->outputs[output].name;
    for (size_t k = 0; k < g->n; k++)
        if (record_column(&g->records[g->record[k]], name) == NULL)
            return BF_OK;
    double *x = bf_alloc(g->size, sizeof *x);
    double complex *Z = bf_alloc(g->n * g->bins, sizeof *Z);
    for (size_t k = 0; k < g->n; k++)
        transform(g, plan, k, name, x, Z + k * g->bins);
    out->all = bf_grow(out->all, out->n + 1, sizeof *out->all);
    out->all[out->n++] = judge(g, Z, output);
    free(x), free(Z);
    return BF_OK;
}

static enum bf_status judge_group(struct group *g, struct repeatability *out, struct bf_error *err)
{
    const struct fft *plan;
    g->size = fft_good_size(g->length), g->bins = g->size / 2 + 1;
    enum bf_status status = fft_get(g->size, &plan, err);
    if (status != BF_OK)
        return status;
    double *x = bf_alloc(g->size, sizeof *x);
    g->U = bf_alloc(g->n * g->bins, sizeof *g->U);
    for (size_t k = 0; k < g->n; k++)
        transform(g, plan, k, g->model->inputs[g->input].name, x, g->U + k * g->bins);
    free(x);
    for (size_t o = 0; o < g->model->n_outputs && status == BF_OK; o++)
        status = judge_output(g, plan, o, out);
    free(g->U);
    return status;
}

enum bf_status repeatability_find(const struct model *model, const struct record records[], size_t n_records,
                                  struct repeatability *out, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *out = (struct repeatability){0};
    for (size_t i = 0; i < model->n_inputs && same_beam(model) && status == BF_OK; i++) {
        struct group g = {.model = model, .records = records, .input = i};
        gather(&g, n_records);
        if (g.n >= 2)
            status = judge_group(&g, out, err);
    }
    return status;
}

void repeatability_free(struct repeatability *repeatability)
{
    free(repeatability->all);
    *repeatability = (struct repeatability){0};
}
