/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * input_clean.c — a measured input without its sensor's noise where its drive is not: INPUTS in noise.h.
 *
 * Segments under Vorbis's window sin(π/2 sin²), half overlapping, before and after the transform: the squares add up to one, so that what is kept comes back
 * as it was, and a line leaks less than under the root of Hann's. A short segment holds a blow, a longer one a sweep, a very long one the lines of a multisine: that length is taken which keeps least.
 */
#include "noise.h"
#include "spectrogram.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* All that is set by hand. */
static const struct input_clean_limits {
    size_t shortest; /* segment */
    double
        stands_out; /* times the noise, the mean power of 3 × 3 cells: noise alone has so much in one of ten thousand */
    double worthwhile; /* part of the cells: an input that keeps more stays as it is */
} limits = {.shortest = 64, .stands_out = 4.0, .worthwhile = 0.9};

/* Segments of that length, half overlapping, the first of which begins before the samples; free(window). */
static enum bf_status segments_new(size_t n_samples, size_t length, struct spectrogram *s, struct bf_error *err)
{
    *s = (struct spectrogram){.segment = length, .hop = length / 2, .n_bins = length / 2 + 1};
    s->n_times = (n_samples + s->hop - 1) / s->hop + 1;
    const enum bf_status status = fft_get(length, &s->plan, err);
    if (status)
        return status;
    s->window = bf_alloc(length, sizeof *s->window);
    for (size_t i = 0; i < length; i++)
        s->window[i] = sin(0.5 * M_PI * pow(sin(M_PI * ((double)i + 0.5) / (double)length), 2.0));
    return BF_OK;
}

/* y[n] += segment t, through a[segment]. */
static void add_back(const struct spectrogram *s, const double complex X[], size_t n, size_t t, double a[], double y[])
{
    fft_inverse(s->plan, X, a);
    for (size_t i = 0; i < s->segment; i++) {
        const size_t at = t * s->hop + i; /* sample + hop */
        if (at >= s->hop && at - s->hop < n)
            y[at - s->hop] += s->window[i] * a[i];
    }
}

/* ---- Which cells stay ---- */

/* Mean of the cell and of those around it; at an edge the edge stands for what is beyond. */
static double mean_around(const struct spectrogram *s, const double power[], size_t t, size_t k)
{
    const size_t from_t = t > 0 ? t - 1 : 0, to_t = t + 1 < s->n_times ? t + 1 : t;
    const size_t from_k = k > 0 ? k - 1 : 0, to_k = k + 1 < s->n_bins ? k + 1 : k;
    double sum = 0.0;
    for (size_t i = from_t; i <= to_t; i++)
        for (size_t j = from_k; j <= to_k; j++)
            sum += power[i * s->n_bins + j];
    return sum / (double)((to_t - from_t + 1) * (to_k - from_k + 1));
}

/* kept[n_times][n_bins]; the part of the cells that is. */
static double choose(const struct spectrogram *s, const double u[], size_t n, double rms, unsigned char kept[])
{
    const double white = rms * rms * 0.5 * (double)s->segment; /* squares that add up to one: half of the samples */
    double *power = bf_alloc(s->n_times * s->n_bins, sizeof *power);
    size_t count = 0;
    spectrogram_power(s, u, n, power);
    for (size_t t = 0; t < s->n_times; t++)
        for (size_t k = 0; k < s->n_bins; k++) {
            kept[t * s->n_bins + k] = mean_around(s, power, t, k) > limits.stands_out * white;
            count += kept[t * s->n_bins + k];
        }
    free(power);
    return (double)count / (double)(s->n_times * s->n_bins);
}

/* The length that keeps least; share: what that is. */
static enum bf_status find_cells(const double u[], size_t n, double rms, struct column_noise *out, double *share,
                                 struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *share = 1.0;
    *out = (struct column_noise){.rms = rms};
    for (size_t length = limits.shortest; length <= n && !status; length *= 2) {
        struct spectrogram s;
        status = segments_new(n, length, &s, err);
        if (status)
            break;
        unsigned char *kept = bf_alloc(s.n_times * s.n_bins, sizeof *kept);
        const double part = choose(&s, u, n, rms, kept);
        if (part < *share) {
            free(out->kept);
            *share = part;
            out->segment = length, out->n_segments = s.n_times, out->kept = kept;
        } else {
            free(kept);
        }
        free(s.window);
    }
    return status;
}

