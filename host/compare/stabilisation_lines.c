/* SPDX-License-Identifier: GPL-3.0-or-later */
/* stabilisation_lines.c — one channel of one record as lines over frequency, with their weights. */
#include "maths/maths.h"
#include "stabilisation.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMOOTHED = 50 };                   /* the mean about a line is over a fiftieth of the band */
static const double form_error = 1e-3;    /* of the lines about one: what keeps a channel without noise finite */
static const double never_driven = 1e-12; /* of an input's power in the record, relative to the largest: no input */

bool stabilisation_uses(const struct comparison *all, const struct comparison_channel *c)
{
    return c->record < all->n_records - all->n_held_out && c->n >= 2 * STABILISATION_FEWEST_LINES && c->rms > 0.0;
}

void stabilisation_lines_free(struct stabilisation_lines *l)
{
    for (size_t s = 0; s < l->n_signals; s++)
        free(l->signal[s]);
    free(l->weight);
}

static double complex *spectrum_of(const struct fft *plan, const double x[], size_t n)
{
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    fft_forward(plan, x, X);
    return X;
}

static void add_inputs(const struct comparison *all, const struct comparison_channel *c, const struct fft *plan,
                       struct stabilisation_lines *l)
{
    const struct record *record = &all->records[c->record];
    const size_t first = (size_t)(c->measured - record_column(record, c->name));
    const double *input[COMPARE_INPUTS] = {0};
    double power[COMPARE_INPUTS] = {0}, most = 0.0;
    if (record_is_free_decay(record))
        return;
    for (size_t i = 0; i < all->model->n_inputs && i < COMPARE_INPUTS; i++) {
        input[i] = record_column(record, all->model->inputs[i].name);
        power[i] = input[i] != NULL ? dense_dot(c->n, input[i] + first, input[i] + first) : 0.0;
        most = fmax(most, power[i]);
    }
    for (size_t i = 0; i < COMPARE_INPUTS; i++)
        if (power[i] > never_driven * most) {
            l->input[l->n_signals] = i;
            l->signal[l->n_signals++] = spectrum_of(plan, input[i] + first, c->n);
        }
}

/* Σ |Y|² of the lines below k at [k]. */
static double *running_power(const double complex Y[], size_t n_lines)
{
    double *sum = bf_alloc(n_lines + 2, sizeof *sum);
    for (size_t k = 1; k <= n_lines; k++)
        sum[k + 1] = sum[k] + creal(Y[k]) * creal(Y[k]) + cimag(Y[k]) * cimag(Y[k]);
    return sum;
}

/* Of |Y|² at line k. */
static double noise_of_line(const struct comparison_channel *c, size_t k, double df_Hz)
{
    if (c->noise.n_bins < 2)
        return 0.0;
    const size_t bin = (size_t)((double)k * df_Hz / c->noise.df_Hz + 0.5);
    return c->noise.psd[bin < c->noise.n_bins ? bin : c->noise.n_bins - 1] * (double)c->n / (2.0 * c->dt_s);
}

/* 1/(noise² + form²) of each line, over their number; form: a share of the mean about the line and a smaller one of all. */
static void find_weights(const struct comparison_channel *c, struct stabilisation_lines *l)
{
    const size_t reach = l->n_lines / SMOOTHED / 2 + 1;
    double *sum = running_power(l->signal[0], l->n_lines);
    const double all = sum[l->n_lines + 1] / (double)l->n_lines;
    l->weight = bf_alloc(l->n_lines + 1, sizeof *l->weight);
    for (size_t k = 1; k <= l->n_lines; k++) {
        const size_t from = k > reach ? k - reach : 1, to = k + reach < l->n_lines ? k + reach : l->n_lines;
        const double near = (sum[to + 1] - sum[from]) / (double)(to + 1 - from);
        const double error = noise_of_line(c, k, l->df_Hz) + form_error * form_error * (near + form_error * all);
        l->weight[k] = 1.0 / (error * (double)l->n_lines);
    }
    free(sum);
}

/* Signals of about the same size, so that one ridge serves all. */
static void scale_signals(struct stabilisation_lines *l)
{
    for (size_t s = 1; s < l->n_signals; s++) {
        double sum = 0.0;
        for (size_t k = 1; k <= l->n_lines; k++)
            sum += l->weight[k] *
                   (creal(l->signal[s][k]) * creal(l->signal[s][k]) + cimag(l->signal[s][k]) * cimag(l->signal[s][k]));
        const double scale = l->scale[s] = sum > 0.0 ? 1.0 / sqrt(sum) : 0.0;
        for (size_t k = 1; k <= l->n_lines; k++)
            l->signal[s][k] *= scale;
    }
}

enum bf_status stabilisation_lines_take(const struct comparison *all, const struct comparison_channel *c, double to_Hz,
                                        struct stabilisation_lines *l, struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(c->n, &plan, err);
    *l = (struct stabilisation_lines){.df_Hz = 1.0 / ((double)c->n * c->dt_s)};
    if (status != BF_OK)
        return status;
    const size_t top = (size_t)(to_Hz / l->df_Hz + 1e-9), half = (c->n - 1) / 2;
    l->n_lines = top < half ? top : half;
    l->signal[l->n_signals++] = spectrum_of(plan, c->measured, c->n);
    l->signal[l->n_signals++] = bf_alloc(c->n / 2 + 1, sizeof **l->signal);
    for (size_t k = 0; k <= l->n_lines; k++)
        l->signal[1][k] = 1.0;
    add_inputs(all, c, plan, l);
    find_weights(c, l);
    scale_signals(l);
    return status;
}
