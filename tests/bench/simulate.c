/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * simulate MODEL REC... — seconds of one prediction of all records: by host/response/ (with and without derivatives by
 * every parameter) and by the plain dense loop of reference_model.h. Median of several runs.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "maths/maths.h"
#include "model/model.h"
#include "response/response.h"
#include "record/record.h"
#include "reference_model.h"

enum { RUNS = 9 };

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void must(enum bf_status status, const struct bf_error *err)
{
    if (status == BF_OK)
        return;
    fprintf(stderr, "simulate: %s\n", err->text);
    exit(1);
}

static double ours(struct predictor *predictor, const double parameters[], const bool want[])
{
    double t[RUNS];
    struct prediction prediction;
    struct bf_error err;
    for (int i = 0; i < RUNS; i++) {
        double begin = seconds();
        must(predictor_run(predictor, parameters, want, &prediction, &err), &err);
        t[i] = seconds() - begin;
    }
    return median(RUNS, t);
}

static double plain(const double p[PARAMETERS], int n_records, char **paths)
{
    static struct reference_system system[2];
    static struct reference_record record[FILES];
    double t[RUNS];
    for (int k = 0; k < n_records; k++)
        reference_read(paths[k], &record[k]);
    double *y[CHANNELS];
    for (int c = 0; c < CHANNELS; c++)
        y[c] = calloc(record[0].n, sizeof(double));
    for (int i = 0; i < RUNS; i++) {
        double begin = seconds();
        reference_prepare(p, system);
        for (int k = 0; k < n_records; k++)
            reference_simulate(&system[record[k].hammer], &record[k], record[k].n, y);
        t[i] = seconds() - begin;
    }
    for (int c = 0; c < CHANNELS; c++)
        free(y[c]);
    return median(RUNS, t);
}

int main(int argc, char **argv)
{
    struct model model;
    struct record record[FILES];
    struct bf_error err;
    struct predictor *predictor;
    int n_records = argc - 2;
    if (n_records < 1 || n_records > FILES) {
        fprintf(stderr, "usage: simulate MODEL REC... (at most %d)\n", FILES);
        return 2;
    }
    must(model_read(argv[1], &model, &err), &err);
    const char *names[FILES];
    for (int k = 0; k < n_records; k++) {
        must(record_read(argv[2 + k], &record[k], &err), &err);
        names[k] = argv[2 + k];
    }
    must(predictor_new(&model, record, (size_t)n_records, &(struct predict_options){0}, &predictor, &err), &err);

    struct parameter_ref *refs;
    size_t n = model_parameters(&model, names, (size_t)n_records, &refs);
    double *value = calloc(n, sizeof *value), p[PARAMETERS] = {0};
    bool *want = calloc(n, sizeof *want);
    for (size_t i = 0; i < n; i++) {
        value[i] = refs[i].value;
        want[i] = true;
        for (int j = 0; j < PARAMETERS; j++)
            if (strcmp(refs[i].label, reference_names[j]) == 0)
                p[j] = value[i];
    }
    printf("ours %.6f\nours_with_derivatives %.6f\nplain %.6f\n", ours(predictor, value, NULL),
           ours(predictor, value, want), plain(p, n_records, argv + 2));
    free(value);
    free(want);
    free(refs);
    predictor_free(predictor);
    for (int k = 0; k < n_records; k++)
        record_free(&record[k]);
    model_free(&model);
    return 0;
}
