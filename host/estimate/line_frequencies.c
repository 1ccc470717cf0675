/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A list of measured frequencies and damping ratios as rows of a fit. */
#include <complex.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "line_set.h"

/* What stands for a standard error that nobody stated: of a peak read from a spectrum, and of a half-power width. */
static const double usual_frequency = 0.005, usual_damping = 0.2;
static const double least_damping = 1e-12; /* whose logarithm is taken */
enum { SILENT = 64 };                      /* samples of the record of silence */

/* Silence, over a band that reaches above what was measured. */
enum bf_status frequencies_make(struct line_set *set, const struct model *model, struct bf_error *err)
{
    static const double above = 1.3;
    const double nothing[SILENT] = {0.0};
    frequency_list_of_record(set->record, &set->list);
    set->mode = bf_alloc(set->list.n, sizeof *set->mode);
    if (model->n_inputs == 0 || model->n_outputs == 0)
        return bf_fail(err, BF_USAGE, "%s: the model has no %s; name one, frequencies do not depend on it",
                       set->record->path, model->n_inputs == 0 ? "input" : "output");
    set->made = (struct record){.n = SILENT,
                                .dt_s = 0.5 / (above * set->list.modes[set->list.n - 1].frequency_Hz),
                                .path = bf_strdup(set->record->path)};
    record_add_column(&set->made, model->inputs[0].name, nothing);
    record_add_column(&set->made, model->outputs[0].name, nothing);
    record_add_meta(&set->made, "excitation", RECORD_RESPONSE);
    return BF_OK;
}

/* Rows of all frequencies; then of the damping ratios that are known. */
void frequencies_add(struct line_rows *lines, struct line_set *set)
{
    set->first_group = lines->n_groups;
    struct line_group *group = line_group_add(lines, set, LINE_FREQUENCY, "frequency");
    for (size_t i = 0; i < set->list.n; i++) {
        const struct measured_frequency *m = &set->list.modes[i];
        group->stated = group->stated && m->sd_Hz > 0.0;
        line_row_add(lines, log(m->frequency_Hz), m->sd_Hz > 0.0 ? m->sd_Hz / m->frequency_Hz : usual_frequency);
    }
    group = NULL;
    for (size_t i = 0; i < set->list.n; i++) {
        const struct measured_frequency *m = &set->list.modes[i];
        if (!(m->damping_ratio > 0.0))
            continue;
        if (group == NULL)
            group = line_group_add(lines, set, LINE_DAMPING, "damping_ratio");
        group->stated = group->stated && m->damping_sd > 0.0;
        line_row_add(lines, log(m->damping_ratio),
                     m->damping_sd > 0.0 ? m->damping_sd / m->damping_ratio : usual_damping);
    }
}

/* ---- Poles ---- */

static void use_rows(struct line_rows *lines, const struct line_set *set)
{
    size_t frequency = lines->groups[set->first_group].row, damping = frequency + set->list.n;
    for (size_t i = 0; i < set->list.n; i++) {
        lines->used[frequency++] = set->mode[i] != SIZE_MAX;
        if (set->list.modes[i].damping_ratio > 0.0)
            lines->used[damping++] = set->mode[i] != SIZE_MAX;
    }
}

void frequencies_pair(struct line_rows *lines, struct line_set *set)
{
    const double complex *p;
    size_t *order;
    const struct frequency_list *list = &set->list;
    const size_t n_poles = transfer_poles_by_size(set->predictor, &order), n = list->n;
    double *model = bf_alloc(n_poles + n, sizeof *model), *measured = model + n_poles;
    (void)transfer_poles(set->predictor, &p);
    for (size_t k = 0; k < n_poles; k++)
        model[k] = cabs(p[order[k]]) / (2.0 * M_PI);
    for (size_t i = 0; i < n; i++)
        measured[i] = list->modes[i].frequency_Hz;
    alignment_find(measured, n, model, n_poles, set->mode);
    for (size_t i = 0; i < n; i++) {
        const size_t said = list->modes[i].mode;
        if (said > 0)
            set->mode[i] = said <= n_poles ? said - 1 : SIZE_MAX;
    }
    use_rows(lines, set);
    free(order), free(model);
}

/* ---- Residuals and derivatives ---- */

