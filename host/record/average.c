/* SPDX-License-Identifier: GPL-3.0-or-later */
/* average.c — repeated hits as one frequency response: H1 and the coherence, so that what did not repeat is known line by line. */
#include "record.h"

#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

enum { TAIL = 16 };                   /* the end of a record is one part in so many */
static const double left_over = 1e-4; /* of the largest value, at the end of a record under the window */
static const double driven = 1e-2;    /* of the largest power of the hits: below these 20 dB a hammer tells little */

/* What is known while records are averaged. */
struct averaging {
    const struct record *records;
    size_t n, length, bins, lines; /* records; samples of each; of a transform; from 0 Hz, that are written */
    size_t from[REPEATS_MOST];
    const struct fft *plan;
    double rate;       /* 1/sample, of the window */
    double complex *U; /* [n][bins] */
    struct average *said;
};

/* ---- What is averaged ---- */

static enum bf_status find_input(struct averaging *a, const char *wanted, struct bf_error *err)
{
    const struct record *record = &a->records[0];
    for (size_t c = 0; c < record->n_columns; c++) {
        const char *name = record->columns[c].name;
        if (wanted != NULL ? strcmp(name, wanted) != 0 : !record_is_force(NULL, name))
            continue;
        if (a->said->input != NULL)
            return bf_fail(err, BF_USAGE, "%s: %s and %s are forces; say which hits with --input", record->path,
                           a->said->input, name);
        a->said->input = name;
    }
    if (a->said->input == NULL)
        return bf_fail(err, BF_USAGE, "%s: no column %s; say which one hits with --input", record->path,
                       wanted != NULL ? wanted : "of force (…_N)");
    return BF_OK;
}

static void find_outputs(struct averaging *a)
{
    const struct record *record = &a->records[0];
    a->said->outputs = bf_alloc(record->n_columns + 1, sizeof *a->said->outputs);
    for (size_t c = 0; c < record->n_columns; c++)
        if (strcmp(record->columns[c].name, a->said->input) != 0 && record_is_signal(NULL, record->columns[c].name))
            a->said->outputs[a->said->n_outputs++] = record->columns[c].name;
    a->said->agree = bf_alloc(a->said->n_outputs + 1, sizeof *a->said->agree);
}

/* "hammer_N.at_m: 0.12" */
static bool is_place(const struct record_meta *meta)
{
    const char *dot = strrchr(meta->key, '.');
    return dot != NULL && strcmp(dot, ".at_m") == 0;
}

/* Places that `record` states, of those that `other` does not state likewise; NULL: none. */
static const char *moved(const struct record *record, const struct record *other)
{
    for (size_t m = 0; m < record->n_meta; m++) {
        const char *there = record_meta(other, record->meta[m].key);
        if (is_place(&record->meta[m]) && (there == NULL || strcmp(there, record->meta[m].value) != 0))
            return record->meta[m].key;
    }
    return NULL;
}

static enum bf_status check_place(const struct averaging *a, const struct record *record, struct bf_error *err)
{
    const char *key = moved(record, &a->records[0]);
    key = key != NULL ? key : moved(&a->records[0], record);
    if (key == NULL)
        return BF_OK;
    return bf_fail(err, BF_BAD_FILE, "%s: '%s' is not that of %s; average the hits of one place, a file for each place",
                   record->path, key, a->records[0].path);
}

static enum bf_status check_record(const struct averaging *a, const struct record *record, struct bf_error *err)
{
    const char *excitation = record_meta(record, "excitation");
    if (record->kind != RECORD_SAMPLES || record_is_periodic(record) || record_state_is_free(record) ||
        (excitation != NULL && strcmp(excitation, "recorded") != 0))
        return bf_fail(err, BF_BAD_FILE, "%s: is no hit from rest; average hits, whose force was recorded",
                       record->path);
    if (fabs(record->dt_s / a->records[0].dt_s - 1.0) > 1e-9)
        return bf_fail(err, BF_BAD_FILE, "%s: %.9g Hz, and %s %.9g Hz; import it again with --resample", record->path,
                       1.0 / record->dt_s, a->records[0].path, 1.0 / a->records[0].dt_s);
    if (record_column(record, a->said->input) == NULL)
        return bf_fail(err, BF_BAD_FILE, "%s: there is no column '%s'", record->path, a->said->input);
    for (size_t o = 0; o < a->said->n_outputs; o++)
        if (record_column(record, a->said->outputs[o]) == NULL)
            return bf_fail(err, BF_BAD_FILE, "%s: there is no column '%s', which %s has", record->path,
                           a->said->outputs[o], a->records[0].path);
    return check_place(a, record, err);
}

