/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "ground/ground.h"
#include "record.h"

const double *record_column(const struct record *record, const char *name)
{
    for (size_t i = 0; i < record->n_columns; i++)
        if (strcmp(record->columns[i].name, name) == 0)
            return record->columns[i].x;
    return NULL;
}

const struct column_noise *record_column_noise(const struct record *record, const char *name)
{
    for (size_t i = 0; i < record->n_columns; i++)
        if (strcmp(record->columns[i].name, name) == 0)
            return record->columns[i].noise;
    return NULL;
}

const char *record_meta(const struct record *record, const char *key)
{
    for (size_t i = 0; i < record->n_meta; i++)
        if (strcmp(record->meta[i].key, key) == 0)
            return record->meta[i].value;
    return NULL;
}

bool record_is_free_decay(const struct record *record)
{
    const char *excitation = record_meta(record, "excitation");
    return excitation != NULL && strcmp(excitation, "free_decay") == 0;
}

size_t record_free_from(const struct record *record)
{
    static const double rounding = 1e-6; /* of a sample */
    double from_s;
    if (!record_is_free_decay(record) || !record_meta_number(record, "free_from_s", &from_s))
        return 0;
    const double samples = ceil((from_s - record->t0_s) / record->dt_s - rounding);
    return samples > 0.0 && samples < (double)record->n ? (size_t)samples : 0;
}

void record_set_free_from(struct record *record, size_t sample)
{
    char text[40];
    (void)snprintf(text, sizeof text, "%.15g", record->t0_s + (double)sample * record->dt_s);
    record_add_meta(record, "free_from_s", text);
}

bool record_state_is_free(const struct record *record)
{
    const char *state = record_meta(record, "initial_state");
    return record_is_free_decay(record) || (state != NULL && strcmp(state, "free") == 0 && !record_is_periodic(record));
}

void record_add_column(struct record *record, const char *name, const double *x)
{
    record->columns = bf_grow(record->columns, record->n_columns + 1, sizeof *record->columns);
    struct record_column *column = &record->columns[record->n_columns++];
    *column = (struct record_column){.name = bf_strdup(name)};
    column->x = bf_alloc(record->n, sizeof *column->x);
    if (record->n > 0 && x != NULL)
        memcpy(column->x, x, record->n * sizeof *column->x);
}

void record_add_meta(struct record *record, const char *key, const char *value)
{
    record->meta = bf_grow(record->meta, record->n_meta + 1, sizeof *record->meta);
    record->meta[record->n_meta].key = bf_strdup(key);
    record->meta[record->n_meta++].value = bf_strdup(value);
}

bool record_assume_filter(struct record *record)
{
    static const struct {
        int order;
        double corner;                      /* of the sample rate */
    } usual = {.order = 6, .corner = 0.39}; /* 2.56 samples in a period of the corner: the usual ratio of analysers */
    const char *excitation = record_meta(record, "excitation");
    char text[80];
    if (record->kind != RECORD_SAMPLES || record_meta(record, RECORD_FILTER) != NULL ||
        (excitation != NULL && strcmp(excitation, RECORD_RESPONSE) == 0))
        return false;
    (void)snprintf(text, sizeof text, "Butterworth order %d at %.6g Hz, forward and backward (assumed)", usual.order,
                   usual.corner / record->dt_s);
    record_add_meta(record, RECORD_FILTER, text);
    return true;
}

bool record_filter_is_assumed(const struct record *record)
{
    const char *text = record_meta(record, RECORD_FILTER);
    return text != NULL && strstr(text, "(assumed)") != NULL;
}

bool record_is_periodic(const struct record *record)
{
    const char *excitation = record_meta(record, "excitation");
    return excitation != NULL && (strcmp(excitation, RECORD_RESPONSE) == 0 || strcmp(excitation, "periodic") == 0);
}

bool record_meta_number(const struct record *record, const char *key, double *number)
{
    const char *text = record_meta(record, key);
    return text != NULL && number_scan(text, text + strlen(text), '.', number) != NULL && isfinite(*number);
}

double record_window_rate(const struct record *record)
{
    double time_s;
    return record_meta_number(record, RECORD_WINDOW, &time_s) && time_s > 0.0 ? 1.0 / time_s : 0.0;
}

const char *record_base_name(const struct record *record)
{
    return text_base_name(record->path);
}

const char **record_base_names(const struct record records[], size_t n)
{
    const char **names = bf_alloc(n, sizeof *names);
    for (size_t r = 0; r < n; r++)
        names[r] = record_base_name(&records[r]);
    return names;
}

static void column_noise_free(struct column_noise *noise)
{
    if (noise == NULL)
        return;
    free(noise->kept), free(noise->share);
    free(noise);
}

void record_free(struct record *record)
{
    for (size_t i = 0; i < record->n_columns; i++) {
        free(record->columns[i].name);
        free(record->columns[i].x);
        free(record->columns[i].noise_psd);
        column_noise_free(record->columns[i].noise);
    }
    for (size_t i = 0; i < record->n_meta; i++) {
        free(record->meta[i].key);
        free(record->meta[i].value);
    }
    free(record->columns);
    free(record->meta);
    free(record->path);
    memset(record, 0, sizeof *record);
}
