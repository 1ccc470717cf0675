/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_gain.c — how much the free linear model of one record makes of an input's noise: |H|², also between the lines of a drive. */
#include "attainable_problem.h"
#include "noise_input.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Samples before the pulse whose answer is taken: a band-limited pulse has a fore-runner. */
enum { BEFORE = 64 };

/* W[n]: the part of an input's noise that is old enough at the end of the record to have answered for so long. */
static void fill_weights(const struct column_noise *cells, size_t n, double W[])
{
    const size_t half = cells != NULL ? cells->segment / 2 : 1, n_bins = half + 1;
    const size_t n_segments = cells != NULL ? cells->n_segments : n;
    double all = 0.0;
    for (size_t t = 0; t < n; t++)
        W[t] = 0.0;
    for (size_t t = 0; t < n_segments; t++) {
        size_t count = cells == NULL ? 1 : 0;
        for (size_t k = 0; cells != NULL && k < n_bins; k++)
            count += cells->kept[t * n_bins + k];
        const size_t at = t * half, age = at < n ? n - 1 - at : 0; /* the middle of segment t; at most */
        W[age] += (double)count;
        all += (double)count;
    }
    for (size_t t = n - 1; t-- > 0;)
        W[t] += W[t + 1];
    for (size_t t = 0; t < n; t++)
        W[t] = all > 0.0 ? W[t] / all : 0.0;
}

/* H[m] of the residues c[2 · m_poles + ATTAINABLE_PATHS] at the poles x. */
static void fill_H(const struct attainable_problem *p, const double x[], const double c[], const struct response_grid *grid,
                   double complex H[])
{
    for (size_t k = 0; k < grid->m; k++) {
        const double complex s = grid->s[k];
        double complex power = 1.0;
        H[k] = 0.0;
        for (size_t i = 0; i < p->m; i++) {
            const double omega = exp(x[2 * i]), a = exp(x[2 * i + 1]);
            H[k] += omega * omega * (c[2 * i] + c[2 * i + 1] * s / omega) / (s * s + 2.0 * a * s + omega * omega);
        }
        for (size_t j = 0; j < ATTAINABLE_PATHS; j++, power *= s)
            H[k] += c[2 * p->m + j] * power;
    }
}

/*
 * gain[n/2 + 1]: |transform of h(t) √W(t)|², h the answer to one sample of what is kept, filtered without a phase: a resonance where nothing is kept must not
 * leak to where something is.
 */
static enum bf_status fill_gain(const struct response_grid *grid, const struct column_noise *cells, size_t n, double dt_s,
                                const double complex H[], const double W[], double gain[], struct bf_error *err)
{
    const struct fft *plan;
    enum bf_status status = fft_get(n, &plan, err);
    double *h = bf_alloc(grid->n, sizeof *h);
    double complex *X = bf_alloc(grid->m + n, sizeof *X);
    h[BEFORE] = 1.0;
    if (!status)
        status = response_transform(grid, h, grid->n, X, err);
    for (size_t k = 0; k < grid->m && !status; k++)
        X[k] *= H[k] * (cells != NULL ? sqrt(input_noise_kept(cells, cimag(grid->s[k]) * dt_s / M_PI)) : 1.0);
    if (!status)
        status = response_back(grid, X, h, err);
    for (size_t t = 0; t < n; t++)
        h[t] *= sqrt(t > BEFORE ? W[t - BEFORE] : 1.0);
    if (!status)
        fft_forward(plan, h, X);
    for (size_t k = 0; k <= n / 2 && !status; k++)
        gain[k] = creal(X[k]) * creal(X[k]) + cimag(X[k]) * cimag(X[k]);
    free(h), free(X);
    return status;
}

/* ---- One record ---- */

struct gains {
    struct attainable_problem problem;
    struct attainable found;
    double *x; /* [2m] */
    struct attainable_rows rows;
};

static enum bf_status find(const struct model *model, const struct record *record, const double own_rms[],
                           struct gains *g, struct bf_error *err)
{
    const double top_rad = M_PI / record->dt_s;
    struct attainable_problem *p = &g->problem;
    enum bf_status status = attainable_start_poles(model, top_rad, &p->m, &g->x, err);
    if (!status)
        status = attainable_add_record(p, model, record, 0, own_rms, err);
    if (status || p->m == 0 || p->n_channels == 0 || p->n_records != 1)
        return status;
    g->found.channels = bf_alloc(p->n_channels, sizeof *g->found.channels);
    status = attainable_search(p, top_rad, g->x, &g->found, err);
    return !status ? attainable_compress(p, g->x, EXTRA_NONE, &g->rows, err) : status;
}

static enum bf_status of_output(const struct gains *g, size_t output, struct noise_channel_input inputs[], size_t n_inputs,
                                struct bf_error *err)
{
    const struct attainable_record *record = &g->problem.records[0];
    struct attainable_stack stack;
    attainable_stack_new(&g->problem, &g->rows, output, &stack);
    enum bf_status status = attainable_stack_solve(&stack, err);
    double complex *H = bf_alloc(record->grid.m, sizeof *H);
    double *W = bf_alloc(record->n, sizeof *W);
    for (size_t s = 0; s < record->n_sources && stack.n_parts > 0 && !status; s++)
        for (size_t i = 0; i < n_inputs && !status; i++)
            if (inputs[i].u == record->sources[s].u) {
                fill_H(&g->problem, g->x, stack.c + stack.column[record->sources[s].slot], &record->grid, H);
                fill_weights(inputs[i].cells, record->n, W);
                inputs[i].gain = bf_alloc(record->n / 2 + 1, sizeof *inputs[i].gain);
                status = fill_gain(&record->grid, inputs[i].cells, record->n, record->dt_s, H, W, inputs[i].gain, err);
            }
    free(H), free(W);
    attainable_stack_free(&stack);
    return status;
}

enum bf_status attainable_gains(const struct model *model, const struct record *record, const double own_rms[],
                                struct noise_channel_input inputs[], size_t n_inputs, struct bf_error *err)
{
    struct gains g = {.problem = {.n_slots = model->n_inputs, .n_outputs = model->n_outputs}};
    enum bf_status status = find(model, record, own_rms, &g, err);
    const bool usable = !status && g.rows.R != NULL && record->n > 2 * BEFORE;
    for (size_t o = 0; o < model->n_outputs && usable && !status; o++)
        status = of_output(&g, o, inputs + o * n_inputs, n_inputs, err);
    if (g.rows.R != NULL)
        attainable_rows_free(&g.rows, 1);
    attainable_free(&g.found);
    attainable_problem_free(&g.problem);
    free(g.x);
    return status;
}
