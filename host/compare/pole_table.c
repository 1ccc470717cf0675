/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Measured frequencies beside those of a model. Which belongs to which is an alignment of two ascending lists (dynamic programming): a pair costs the
 * square of its logarithmic distance once a common factor is taken off, a measured one that nothing fits a fixed amount, a mode that was not measured less.
 */
#include "compare.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A measured frequency that is farther than this from every mode, as a share of it, is none of them. */
static const double far_off = 0.1;
/* A mode that nobody measured, beside others that were, counts as this share. */
static const double unseen = 0.04;
/* One factor on all: they differ from it by less than this; and it is no accident of a few per mille. */
static const double one_scale = 0.012, worth_saying = 0.01;
enum { ROUNDS = 8, FEWEST = 3 };

static double square(double x)
{
    return x * x;
}

struct alignment {
    const struct frequency_list *measured;
    const double *model_Hz;
    size_t n_model;
    double *cost;       /* [measured + 1][model + 1] of the first ones of each */
    unsigned char *way; /* likewise: 0 pair, 1 measured left out, 2 mode left out */
};

static void better(double value, unsigned char way, double *cost, unsigned char *taken)
{
    if (value < *cost) {
        *cost = value;
        *taken = way;
    }
}

/* mode[i]: index of the mode of measured frequency i, SIZE_MAX: none; returns the cost. */
static double align(struct alignment *a, double factor, size_t mode[])
{
    const size_t n = a->measured->n, m = a->n_model, width = m + 1;
    for (size_t i = 0; i <= n; i++)
        for (size_t j = 0; j <= m; j++) {
            double *cost = &a->cost[i * width + j];
            unsigned char *way = &a->way[i * width + j];
            *cost = i == 0 && j == 0 ? 0.0 : HUGE_VAL;
            if (i > 0 && j > 0)
                better(a->cost[(i - 1) * width + j - 1] +
                           square(log(a->measured->modes[i - 1].frequency_Hz / (factor * a->model_Hz[j - 1]))),
                       0, cost, way);
            if (i > 0)
                better(a->cost[(i - 1) * width + j] + square(far_off), 1, cost, way);
            if (j > 0)
                better(a->cost[i * width + j - 1] + (i == n ? 0.0 : square(unseen)), 2, cost, way);
        }
    for (size_t i = n, j = m; i > 0;) {
        const unsigned char way = a->way[i * width + j];
        if (way != 2)
            mode[--i] = way == 0 ? j - 1 : SIZE_MAX;
        j -= way != 1;
    }
    return a->cost[n * width + m];
}

/* Geometric mean of measured/model over the pairs; 1 where there is none. */
static double mean_factor(const struct alignment *a, const size_t mode[])
{
    double sum = 0.0, n = 0.0;
    for (size_t i = 0; i < a->measured->n; i++)
        if (mode[i] != SIZE_MAX) {
            sum += log(a->measured->modes[i].frequency_Hz / a->model_Hz[mode[i]]);
            n += 1.0;
        }
    return n > 0.0 ? exp(sum / n) : 1.0;
}

/* From a first factor on: aligned, the factor taken anew, until it stays. */
static double settle(struct alignment *a, double factor, size_t mode[])
{
    double cost = HUGE_VAL;
    for (int round = 0; round < ROUNDS; round++) {
        cost = align(a, factor, mode);
        const double next = mean_factor(a, mode);
        if (fabs(log(next / factor)) < 1e-9)
            break;
        factor = next;
    }
    return cost;
}

static void sum_up(const struct alignment *a, const size_t mode[], struct pole_table *out)
{
    double sum = 0.0;
    out->factor = mean_factor(a, mode);
    for (size_t i = 0; i < out->n; i++) {
        struct pole_pair *pair = &out->pairs[i];
        *pair = (struct pole_pair){.measured = a->measured->modes[i], .mode = 0, .model_Hz = nan(""), .ratio = nan("")};
        if (mode[i] == SIZE_MAX)
            continue;
        pair->mode = mode[i] + 1;
        pair->model_Hz = a->model_Hz[mode[i]];
        pair->ratio = pair->measured.frequency_Hz / pair->model_Hz;
        sum += square(log(pair->ratio / out->factor));
        out->n_pairs++;
    }
    out->spread = out->n_pairs > 1 ? sqrt(sum / (double)(out->n_pairs - 1)) : 0.0;
}

static void conclude(struct pole_table *out)
{
    char *text = out->text;
    const size_t size = sizeof out->text;
    size_t used = 0;
    if (out->n_pairs >= FEWEST && out->spread < one_scale && fabs(log(out->factor)) > worth_saying)
        used =
            (size_t)snprintf(text, size,
                             "All are off by one factor, %.4g, to %.2g %%: a scale, and not a spring, a mass or a soft "
                             "clamp, which take more from some modes than from others. Frequencies know "
                             "√(EI/ρ)/length² alone: EI times %.3g, or a free length times %.4g, does it. Measure "
                             "thickness and free length again.",
                             out->factor, 100.0 * out->spread, square(out->factor), 1.0 / sqrt(out->factor));
    else if (out->n_pairs >= FEWEST)
        used = (size_t)snprintf(text, size, "Measured over model is %.4g on average, with a spread of %.2g %%.",
                                out->factor, 100.0 * out->spread);
    for (size_t i = 0; i < out->n && used < size; i++)
        if (out->pairs[i].mode == 0)
            used +=
                (size_t)snprintf(text + used, size - used,
                                 "%s%.6g Hz is no bending mode of this model: torsion, sideways motion, the stand, or "
                                 "something attached.",
                                 used > 0 ? " " : "", out->pairs[i].measured.frequency_Hz);
}

void pole_table_make(const struct frequency_list *measured, const double model_Hz[], size_t n_model,
                     struct pole_table *out)
{
    const size_t n = measured->n, cells = (n + 1) * (n_model + 1);
    struct alignment a = {.measured = measured, .model_Hz = model_Hz, .n_model = n_model};
    size_t *mode = bf_alloc(2 * n + 1, sizeof *mode), *trial = mode + n;
    double lowest = HUGE_VAL;
    a.cost = bf_alloc(cells, sizeof *a.cost);
    a.way = bf_alloc(cells, sizeof *a.way);
    *out = (struct pole_table){.n = n, .pairs = bf_alloc(n, sizeof *out->pairs)};
    for (size_t start = 0; start <= n && n_model > 0; start++) { /* as they are, and with one of the first modes met */
        const double factor = start == 0 ? 1.0 : measured->modes[start - 1].frequency_Hz / model_Hz[0];
        if (start > 2 || fabs(log(factor)) > 1.5)
            continue;
        const double cost = settle(&a, factor, trial);
        if (cost < lowest) {
            lowest = cost;
            memcpy(mode, trial, n * sizeof *mode);
        }
    }
    for (size_t i = 0; i < n && n_model == 0; i++)
        mode[i] = SIZE_MAX;
    sum_up(&a, mode, out);
    conclude(out);
    free(mode), free(a.cost), free(a.way);
}

void pole_table_free(struct pole_table *table)
{
    free(table->pairs);
    *table = (struct pole_table){0};
}
