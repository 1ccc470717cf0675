/* SPDX-License-Identifier: GPL-3.0-or-later */
/* repeatability.c — repeated hits against the one response that is best for all of them. */
#include "noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double ending = 9.2;  /* time constants in the shortest record: e^-9.2 is 1e-4 */
static const double drives = 0.02; /* an input that is weaker than this, of its largest in any record, is its noise */

struct group {
    const struct model *model;
    const struct record *records;
    size_t input, n;
    size_t record[REPEATS_MOST], from[REPEATS_MOST];
    size_t length; /* samples of each */
    double dt_s;
    const double *noise_rms; /* [n_records][n_outputs]; NULL: unknown */
    double complex *U;       /* [n][bins] */
    size_t size, bins;       /* of the transform */
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

/* Fills record, from, length; n becomes their count. */
static void gather(struct group *g, size_t n_records)
{
    size_t n = 0;
    const char *name = g->model->inputs[g->input].name;
    g->length = SIZE_MAX;
    g->n = n_records;
    for (size_t r = 0; r < n_records && n < REPEATS_MOST; r++) {
        const struct record *record = &g->records[r];
        if (!usable(g, r) || (n > 0 && fabs(record->dt_s / g->dt_s - 1.0) > 1e-9))
            continue;
        const size_t from = repeats_onset(record_column(record, name), record->n);
        if (record->n - from < REPEATS_LEAST)
            continue;
        g->dt_s = record->dt_s;
        g->record[n] = r, g->from[n++] = from;
        g->length = record->n - from < g->length ? record->n - from : g->length;
    }
    g->n = n;
}

/* ---- Spectra ---- */

/* Of the window, 1/sample. */
static double rate(const struct group *g)
{
    return ending / (double)g->length;
}

static void transform(const struct group *g, const struct fft *plan, const char *column, double complex X[])
{
    for (size_t k = 0; k < g->n; k++)
        repeats_spectrum(plan, record_column(&g->records[g->record[k]], column) + g->from[k], g->length, rate(g),
                         X + k * g->bins);
}

/* Mean of Σ |Z|² over the records, in the lines that repeats_judge() takes. */
static double signal_power(const struct group *g, const double complex Z[])
{
    double sum = 0.0;
    for (size_t k = 0; k < g->n; k++)
        for (size_t b = 1; b < g->bins; b++)
            sum += creal(Z[k * g->bins + b] * conj(Z[k * g->bins + b]));
    return sum / (double)g->n;
}

/* What white noise of variance 1 has in those lines under the window: ½ N Σ e^(−2 rate k). */
static double unit_noise_power(const struct group *g)
{
    return 0.5 * (double)g->size * (1.0 - exp(-2.0 * ending)) / (1.0 - exp(-2.0 * rate(g)));
}

/* Mean square of the noise of the records' channel; NAN: unknown in one of them. */
static double noise_power_of(const struct group *g, size_t output)
{
    double sum = 0.0;
    for (size_t k = 0; k < g->n; k++) {
        const double rms = g->noise_rms[g->record[k] * g->model->n_outputs + output];
        sum += rms > 0.0 ? rms * rms : nan("");
    }
    return sum / (double)g->n;
}

static struct repeatability_channel judge(const struct group *g, const double complex Z[], size_t output)
{
    const char *name = g->model->inputs[g->input].name;
    struct repeatability_channel out = {.input = g->input, .output = output, .n_records = g->n};
    repeats_judge(g->U, Z, g->n, g->bins, g->bins, &out.repeats);
    out.repeats.odd = g->record[out.repeats.odd];
    out.scatter_rms = out.repeats.nrmse * sqrt(signal_power(g, Z) / unit_noise_power(g));
    out.noise_ratio = g->noise_rms != NULL ? out.scatter_rms / sqrt(noise_power_of(g, output)) : nan("");
    out.weakest = HUGE_VAL;
    for (size_t k = 0; k < g->n; k++) {
        const double level = largest(&g->records[g->record[k]], name);
        out.weakest = fmin(out.weakest, level), out.strongest = fmax(out.strongest, level);
    }
    return out;
}

static enum bf_status judge_output(const struct group *g, const struct fft *plan, size_t output,
                                   struct repeatability *out)
{
    const char *name = g->model->outputs[output].name;
    for (size_t k = 0; k < g->n; k++)
        if (record_column(&g->records[g->record[k]], name) == NULL)
            return BF_OK;
    double complex *Z = bf_alloc(g->n * g->bins, sizeof *Z);
    transform(g, plan, name, Z);
    out->all = bf_grow(out->all, out->n + 1, sizeof *out->all);
    out->all[out->n++] = judge(g, Z, output);
    free(Z);
    return BF_OK;
}

static enum bf_status judge_group(struct group *g, struct repeatability *out, struct bf_error *err)
{
    const struct fft *plan;
    g->size = fft_good_size(g->length), g->bins = g->size / 2 + 1;
    enum bf_status status = fft_get(g->size, &plan, err);
    if (status != BF_OK)
        return status;
    g->U = bf_alloc(g->n * g->bins, sizeof *g->U);
    transform(g, plan, g->model->inputs[g->input].name, g->U);
    for (size_t o = 0; o < g->model->n_outputs && status == BF_OK; o++)
        status = judge_output(g, plan, o, out);
    free(g->U);
    return status;
}

enum bf_status repeatability_find(const struct model *model, const struct record records[], size_t n_records,
                                  const double noise_rms[], struct repeatability *out, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *out = (struct repeatability){0};
    for (size_t i = 0; i < model->n_inputs && same_beam(model) && status == BF_OK; i++) {
        struct group g = {.model = model, .records = records, .input = i, .noise_rms = noise_rms};
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
