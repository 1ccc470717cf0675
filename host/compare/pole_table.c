/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Measured frequencies beside those of a model: which belongs to which, and what their ratios say. */
#include "measured_poles.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* One factor on all: they differ from it by less than this; and it is no accident of a few per mille. */
static const double one_scale = 0.012, worth_saying = 0.01;
enum { FEWEST = 3 };

static double square(double x)
{
    return x * x;
}

static void sum_up(const struct frequency_list *measured, const double measured_Hz[], const double model_Hz[],
                   const size_t mode[], struct pole_table *out)
{
    double sum = 0.0;
    out->factor = alignment_factor(measured_Hz, out->n, model_Hz, mode);
    for (size_t i = 0; i < out->n; i++) {
        struct pole_pair *pair = &out->pairs[i];
        *pair = (struct pole_pair){.measured = measured->modes[i],
                                   .mode = 0,
                                   .model_Hz = nan(""),
                                   .ratio = nan(""),
                                   .model_damping = nan(""),
                                   .mac = nan("")};
        if (mode[i] == SIZE_MAX)
            continue;
        pair->mode = mode[i] + 1;
        pair->model_Hz = model_Hz[mode[i]];
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

/* What the list says itself goes before what the frequencies say. */
static void pair_up(const struct frequency_list *measured, const double measured_Hz[], const double model_Hz[],
                    size_t n_model, size_t mode[])
{
    alignment_find(measured_Hz, measured->n, model_Hz, n_model, mode);
    for (size_t i = 0; i < measured->n; i++)
        if (measured->modes[i].mode > 0)
            mode[i] = measured->modes[i].mode <= n_model ? measured->modes[i].mode - 1 : SIZE_MAX;
}

void pole_table_make(const struct frequency_list *measured, const double model_Hz[], size_t n_model,
                     struct pole_table *out)
{
    const size_t n = measured->n;
    size_t *mode = bf_alloc(n + 1, sizeof *mode);
    double *measured_Hz = bf_alloc(n + 1, sizeof *measured_Hz);
    *out = (struct pole_table){.n = n, .pairs = bf_alloc(n, sizeof *out->pairs)};
    for (size_t i = 0; i < n; i++)
        measured_Hz[i] = measured->modes[i].frequency_Hz;
    pair_up(measured, measured_Hz, model_Hz, n_model, mode);
    sum_up(measured, measured_Hz, model_Hz, mode, out);
    conclude(out);
    free(mode), free(measured_Hz);
}

double pole_table_shape_at(const struct modes *modes, size_t k, double x_m)
{
    const double *x = modes->x_m, *y = modes->shape + k * modes->n_points;
    size_t i = 1;
    while (i + 1 < modes->n_points && x[i] < x_m)
        i++;
    return y[i - 1] + (y[i] - y[i - 1]) * (x_m - x[i - 1]) / (x[i] - x[i - 1]);
}

void pole_table_shapes(struct pole_table *table, const struct frequency_list *measured, const struct modes *modes)
{
    for (size_t i = 0; i < table->n; i++) {
        struct pole_pair *pair = &table->pairs[i];
        double both = 0.0, ours = 0.0, theirs = 0.0;
        size_t places = 0;
        for (size_t p = 0; p < measured->n_places && pair->mode > 0; p++) {
            const double z = measured->shape[i * measured->n_places + p];
            if (!isfinite(z))
                continue;
            const double y = pole_table_shape_at(modes, pair->mode - 1, measured->place_m[p]);
            both += z * y, ours += y * y, theirs += z * z;
            places++;
        }
        pair->mac = places >= 2 && ours * theirs > 0.0 ? both * both / (ours * theirs) : nan("");
    }
}

void pole_table_damping(struct pole_table *table, const struct modes *modes)
{
    for (size_t i = 0; i < table->n; i++) {
        struct pole_pair *pair = &table->pairs[i];
        pair->model_damping =
            pair->mode > 0 && pair->mode <= modes->n ? modes->mode[pair->mode - 1].damping_ratio : nan("");
    }
}

void pole_table_free(struct pole_table *table)
{
    free(table->pairs);
    *table = (struct pole_table){0};
}
