/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * reference_fit MODEL REC... — the plain fit: reference_model.h's prediction, a forward-difference Jacobian in
 * log-parameters, Levenberg–Marquardt, in windows that grow (a frequency that is 2 % off is a local minimum of a long
 * record). Residuals are weighed by
 * 0.4 % of each channel's rms, the noise that the records were made with; in the short windows by more, so that the priors of
 * MODEL hold the scale while the prediction is still wrong.
 */
#include "reference_model.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct problem {
    size_t n_records;
    struct reference_record record[FILES];
    double start[PARAMETERS], prior[PARAMETERS];
    double window_s, noise; /* of the residual's weights, relative to a channel's rms */
    size_t rows;
    int evaluations;
    struct reference_system system[2];
};

static void *array(size_t n)
{
    void *x = calloc(n, sizeof(double));
    if (x == NULL)
        exit(1);
    return x;
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* "NAME: {value: X, prior: Y}" on one line each. */
static void read_model(const char *path, struct problem *q)
{
    char line[512];
    FILE *file = fopen(path, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        for (int i = 0; i < PARAMETERS; i++) {
            const char *name = strstr(line, reference_names[i]), *value = strstr(line, "value:");
            const char *prior = strstr(line, "prior:");
            if (name == NULL || value == NULL)
                continue;
            q->start[i] = strtod(value + 6, NULL);
            q->prior[i] = prior ? strtod(prior + 6, NULL) : 0;
        }
    if (file != NULL)
        fclose(file);
    for (int i = 0; i < PARAMETERS; i++)
        if (!(q->start[i] > 0)) {
            fprintf(stderr, "reference_fit: %s has no %s\n", path, reference_names[i]);
            exit(1);
        }
}

static size_t window(const struct problem *q, const struct reference_record *record)
{
    size_t n = (size_t)(q->window_s / SAMPLE_S + 0.5);
    return n < record->n ? n : record->n;
}

static void set_window(struct problem *q, double window_s, double noise)
{
    q->window_s = window_s;
    q->noise = noise;
    q->rows = PARAMETERS;
    for (size_t r = 0; r < q->n_records; r++)
        for (int c = 0; c < CHANNELS; c++)
            if (q->record[r].kind[c] != CHANNEL_NONE)
                q->rows += window(q, &q->record[r]);
}

/* Residuals over their noise at log-parameters x, priors last; returns the sum of squares. */
static double residual(struct problem *q, const double x[PARAMETERS], double *r)
{
    double p[PARAMETERS];
    size_t row = 0;
    q->evaluations++;
    for (int i = 0; i < PARAMETERS; i++)
        p[i] = exp(x[i]);
    reference_prepare(p, q->system);
    for (size_t k = 0; k < q->n_records; k++) {
        const struct reference_record *record = &q->record[k];
        size_t n = window(q, record);
        double *y[CHANNELS] = {r + row, r + row + n};
        reference_simulate(&q->system[record->hammer], record, n, y);
        for (int c = 0; c < CHANNELS && record->kind[c] != CHANNEL_NONE; c++, row += n)
            for (size_t i = 0; i < n; i++)
                r[row + i] = (r[row + i] - record->z[c][i]) / (q->noise * record->rms[c]);
    }
    for (int i = 0; i < PARAMETERS; i++)
        r[row++] = q->prior[i] > 0 ? (x[i] - log(q->start[i])) / q->prior[i] : 0;
    return cblas_ddot((int)row, r, 1, r, 1);
}

/* Damped normal equations (JᵀJ + λ diag) step = −Jᵀr; false when they are singular. */
static int damped_step(const double JJ[PARAMETERS * PARAMETERS], const double g[PARAMETERS], double lambda,
                       double step[PARAMETERS])
{
    double A[PARAMETERS * PARAMETERS];
    memcpy(A, JJ, sizeof A);
    for (int i = 0; i < PARAMETERS; i++) {
        A[i * PARAMETERS + i] += lambda * (JJ[i * PARAMETERS + i] + 1e-12);
        step[i] = -g[i];
    }
    return LAPACKE_dposv(LAPACK_ROW_MAJOR, 'U', PARAMETERS, 1, A, PARAMETERS, step, 1) == 0;
}

static double minimise(struct problem *q, double x[PARAMETERS], double tolerance)
{
    enum { MOST_STEPS = 60 };
    double *r = array(q->rows), *trial = array(q->rows), *J = array(q->rows * PARAMETERS), lambda = 1e-2;
    int small = 0;
    double cost = residual(q, x, r);
    for (int iteration = 0; iteration < MOST_STEPS; iteration++) {
        for (int i = 0; i < PARAMETERS; i++) {
            const double h = 1e-6;
            double moved[PARAMETERS], *column = J + (size_t)i * q->rows;
            memcpy(moved, x, sizeof moved);
            moved[i] += h;
            residual(q, moved, column);
            cblas_daxpy((int)q->rows, -1, r, 1, column, 1);
            cblas_dscal((int)q->rows, 1 / h, column, 1);
        }
        double JJ[PARAMETERS * PARAMETERS], g[PARAMETERS], step[PARAMETERS], next[PARAMETERS], better = cost;
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, PARAMETERS, PARAMETERS, (int)q->rows, 1, J, (int)q->rows,
                    J, (int)q->rows, 0, JJ, PARAMETERS);
        cblas_dgemv(CblasRowMajor, CblasNoTrans, PARAMETERS, (int)q->rows, 1, J, (int)q->rows, r, 1, 0, g, 1);
        for (; lambda < 1e8; lambda *= 4) {
            if (!damped_step(JJ, g, lambda, step))
                continue;
            for (int i = 0; i < PARAMETERS; i++)
                next[i] = x[i] + fmax(-0.5, fmin(0.5, step[i]));
            better = residual(q, next, trial);
            if (better < cost)
                break;
        }
        if (!(better < cost))
            break;
        small = (cost - better) / cost < tolerance ? small + 1 : 0;
        memcpy(x, next, sizeof next);
        memcpy(r, trial, q->rows * sizeof *r);
        cost = better;
        lambda = fmax(lambda / 9, 1e-9);
        if (small == 3) /* one small gain may only mean a long damped step */
            break;
    }
    free(r);
    free(trial);
    free(J);
    return cost;
}

static void print_channels(struct problem *q, const double x[PARAMETERS], char **names)
{
    double *r = array(q->rows);
    size_t row = 0;
    residual(q, x, r);
    for (size_t k = 0; k < q->n_records; k++) {
        size_t n = window(q, &q->record[k]);
        for (int c = 0; c < CHANNELS && q->record[k].kind[c] != CHANNEL_NONE; c++, row += n)
            printf("%s channel %d nrmse %.5f\n", names[k], c,
                   q->noise * cblas_dnrm2((int)n, r + row, 1) / sqrt((double)n));
    }
    free(r);
}

int main(int argc, char **argv)
{
    static const double windows_s[] = {0.125, 0.25, 0.5, 1, 2, 1e9}, noises[] = {0.5, 0.2, 0.1, 0.03, 0.01, 0.004};
    enum { WINDOWS = sizeof windows_s / sizeof *windows_s };
    static struct problem q;
    double x[PARAMETERS], cost = 0;
    if (argc < 3 || argc > 2 + FILES) {
        fprintf(stderr, "usage: reference_fit MODEL REC... (at most %d)\n", FILES);
        return 2;
    }
    double begin = seconds();
    read_model(argv[1], &q);
    for (int i = 2; i < argc; i++)
        reference_read(argv[i], &q.record[q.n_records++]);
    for (int i = 0; i < PARAMETERS; i++)
        x[i] = log(q.start[i]);
    for (int w = 0; w < WINDOWS; w++) {
        set_window(&q, windows_s[w], noises[w]);
        cost = minimise(&q, x, w == WINDOWS - 1 ? 1e-7 : 1e-3);
        fprintf(stderr, "window %g s: residual %.4f of the noise after %d evaluations, %.2f s\n", windows_s[w],
                sqrt(cost / (double)q.rows), q.evaluations, seconds() - begin);
    }
    printf("seconds %.3f\nnoise_ratio %.4f\nevaluations %d\n", seconds() - begin, sqrt(cost / (double)q.rows),
           q.evaluations);
    print_channels(&q, x, argv + 2);
    for (int i = 0; i < PARAMETERS; i++)
        printf("%s %.6g\n", reference_names[i], exp(x[i]));
    return 0;
}