/* ---- What stays ---- */

enum bf_status input_noise_keep(const struct column_noise *noise, const double x[], size_t n, double y[],
                                struct bf_error *err)
{
    struct spectrogram s;
    const enum bf_status status = segments_new(n, noise->segment, &s, err);
    if (status)
        return status;
    double *a = bf_alloc(s.segment, sizeof *a), *sum = bf_alloc(n, sizeof *sum);
    double complex *X = bf_alloc(s.n_bins, sizeof *X);
    for (size_t t = 0; t < s.n_times && t < noise->n_segments; t++) {
        spectrogram_segment(&s, x, n, t, a, X);
        for (size_t k = 0; k < s.n_bins; k++)
            X[k] = noise->kept[t * s.n_bins + k] ? X[k] : 0.0;
        add_back(&s, X, n, t, a, sum);
    }
    memcpy(y, sum, n * sizeof *y);
    free(a), free(X), free(sum), free(s.window);
    return BF_OK;
}

double input_noise_kept(const struct column_noise *noise, double of_nyquist)
{
    const size_t last = noise->segment / 2;
    const double at = fmin(of_nyquist, 1.0) * (double)last, below = fmin(floor(at), (double)last - 1.0);
    const double *share = noise->share + (size_t)below;
    return (1.0 - at + below) * share[0] + (at - below) * share[1];
}

static double *shares(const struct column_noise *noise)
{
    const size_t n_bins = noise->segment / 2 + 1;
    double *share = bf_alloc(n_bins, sizeof *share);
    for (size_t t = 0; t < noise->n_segments; t++)
        for (size_t k = 0; k < n_bins; k++)
            share[k] += (double)noise->kept[t * n_bins + k] / (double)noise->n_segments;
    return share;
}

/* ---- Records ---- */

static bool may_clean(const struct record *record)
{
    const char *stated = record_meta(record, "input_noise");
    return record->kind == RECORD_SAMPLES && !record_is_periodic(record) &&
           (stated == NULL || strcmp(stated, "keep") != 0);
}

static double peak_of(const double u[], size_t n)
{
    double peak = 0.0;
    for (size_t i = 0; i < n; i++)
        peak = fmax(peak, fabs(u[i]));
    return peak;
}

static enum bf_status clean(struct record *record, struct record_column *column, struct clean_input_list *out,
                            struct bf_error *err)
{
    const double rms = column->noise == NULL ? noise_of_input(column->x, record->n) : 0.0;
    struct column_noise found;
    double share;
    if (!(rms > 0.0))
        return BF_OK;
    enum bf_status status = find_cells(column->x, record->n, rms, &found, &share, err);
    const bool gains = found.segment > 0 && share < limits.worthwhile;
    const double peak = peak_of(column->x, record->n);
    if (!status && gains)
        status = input_noise_keep(&found, column->x, record->n, column->x, err);
    if (status || !gains) {
        free(found.kept);
        return status;
    }
    out->all = bf_grow(out->all, out->n + 1, sizeof *out->all);
    out->all[out->n++] =
        (struct clean_input){.record = record, .channel = column->name, .noise = rms / peak, .kept = share};
    found.share = shares(&found);
    column->noise = bf_alloc(1, sizeof *column->noise);
    *column->noise = found;
    return BF_OK;
}

static bool is_input(const struct model *model, const char *name)
{
    for (size_t i = 0; i < model->n_inputs; i++)
        if (strcmp(model->inputs[i].name, name) == 0)
            return true;
    return false;
}

enum bf_status inputs_clean(const struct model *model, struct record *const records[], size_t n_records,
                            struct clean_input_list *out, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *out = (struct clean_input_list){0};
    for (size_t r = 0; r < n_records; r++)
        for (size_t c = 0; c < records[r]->n_columns && may_clean(records[r]) && !status; c++)
            if (is_input(model, records[r]->columns[c].name))
                status = clean(records[r], &records[r]->columns[c], out, err);
    return status;
}

void inputs_clean_free(struct clean_input_list *list)
{
    free(list->all);
    *list = (struct clean_input_list){0};
}
