/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Two ascending lists, one measured and one of a model, with an unknown factor between them. Which belongs to which is found by dynamic programming: a pair
 * costs the square of its logarithmic distance once the factor is taken off, a measured value that nothing fits a fixed amount, one that was not measured less.
 */
#include "maths.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* A measured value that is farther than this from every other, as a share of it, belongs to none. */
static const double far_off = 0.1;
/* One that nobody measured, beside others that were, counts as this share. */
static const double unseen = 0.04;
enum { ROUNDS = 8 };

static double square(double x)
{
    return x * x;
}

struct alignment {
    const double *measured, *model;
    size_t n, n_model;
    double *cost;       /* [n + 1][n_model + 1] of the first ones of each */
    unsigned char *way; /* likewise: 0 pair, 1 measured left out, 2 model's left out */
};

static void better(double value, unsigned char way, double *cost, unsigned char *taken)
{
    if (value < *cost) {
        *cost = value;
        *taken = way;
    }
}

/* pair[i]: of measured value i, SIZE_MAX: none; returns the cost. */
static double align(struct alignment *a, double factor, size_t pair[])
{
    const size_t n = a->n, m = a->n_model, width = m + 1;
    for (size_t i = 0; i <= n; i++)
        for (size_t j = 0; j <= m; j++) {
            double *cost = &a->cost[i * width + j];
            unsigned char *way = &a->way[i * width + j];
            *cost = i == 0 && j == 0 ? 0.0 : HUGE_VAL;
            if (i > 0 && j > 0)
                better(a->cost[(i - 1) * width + j - 1] + square(log(a->measured[i - 1] / (factor * a->model[j - 1]))),
                       0, cost, way);
            if (i > 0)
                better(a->cost[(i - 1) * width + j] + square(far_off), 1, cost, way);
            if (j > 0)
                better(a->cost[i * width + j - 1] + (i == n ? 0.0 : square(unseen)), 2, cost, way);
        }
    for (size_t i = n, j = m; i > 0;) {
        const unsigned char way = a->way[i * width + j];
        if (way != 2)
            pair[--i] = way == 0 ? j - 1 : SIZE_MAX;
        j -= way != 1;
    }
    return a->cost[n * width + m];
}

double alignment_factor(const double measured[], size_t n, const double model[], const size_t pair[])
{
    double sum = 0.0, count = 0.0;
    for (size_t i = 0; i < n; i++)
        if (pair[i] != SIZE_MAX) {
            sum += log(measured[i] / model[pair[i]]);
            count += 1.0;
        }
    return count > 0.0 ? exp(sum / count) : 1.0;
}

/* From a first factor on: aligned, the factor taken anew, until it stays. */
static double settle(struct alignment *a, double factor, size_t pair[])
{
    double cost = HUGE_VAL;
    for (int round = 0; round < ROUNDS; round++) {
        cost = align(a, factor, pair);
        const double next = alignment_factor(a->measured, a->n, a->model, pair);
        if (fabs(log(next / factor)) < 1e-9)
            break;
        factor = next;
    }
    return cost;
}

void alignment_find(const double measured[], size_t n, const double model[], size_t n_model, size_t pair[])
{
    const size_t cells = (n + 1) * (n_model + 1);
    struct alignment a = {.measured = measured, .model = model, .n = n, .n_model = n_model};
    size_t *trial = bf_alloc(n + 1, sizeof *trial);
    double lowest = HUGE_VAL;
    a.cost = bf_alloc(cells, sizeof *a.cost);
    a.way = bf_alloc(cells, sizeof *a.way);
    for (size_t i = 0; i < n; i++)
        pair[i] = SIZE_MAX;
    for (size_t start = 0; start <= n && n_model > 0; start++) { /* as they are, and with one of the first ones met */
        const double factor = start == 0 ? 1.0 : measured[start - 1] / model[0];
        if (start > 2 || fabs(log(factor)) > 1.5)
            continue;
        const double cost = settle(&a, factor, trial);
        if (cost < lowest) {
            lowest = cost;
            memcpy(pair, trial, n * sizeof *pair);
        }
    }
    free(trial), free(a.cost), free(a.way);
}
