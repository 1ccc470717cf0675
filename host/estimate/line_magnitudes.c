/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Spectra without phase as rows of a fit: (√(|Ĥ|² + σ²) − |H|)/σ a line, σ of the magnitude. The root is the mean of a magnitude with noise (Rice; exact to 3 % of σ where
 * |Ĥ| > 2σ). σ is what coherence and averages say; else the median of third differences of |H| over some lines, to which a resonance adds little.
 */
#include <complex.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "line_set.h"

enum { NEIGHBOURS = 32, LEAST_LINES = 16 };
static const double least_share = 1e-4;            /* of the rms: no line is taken to be better known */
static const double median_of_normal = 0.67448975; /* of |x|, standard deviation 1 */

/* ---- The record for the predictor ---- */

/* "accel_mps2/hammer_N" -> both names, which the caller frees; false: a column of standard errors. */
static bool names_of(const struct record_column *column, char **output, char **input)
{
    const char *slash = strchr(column->name, '/');
    const size_t n = strlen(column->name), end = sizeof RECORD_SD - 1;
    if (slash == NULL || (n > end && strcmp(column->name + n - end, RECORD_SD) == 0))
        return false;
    *output = strndup(column->name, (size_t)(slash - column->name));
    *input = bf_strdup(slash + 1);
    return true;
}

/* Unit responses at the same lines become the pulse that the model answers. */
enum bf_status magnitudes_make(struct line_set *set, const struct model *model, struct bf_error *err)
{
    const struct record *from = set->record;
    struct record lines = {.n = from->n, .t0_s = from->t0_s, .dt_s = from->dt_s, .path = from->path};
    double *one = bf_alloc(from->n, sizeof *one), *zero = bf_alloc(from->n, sizeof *zero);
    bool any = false;
    for (size_t k = 0; k < from->n; k++)
        one[k] = 1.0;
    for (size_t c = 0; c < from->n_columns; c++) {
        char *output, *input, name[300];
        if (!names_of(&from->columns[c], &output, &input))
            continue;
        (void)snprintf(name, sizeof name, "%.130s/%.130s_re", output, input);
        record_add_column(&lines, name, one);
        (void)snprintf(name, sizeof name, "%.130s/%.130s_im", output, input);
        record_add_column(&lines, name, zero);
        for (size_t o = 0; o < model->n_outputs; o++)
            any = any || strcmp(model->outputs[o].name, output) == 0;
        free(output), free(input);
    }
    for (size_t i = 0; i < from->n_meta; i++)
        record_add_meta(&lines, from->meta[i].key, from->meta[i].value);
    enum bf_status status = record_from_response(&lines, &set->made, err);
    lines.path = NULL;
    record_free(&lines);
    free(one), free(zero);
    if (status == BF_OK && !any)
        status = bf_fail_at(err, from->path, 1, "none of its responses is of an output of the model");
    return status;
}

/* ---- Rows ---- */

/* Third differences of noise have 20 times its variance. */
static double noise_near(const double h[], size_t n, size_t k)
{
    double d[2 * NEIGHBOURS + 1];
    const size_t from = k > NEIGHBOURS ? k - NEIGHBOURS : 0;
    size_t count = 0;
    for (size_t i = from; i + 3 < n && count < 2 * NEIGHBOURS + 1; i++)
        d[count++] = fabs(h[i] - 3.0 * h[i + 1] + 3.0 * h[i + 2] - h[i + 3]);
    if (count < LEAST_LINES && n >= LEAST_LINES + 3)
        return noise_near(h, n, n - LEAST_LINES - 3 > NEIGHBOURS ? n - LEAST_LINES - 3 : 0);
    return count > 0 ? median(count, d) / median_of_normal / sqrt(20.0) : 0.0;
}

static void add_response(struct line_rows *lines, struct line_set *set, const struct record_column *column,
                         const char *output)
{
    const struct record *record = set->record;
    const size_t n = record->n;
    char name[300];
    (void)snprintf(name, sizeof name, "%.250s" RECORD_SD, column->name);
    const double *sd = record_column(record, name);
    struct line_group *group = line_group_add(lines, set, LINE_MAGNITUDE, output);
    const double least = least_share * root_mean_square(column->x, n);
    for (size_t k = 0; k < n; k++) {
        const bool known = sd != NULL && sd[k] > 0.0;
        group->stated = group->stated && known;
        line_row_add(lines, column->x[k], fmax(known ? sd[k] : noise_near(column->x, n, k), least));
    }
}