static void put(struct line_rows *lines, size_t row, double value)
{
    lines->residual[row] = lines->used[row] ? (value - lines->measured[row]) / lines->scale[row] : 0.0;
}

/* The poles at the last run. */
struct at_run {
    const double complex *p;
    const size_t *pole; /* [list.n] index into p; SIZE_MAX: none */
};

/*
 * Frequencies hardly know what damps: a parameter that turns the poles much more than it moves them is told by damping ratios alone. What does not move them at all
 * moves them by rounding.
 */
static bool is_told(const struct line_set *set, const struct at_run *at, const double complex dp[], double x,
                    bool damping_known)
{
    static const double rounding = 1e-9, turns = 0.1;
    const double size = x < 0.0 || x > 0.0 ? fabs(x) : 1.0;
    for (size_t i = 0; i < set->list.n; i++) {
        if (at->pole[i] == SIZE_MAX)
            continue;
        const double complex relative = dp[at->pole[i]] / at->p[at->pole[i]];
        const double moved = fabs(creal(relative)), turned = fabs(cimag(relative));
        if (damping_known ? hypot(moved, turned) * size > rounding : moved * size > rounding && moved > turns * turned)
            return true;
    }
    return false;
}

/* d ln|p| = Re δp/p;  d ln ζ = Re δp/Re p − Re δp/p. */
static void fill_derivatives(struct line_rows *lines, const struct line_set *set, const struct at_run *at,
                             const double x[], const bool want[])
{
    const size_t first = lines->groups[set->first_group].row, first_damping = first + set->list.n;
    bool damping_known = false;
    for (size_t i = 0; i < set->list.n; i++)
        damping_known = damping_known || set->list.modes[i].damping_ratio > 0.0;
    for (size_t j = 0; j < set->n_refs; j++) {
        const double complex *dp = want[j] ? transfer_pole_derivative(set->predictor, j) : NULL;
        double *column = lines->jacobian + set->from[j] * lines->n_rows;
        size_t damping = first_damping;
        if (dp == NULL || !is_told(set, at, dp, x[j], damping_known))
            continue;
        for (size_t i = 0; i < set->list.n; i++) {
            const size_t k = at->pole[i], row = damping;
            const bool damped = set->list.modes[i].damping_ratio > 0.0;
            damping += damped;
            if (k == SIZE_MAX)
                continue;
            const double complex p = at->p[k], relative = dp[k] / p;
            column[first + i] = creal(relative) / lines->scale[first + i];
            if (damped && -creal(p) > least_damping * cabs(p))
                column[row] = (creal(dp[k]) / creal(p) - creal(relative)) / lines->scale[row];
        }
    }
}

static void fill_residuals(struct line_rows *lines, const struct line_set *set, const struct at_run *at)
{
    const size_t first = lines->groups[set->first_group].row;
    size_t damping = first + set->list.n;
    for (size_t i = 0; i < set->list.n; i++) {
        const size_t k = at->pole[i];
        const double complex p = k != SIZE_MAX ? at->p[k] : -1.0;
        put(lines, first + i, log(cabs(p) / (2.0 * M_PI)));
        if (set->list.modes[i].damping_ratio > 0.0)
            put(lines, damping++, log(fmax(-creal(p) / cabs(p), least_damping)));
    }
}

enum bf_status frequencies_fill(struct line_rows *lines, const struct line_set *set, const double x[],
                                const bool want[], struct bf_error *err)
{
    size_t *order;
    const size_t n_poles = transfer_poles_by_size(set->predictor, &order), n = set->list.n;
    size_t *pole = bf_alloc(n, sizeof *pole);
    struct at_run at = {.pole = pole};
    enum bf_status status = BF_OK;
    (void)transfer_poles(set->predictor, &at.p);
    for (size_t i = 0; i < n && !status; i++) {
        pole[i] = set->mode[i] < n_poles ? order[set->mode[i]] : SIZE_MAX;
        if (set->mode[i] != SIZE_MAX && pole[i] == SIZE_MAX)
            status = bf_fail(err, BF_NUMERIC, "%s: mode %zu does not oscillate at these parameters", set->record->path,
                             set->mode[i] + 1);
    }
    if (status == BF_OK)
        fill_residuals(lines, set, &at);
    if (status == BF_OK && want != NULL)
        fill_derivatives(lines, set, &at, x, want);
    free(order), free(pole);
    return status;
}
