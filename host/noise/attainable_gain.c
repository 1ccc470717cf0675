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
 * What rings longer than the record is cut off at its end: of e^(−2at), noise that came `age` before it, is left (1 − e^(−2a age))/(2a) on the average over
 * the noise, in place of 1/(2a). Under e^(−(a + σ)t) as much is left with the σ below, which unlike an edge leaks nothing of a strong resonance to where noise is kept.
 * A sweep keeps its low frequencies early, so that theirs ring for the whole record.
 */
struct kept_noise {
    const struct column_noise *cells; /* NULL: all is kept */
    size_t n_samples, n_bins;
    double dt_s;
    double *sigma; /* [n_bins] 1/s, of one mode */
};

static double left_at(double a, double age_s)
{
    return 2.0 * a * age_s > 1e-9 ? -expm1(-2.0 * a * age_s) / (2.0 * a) : age_s;
}

/* Noise that came evenly all the time. */
static double left_of_all(double a, double length_s)
{
    return 2.0 * a * length_s > 1e-4 ? (1.0 - left_at(a, length_s) / length_s) / (2.0 * a) : 0.5 * length_s;
}

static double left_of_bin(const struct kept_noise *kept, double a, size_t k)
{
    const struct column_noise *cells = kept->cells;
    const size_t half = cells->segment / 2;
    double sum = 0.0, all = 0.0;
    for (size_t t = 0; t < cells->n_segments; t++)
        if (cells->kept[t * kept->n_bins + k]) {
            /* from the middle of segment t */
            sum += left_at(a, fmax((double)kept->n_samples - (double)(t * half), 1.0) * kept->dt_s);
            all += 1.0;
        }
    return all > 0.0 ? sum / all : left_of_all(a, (double)kept->n_samples * kept->dt_s);
}

/* kept->sigma for e^(−at). */
static void cut_off(struct kept_noise *kept, double a)
{
    for (size_t k = 0; k < kept->n_bins; k++) {
        const double left =
            kept->cells != NULL ? left_of_bin(kept, a, k) : left_of_all(a, (double)kept->n_samples * kept->dt_s);
        kept->sigma[k] = fmax(0.5 / left - a, 0.0);
    }
}

/* Points of the record's bins: of n/2 + 1 bins POINTS each. */
static double frequency_of(const struct kept_noise *kept, size_t point)
{
    const double bin = fabs(((double)point + 0.5) / POINTS - 0.5);
    return 2.0 * bin / (double)kept->n_samples;
}

/* H[points] += mode i of the residues c, cut off. */
static void add_mode(const double x[], const double c[], size_t i, struct kept_noise *kept, size_t points,
                     double complex H[])
{
    const double omega = exp(x[2 * i]), a = exp(x[2 * i + 1]);
    cut_off(kept, a);
    for (size_t p = 0; p < points; p++) {
        const double of_nyquist = frequency_of(kept, p);
        const size_t bin = (size_t)lround(fmin(of_nyquist, 1.0) * (double)(kept->n_bins - 1));
        const double complex s = CMPLX(kept->sigma[bin], M_PI * of_nyquist / kept->dt_s);
        H[p] += omega * omega * (c[2 * i] + c[2 * i + 1] * s / omega) / (s * s + 2.0 * a * s + omega * omega);
    }
}

static double complex paths(const double c[], double complex s)
{
    double complex power = 1.0, sum = 0.0;
    for (size_t j = 0; j < ATTAINABLE_PATHS; j++, power *= s)
        sum += c[j] * power;
    return sum;
}

/* |H|² of the residues c[2 p->m + ATTAINABLE_PATHS] at the poles x times what is kept of the input's noise, mean over each bin. To be freed. */
static double *gain_of(const struct attainable_problem *p, const double x[], const double c[],
                       const struct column_noise *cells)
{
    const struct attainable_record *record = &p->records[0];
    const size_t n_bins = cells != NULL ? cells->segment / 2 + 1 : 1, points = (record->n / 2 + 1) * POINTS;
    struct kept_noise kept = {.cells = cells, .n_samples = record->n, .n_bins = n_bins, .dt_s = record->dt_s};
    double complex *H = bf_alloc(points, sizeof *H);
    double *gain = bf_alloc(record->n / 2 + 1, sizeof *gain);
    kept.sigma = bf_alloc(n_bins, sizeof *kept.sigma);
    for (size_t i = 0; i < p->m; i++)
        add_mode(x, c, i, &kept, points, H);
    for (size_t q = 0; q < points; q++) {
        const double of_nyquist = frequency_of(&kept, q),
                     part = cells != NULL ? input_noise_kept(cells, of_nyquist) : 1.0;
        const double complex sum = H[q] + paths(c + 2 * p->m, CMPLX(0.0, M_PI * of_nyquist / record->dt_s));
        gain[q / POINTS] += part * (creal(sum) * creal(sum) + cimag(sum) * cimag(sum)) / POINTS;
    }
    free(kept.sigma), free(H);
    return gain;
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
            if (inputs[i].u == record->sources[s].u)
                inputs[i].gain =
                    gain_of(&g->problem, g->x, stack.c + stack.column[record->sources[s].slot], inputs[i].cells);
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