void magnitudes_add(struct line_rows *lines, struct line_set *set, const struct model *model)
{
    set->first_group = lines->n_groups;
    for (size_t c = 0; c < set->record->n_columns; c++) {
        char *output, *input;
        if (!names_of(&set->record->columns[c], &output, &input))
            continue;
        for (size_t o = 0; o < model->n_outputs; o++)
            if (strcmp(model->outputs[o].name, output) == 0)
                add_response(lines, set, &set->record->columns[c], output);
        free(output), free(input);
    }
    set->n_groups = lines->n_groups - set->first_group;
}

/* The line at 0 Hz, which nothing drives, is left out. */
void magnitudes_pair(struct line_rows *lines, const struct line_set *set)
{
    for (size_t g = set->first_group; g < set->first_group + set->n_groups; g++)
        for (size_t k = 0; k < lines->groups[g].n; k++)
            lines->used[lines->groups[g].row + k] =
                set->record->t0_s + (double)k * set->record->dt_s > 0.5 * set->record->dt_s;
}

/* ---- Residuals and derivatives ---- */

struct spectra {
    const struct fft *plan;
    double complex *U, *Y, *dY; /* [n/2 + 1] */
    size_t first;               /* line of the first row */
};

static void fill_group(struct line_rows *lines, const struct line_set *set, const struct line_group *group,
                       const struct prediction *y, size_t row, const struct spectra *s, const bool want[])
{
    fft_forward(s->plan, y->y + row, s->Y);
    for (size_t k = 0; k < group->n; k++) {
        const size_t at = group->row + k;
        const double size = cabs(s->Y[s->first + k] / s->U[s->first + k]);
        lines->residual[at] =
            lines->used[at] ? (hypot(size, lines->scale[at]) - lines->measured[at]) / lines->scale[at] : 0.0;
    }
    for (size_t j = 0; j < set->n_refs && want != NULL; j++) {
        double *column = lines->jacobian + set->from[j] * lines->n_rows;
        if (!want[j])
            continue;
        fft_forward(s->plan, y->jacobian + j * y->n_rows + row, s->dY);
        for (size_t k = 0; k < group->n; k++) {
            const size_t at = group->row + k, line = s->first + k;
            const double complex H = s->Y[line] / s->U[line], dH = s->dY[line] / s->U[line];
            if (lines->used[at])
                column[at] = creal(conj(H) * dH) / hypot(cabs(H), lines->scale[at]) / lines->scale[at];
        }
    }
}

/* The predictor's channels are the groups, but in the order of the model's outputs. */
enum bf_status magnitudes_fill(struct line_rows *lines, const struct line_set *set, const struct prediction *y,
                               const bool want[], struct bf_error *err)
{
    const struct predict_channel *channels;
    const size_t n_channels = predictor_channels(set->predictor, &channels), m = set->made.n / 2 + 1;
    const struct model *model = transfer_model(set->predictor);
    const double *input = set->made.columns[0].x;
    struct spectra s = {.first = (size_t)llround(set->record->t0_s / set->record->dt_s)};
    const enum bf_status status = fft_get(set->made.n, &s.plan, err);
    if (status != BF_OK)
        return status;
    s.U = bf_alloc(3 * m, sizeof *s.U);
    s.Y = s.U + m, s.dY = s.Y + m;
    fft_forward(s.plan, input, s.U);
    s.U[0] = s.U[0] == 0.0 ? 1.0 : s.U[0];
    for (size_t g = set->first_group; g < set->first_group + set->n_groups; g++)
        for (size_t c = 0; c < n_channels; c++)
            if (strcmp(model->outputs[channels[c].output].name, lines->groups[g].name) == 0)
                fill_group(lines, set, &lines->groups[g], y, channels[c].row, &s, want);
    free(s.U);
    return BF_OK;
}
