/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_gain.c — how much the free linear model of one record makes of an input's noise: |H|², also between the lines of a drive. */
#include "attainable_problem.h"
#include "noise_input.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Points in a bin: a resonance that rings for the whole record is a sixth of a bin wide. */
enum { POINTS = 8 };

/*
 * Samples that noise of the input has on the average until the record ends. What rings longer is cut off there: as much of its power is lost under
 * e^(−σt) with 2σ = 1/age, which unlike an edge leaks nothing of a strong resonance to where noise is kept.
 */
static double mean_age(const struct column_noise *cells, size_t n)
{
    double sum = 0.0, all = 0.0;
    if (cells == NULL)
        return 0.5 * (double)n;
    const size_t half = cells->segment / 2, n_bins = half + 1;
    for (size_t t = 0; t < cells->n_segments; t++) {
        size_t count = 0;
        for (size_t k = 0; k < n_bins; k++)
            count += cells->kept[t * n_bins + k];
        sum += (double)count * fmax((double)n - (double)(t * half), 1.0); /* from the middle of segment t */
        all += (double)count;
    }
    return all > 0.0 ? sum / all : 1.0;
}

/* |H|² at s of the residues c[2 p->m + ATTAINABLE_PATHS] at the poles x. */
static double square_H(const struct attainable_problem *p, const double x[], const double c[], double complex s)
{
    double complex power = 1.0, H = 0.0;
    for (size_t i = 0; i < p->m; i++) {
        const double omega = exp(x[2 * i]), a = exp(x[2 * i + 1]);
        H += omega * omega * (c[2 * i] + c[2 * i + 1] * s / omega) / (s * s + 2.0 * a * s + omega * omega);
    }
    for (size_t j = 0; j < ATTAINABLE_PATHS; j++, power *= s)
        H += c[2 * p->m + j] * power;
    return creal(H) * creal(H) + cimag(H) * cimag(H);
}

/* gain[n/2 + 1]: mean over a bin of the kept part times |H(σ + iω)|². */
static void fill_gain(const struct attainable_problem *p, const double x[], const double c[],
                      const struct column_noise *cells, size_t n, double dt_s, double gain[])
{
    const double sigma = 0.5 / mean_age(cells, n) / dt_s;
    for (size_t k = 0; k <= n / 2; k++)
        for (size_t i = 0; i < POINTS; i++) {
            const double bin = fabs((double)k + ((double)i + 0.5) / POINTS - 0.5),
                         omega = 2.0 * M_PI * bin / ((double)n * dt_s);
            const double kept = cells != NULL ? input_noise_kept(cells, 2.0 * bin / (double)n) : 1.0;
            if (kept > 0.0)
                gain[k] += kept * square_H(p, x, c, CMPLX(sigma, omega)) / POINTS;
        }
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
        attainable_add_record(p, model, record, 0, own_rms);
    if (status || p->m == 0 || p->n_channels == 0 || p->n_records != 1)
        return status;
    g->found.channels = bf_alloc(p->n_channels, sizeof *g->found.channels);
    status = attainable_search(p, top_rad, g->x, &g->found, err);
    return !status ? attainable_compress(p, g->x, EXTRA_NONE, &g->rows, err) : status;
}

static enum bf_status of_output(const struct gains *g, size_t output, struct noise_channel_input inputs[],
                                size_t n_inputs, struct bf_error *err)
{
    const struct attainable_record *record = &g->problem.records[0];
    struct attainable_stack stack;
    attainable_stack_new(&g->problem, &g->rows, output, &stack);
    const enum bf_status status = attainable_stack_solve(&stack, err);
    for (size_t s = 0; s < record->n_sources && stack.n_parts > 0 && !status; s++)
        for (size_t i = 0; i < n_inputs; i++)
            if (inputs[i].u == record->sources[s].u) {
                inputs[i].gain = bf_alloc(record->n / 2 + 1, sizeof *inputs[i].gain);
                fill_gain(&g->problem, g->x, stack.c + stack.column[record->sources[s].slot], inputs[i].cells,
                          record->n, record->dt_s, inputs[i].gain);
            }
    attainable_stack_free(&stack);
    return status;
}

enum bf_status attainable_gains(const struct model *model, const struct record *record, const double own_rms[],
                                struct noise_channel_input inputs[], size_t n_inputs, struct bf_error *err)
{
    struct gains g = {.problem = {.n_slots = model->n_inputs, .n_outputs = model->n_outputs, .rough = true}};
    enum bf_status status = find(model, record, own_rms, &g, err);
    const bool usable = !status && g.rows.R != NULL;
    for (size_t o = 0; o < model->n_outputs && usable && !status; o++)
        status = of_output(&g, o, inputs + o * n_inputs, n_inputs, err);
    if (g.rows.R != NULL)
        attainable_rows_free(&g.rows, 1);
    free(g.found.channels);
    attainable_problem_free(&g.problem);
    free(g.x);
    return status;
}
