/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How far apart two rivals are in an experiment after the wrong one was fitted again. */
#include "discriminate_state.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

static const double ridge = 1e-12; /* relative to a unit diagonal */

/* Gram matrix of (J_b, Δ) in one channel: [(m + 1)²] over the m free parameters. */
static void channel_gram(const struct discriminate_state *w, const struct forecast *a, const struct forecast *b,
                         const size_t used[], size_t m, size_t channel, double *columns, double gram[])
{
    const size_t n = w->n, rows = (w->n_outputs + w->d->n_sensors) * n;
    for (size_t j = 0; j < m; j++)
        memcpy(columns + j * n, b->jacobian + used[j] * rows + channel * n, n * sizeof *columns);
    for (size_t k = 0; k < n; k++)
        columns[m * n + k] = a->y[channel * n + k] - b->y[channel * n + k];
    dense_gram(n, m + 1, columns, gram);
}

/* min over δ of ‖Δ − J δ‖² + δᵀ H δ from the Gram matrix of (J, Δ) and H of the free parameters. */
static enum bf_status left_over(size_t m, const double gram[], const double H[], double *out, struct bf_error *err)
{
    double *A = bf_alloc(m * m, sizeof *A), *x = bf_alloc(m, sizeof *x), *g = bf_alloc(m, sizeof *g);
    double *scale = bf_alloc(m, sizeof *scale);
    const double total = gram[m + m * (m + 1)];
    for (size_t j = 0; j < m; j++) {
        const double size = gram[j + j * (m + 1)] + H[j + j * m];
        scale[j] = size > 0.0 ? 1.0 / sqrt(size) : 0.0;
    }
    for (size_t j = 0; j < m; j++) {
        for (size_t i = 0; i < m; i++)
            A[i + j * m] = scale[i] * scale[j] * (gram[i + j * (m + 1)] + H[i + j * m]);
        A[j * (m + 1)] = 1.0 + ridge;
        x[j] = g[j] = scale[j] * gram[j + m * (m + 1)];
    }
    const enum bf_status status = m > 0 ? dense_cholesky_solve(m, 1, A, x, err) : BF_OK;
    if (!status)
        *out = fmax(total - (m > 0 ? dense_dot(m, g, x) : 0.0), 0.0);
    free(A), free(x), free(g), free(scale);
    return status;
}

enum bf_status pair_evidence(const struct discriminate_state *w, const struct forecast *a, const struct forecast *b,
                             const double H[], double evidence[], struct bf_error *err)
{
    const size_t n_sensors = w->d->n_sensors, n_parameters = b->n_parameters;
    size_t *used = bf_alloc(n_parameters, sizeof *used), m = 0;
    for (size_t i = 0; i < n_parameters; i++)
        if (!b->refs[i].info->fixed)
            used[m++] = i;
    const size_t size = (m + 1) * (m + 1);
    double *columns = bf_alloc((m + 1) * w->n, sizeof *columns), *known = bf_alloc(m * m, sizeof *known);
    double *base = bf_alloc(size, sizeof *base), *gram = bf_alloc(size, sizeof *gram);
    for (size_t j = 0; j < m; j++)
        for (size_t i = 0; i < m; i++)
            known[i + j * m] = H[used[i] + used[j] * n_parameters];
    for (size_t c = 0; c < w->n_outputs; c++) {
        channel_gram(w, a, b, used, m, c, columns, gram);
        for (size_t i = 0; i < size; i++)
            base[i] += gram[i];
    }
    enum bf_status status = left_over(m, base, known, &evidence[n_sensors], err);
    for (size_t s = 0; s < n_sensors && !status; s++) {
        channel_gram(w, a, b, used, m, w->n_outputs + s, columns, gram);
        for (size_t i = 0; i < size; i++)
            gram[i] += base[i];
        status = left_over(m, gram, known, &evidence[s], err);
    }
    free(used), free(columns), free(known), free(base), free(gram);
    return status;
}