/* Where each begins, how strong it is, and what all have. */
static enum bf_status find_hits(struct averaging *a, struct bf_error *err)
{
    a->said->level = bf_alloc(a->n, sizeof *a->said->level);
    a->length = SIZE_MAX;
    for (size_t r = 0; r < a->n; r++) {
        const struct record *record = &a->records[r];
        const enum bf_status status = check_record(a, record, err);
        if (status != BF_OK)
            return status;
        const double *u = record_column(record, a->said->input);
        a->from[r] = repeats_onset(u, record->n);
        for (size_t k = 0; k < record->n; k++)
            a->said->level[r] = fmax(a->said->level[r], fabs(u[k]));
        if (record->n - a->from[r] < REPEATS_LEAST || !(a->said->level[r] > 0.0))
            return bf_fail(err, BF_BAD_FILE, "%s: no hit in '%s' with %d samples behind it", record->path,
                           a->said->input, REPEATS_LEAST);
        a->length = record->n - a->from[r] < a->length ? record->n - a->from[r] : a->length;
    }
    return BF_OK;
}

/* ---- Spectra ---- */

/* How many times a signal is too large at its end. */
static double too_large(const double x[], size_t n)
{
    double largest = 0.0;
    for (size_t k = 0; k < n; k++)
        largest = fmax(largest, fabs(x[k]));
    return largest > 0.0 ? root_mean_square(x + n - n / TAIL, n / TAIL) / (left_over * largest) : 1.0;
}

static void find_window(struct averaging *a, double wanted_s)
{
    const double dt_s = a->records[0].dt_s;
    double most = 1.0;
    for (size_t r = 0; r < a->n; r++)
        for (size_t o = 0; o < a->said->n_outputs; o++)
            most = fmax(most, too_large(record_column(&a->records[r], a->said->outputs[o]) + a->from[r], a->length));
    a->rate = wanted_s > 0.0 ? dt_s / wanted_s : log(most) / (double)a->length; /* e^(−rate n) = 1/most */
    a->said->window_s = a->rate > 0.0 ? dt_s / a->rate : 0.0;
}

static void transform(const struct averaging *a, const char *column, double complex X[])
{
    for (size_t r = 0; r < a->n; r++)
        repeats_spectrum(a->plan, record_column(&a->records[r], column) + a->from[r], a->length, a->rate,
                         X + r * a->bins);
}

static double drive(const struct averaging *a, size_t b)
{
    double sum = 0.0;
    for (size_t r = 0; r < a->n; r++)
        sum += creal(a->U[r * a->bins + b] * conj(a->U[r * a->bins + b]));
    return sum;
}

static void find_lines(struct averaging *a, double wanted_Hz)
{
    const double df_Hz = 1.0 / ((double)fft_size(a->plan) * a->records[0].dt_s);
    double most = 0.0;
    for (size_t b = 1; b < a->bins; b++)
        most = fmax(most, drive(a, b));
    a->lines = 2;
    while (a->lines < a->bins && (wanted_Hz > 0.0 ? (double)a->lines * df_Hz <= wanted_Hz * (1.0 + 1e-9)
                                                  : drive(a, a->lines) >= driven * most))
        a->lines++;
    a->said->to_Hz = (double)(a->lines - 1) * df_Hz;
}

static enum bf_status prepare(struct averaging *a, const struct average_options *options, struct bf_error *err)
{
    enum bf_status status = find_input(a, options->input, err);
    if (status != BF_OK)
        return status;
    find_outputs(a);
    if (a->said->n_outputs == 0)
        return bf_fail(err, BF_BAD_FILE, "%s: no column of a measured answer; names end in their units (accel_mps2)",
                       a->records[0].path);
    status = find_hits(a, err);
    if (status == BF_OK)
        status = fft_get(fft_good_size(a->length), &a->plan, err);
    if (status != BF_OK)
        return status;
    a->bins = fft_size(a->plan) / 2 + 1;
    find_window(a, options->window_s);
    a->U = bf_alloc(a->n * a->bins, sizeof *a->U);
    transform(a, a->said->input, a->U);
    find_lines(a, options->to_Hz);
    return BF_OK;
}

