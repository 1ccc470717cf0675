/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Small dense algebra of one step. */
#include "law_step.h"

#include <math.h>
#include <string.h>

/* A = I − T_w S_w − T_v S_v − T_a S_a */
static void step_matrix(const struct law_run *l, const struct stepper *s, double A[])
{
    size_t D = l->D;
    for (size_t i = 0; i < D; i++) {
        double *row = A + i * D;
        for (size_t j = 0; j < D; j++)
            row[j] = i == j ? 1.0 : 0.0;
        for (size_t b = 0; b < D; b++) {
            double w = s->T_w[i * D + b], v = s->T_v[i * D + b];
            for (size_t j = 0; j < D; j++)
                row[j] -= w * l->S_w[b * D + j] + v * l->S_v[b * D + j];
            for (size_t j = 0; l->uses_a && j < D; j++)
                row[j] -= s->T_a[i * D + b] * l->S_a[b * D + j];
        }
    }
}

static void swap_rows(size_t D, double A[], size_t i, size_t j)
{
    double keep[MOST_COORDINATES];
    memcpy(keep, A + i * D, D * sizeof *A);
    memcpy(A + i * D, A + j * D, D * sizeof *A);
    memcpy(A + j * D, keep, D * sizeof *A);
}

/* Gauss and Jordan with row pivots; A is overwritten. */
static bool invert(size_t D, double A[], double inverse[])
{
    for (size_t i = 0; i < D * D; i++)
        inverse[i] = i % (D + 1) == 0 ? 1.0 : 0.0;
    for (size_t k = 0; k < D; k++) {
        size_t pivot = k;
        for (size_t i = k + 1; i < D; i++)
            if (fabs(A[i * D + k]) > fabs(A[pivot * D + k]))
                pivot = i;
        if (!(fabs(A[pivot * D + k]) > 0.0))
            return false;
        if (pivot != k) {
            swap_rows(D, A, pivot, k);
            swap_rows(D, inverse, pivot, k);
        }
        double scale = 1.0 / A[k * D + k];
        for (size_t j = 0; j < D; j++) {
            A[k * D + j] *= scale;
            inverse[k * D + j] *= scale;
        }
        for (size_t i = 0; i < D; i++) {
            double factor = A[i * D + k];
            for (size_t j = 0; i != k && j < D; j++) {
                A[i * D + j] -= factor * A[k * D + j];
                inverse[i * D + j] -= factor * inverse[k * D + j];
            }
        }
    }
    return true;
}

enum bf_status step_inverse(const struct law_run *l, const struct stepper *s, double inverse[], struct bf_error *err)
{
    double A[MOST_COORDINATES * MOST_COORDINATES];
    step_matrix(l, s, A);
    if (!invert(l->D, A, inverse))
        return bf_fail(err, BF_NUMERIC, "the equations of a nonlinear step are singular");
    return BF_OK;
}