static void name_experiment(const struct discrimination *d, struct experiment *x)
{
    const char *drive = d->drives[x->drive].name;
    if (x->sensor == d->n_sensors)
        (void)snprintf(x->name, sizeof x->name, "%s", drive);
    else
        (void)snprintf(x->name, sizeof x->name, "%.180s + %s at %.3f m", drive,
                       model_output_kind_name(d->sensors[x->sensor].kind), d->sensors[x->sensor].at_m);
}

/* The worst pair decides. */
static void judge(const struct discriminate_state *w, struct experiment *x)
{
    const struct discrimination *d = w->d;
    x->evidence = INFINITY;
    for (size_t p = 0; p < d->n_pairs; p++) {
        struct discriminate_pair *pair = &x->pairs[p];
        pair->wrong_choice = 0.5 * erfc(sqrt(pair->evidence / 8.0));
        x->evidence = fmin(x->evidence, pair->evidence);
    }
    const size_t channels = w->n_outputs + (x->sensor < d->n_sensors ? 1 : 0);
    x->per_sample = sqrt(x->evidence / (double)(channels * w->n));
    x->wrong_choice = 0.5 * erfc(sqrt(x->evidence / 8.0));
}

static enum bf_status all_pairs(const struct discriminate_state *w, const struct forecast forecasts[],
                                double *const H[], struct experiment out[], struct bf_error *err)
{
    const struct discrimination *d = w->d;
    const size_t sets = d->n_sensors + 1;
    double *there = bf_alloc(sets, sizeof *there), *back = bf_alloc(sets, sizeof *back);
    enum bf_status status = BF_OK;
    size_t p = 0;
    for (size_t a = 0; a < d->n_rivals && !status; a++) {
        for (size_t b = a + 1; b < d->n_rivals && !status; b++, p++) {
            status = pair_evidence(w, &forecasts[a], &forecasts[b], H[b], there, err);
            if (!status)
                status = pair_evidence(w, &forecasts[b], &forecasts[a], H[a], back, err);
            for (size_t s = 0; s < sets && !status; s++)
                out[s].pairs[p] = (struct discriminate_pair){.a = a, .b = b, .evidence = fmin(there[s], back[s])};
        }
    }
    free(there), free(back);
    return status;
}

enum bf_status drive_experiments(const struct discriminate_state *w, size_t drive, struct experiment out[],
                                 struct bf_error *err)
{
    const struct discrimination *d = w->d;
    struct forecast forecasts[DISCRIMINATE_RIVALS];
    memset(forecasts, 0, sizeof forecasts);
    double *H[DISCRIMINATE_RIVALS] = {NULL};
    struct whitener *whiteners = bf_alloc(w->n_outputs + d->n_sensors, sizeof *whiteners);
    enum bf_status status = BF_OK;
    for (size_t s = 0; s <= d->n_sensors; s++) {
        out[s] = (struct experiment){.drive = drive, .sensor = s};
        out[s].pairs = bf_alloc(d->n_pairs, sizeof *out[s].pairs);
        name_experiment(d, &out[s]);
    }
    for (size_t r = 0; r < d->n_rivals && !status; r++) {
        status = forecast_make(w, &d->models[r], &d->drives[drive], true, &forecasts[r], err);
        if (status)
            break;
        H[r] = bf_alloc(forecasts[r].n_parameters * forecasts[r].n_parameters, sizeof *H[r]);
        forecast_information(w, &forecasts[r], w->information[r], &d->drives[drive], H[r]);
    }
    if (!status) {
        noise_of_experiment(w, forecasts, d->n_rivals, whiteners);
        for (size_t r = 0; r < d->n_rivals; r++)
            forecast_whiten(w, whiteners, &forecasts[r]);
        status = all_pairs(w, forecasts, H, out, err);
    }
    for (size_t s = 0; s <= d->n_sensors && !status; s++)
        judge(w, &out[s]);
    for (size_t r = 0; r < d->n_rivals; r++) {
        forecast_free(&forecasts[r]);
        free(H[r]);
    }
    free(whiteners);
    return status;
}