/* ---- Responses ---- */

static void add_part(struct record *out, const char *output, const char *input, const char *part, const double x[])
{
    char name[300];
    (void)snprintf(name, sizeof name, "%.120s/%.120s_%s", output, input, part);
    record_add_column(out, name, x);
}

/* H1 = Σ U* Z / Σ |U|², γ² = |Σ U* Z|²/(Σ |U|² Σ |Z|²) */
static void add_response(const struct averaging *a, size_t output, struct record *out)
{
    const char *name = a->said->outputs[output], *input = a->said->input;
    double complex *Z = bf_alloc(a->n * a->bins, sizeof *Z);
    double *re = bf_alloc(a->lines, sizeof *re), *im = bf_alloc(a->lines, sizeof *im),
           *coherence = bf_alloc(a->lines, sizeof *coherence);
    transform(a, name, Z);
    for (size_t b = 0; b < a->lines; b++) {
        const double uu = drive(a, b);
        double complex uz = 0.0;
        double zz = 0.0;
        for (size_t r = 0; r < a->n; r++) {
            const double complex z = Z[r * a->bins + b];
            uz += conj(a->U[r * a->bins + b]) * z;
            zz += creal(z * conj(z));
        }
        re[b] = uu > 0.0 ? creal(uz) / uu : 0.0, im[b] = uu > 0.0 ? cimag(uz) / uu : 0.0;
        coherence[b] = uu * zz > 0.0 ? fmin(creal(uz * conj(uz)) / (uu * zz), 1.0) : 0.0;
    }
    add_part(out, name, input, "re", re), add_part(out, name, input, "im", im);
    add_part(out, name, input, "coherence", coherence);
    repeats_judge(a->U, Z, a->n, a->bins, a->lines, &a->said->agree[output]);
    free(Z), free(re), free(im), free(coherence);
}

/* What the records have in common, and where they came from. */
static void add_story(const struct averaging *a, struct record *out)
{
    char text[64], key[32];
    (void)snprintf(text, sizeof text, "%zu", a->n);
    record_add_meta(out, RECORD_AVERAGES, text);
    (void)snprintf(text, sizeof text, "%.9g s", a->said->window_s);
    if (a->said->window_s > 0.0)
        record_add_meta(out, RECORD_WINDOW, text);
    for (size_t m = 0; m < a->records[0].n_meta; m++)
        if (is_place(&a->records[0].meta[m]))
            record_add_meta(out, a->records[0].meta[m].key, a->records[0].meta[m].value);
    for (size_t r = 0; r < a->n; r++) {
        (void)snprintf(key, sizeof key, r == 0 ? "source" : "source_%zu", r + 1);
        record_add_meta(out, key, record_base_name(&a->records[r]));
    }
}

enum bf_status record_average(const struct record records[], size_t n_records, const struct average_options *options,
                              struct record *out, struct average *average, struct bf_error *err)
{
    struct averaging a = {.records = records, .n = n_records, .said = average};
    *out = (struct record){0}, *average = (struct average){0};
    if (n_records < 2 || n_records > REPEATS_MOST)
        return bf_fail(err, BF_USAGE, "%zu records; an average is of 2 to %d", n_records, REPEATS_MOST);
    const enum bf_status status = prepare(&a, options, err);
    if (status == BF_OK) {
        *out = (struct record){
            .over_frequency = true, .n = a.lines, .dt_s = 1.0 / ((double)fft_size(a.plan) * records[0].dt_s)};
        for (size_t o = 0; o < average->n_outputs; o++)
            add_response(&a, o, out);
        add_story(&a, out);
    } else {
        average_free(average);
    }
    free(a.U);
    return status;
}

void average_free(struct average *average)
{
    free(average->outputs), free(average->agree), free(average->level);
    *average = (struct average){0};
}
