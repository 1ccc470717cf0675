/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_check.c — what the free linear model of some records leaves of others: poles and residues of those, states of these. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>

struct side {
    struct attainable_problem problem;
    struct attainable_rows *rows; /* [n_records] */
};

static void side_free(struct side *s)
{
    if (s->rows != NULL)
        attainable_rows_free(s->rows, s->problem.n_records);
    free(s->rows);
    attainable_problem_free(&s->problem);
}

/* Slots of a record's own residues are counted from n_slots. */
static enum bf_status side_new(const struct model *model, const struct record records[], size_t n_records,
                               const double noise_rms[], const double x[], const struct attainable *found,
                               size_t n_slots, struct side *s, struct bf_error *err)
{
    *s = (struct side){
        .problem = {.m = found->modes, .n_slots = n_slots, .n_outputs = model->n_outputs, .form_error = found->nrmse}};
    double *own = NULL;
    const enum bf_status status = noise_rms == NULL ? attainable_noise(model, records, n_records, &own, err) : BF_OK;
    for (size_t r = 0; r < n_records && status == BF_OK; r++)
        attainable_add_record(&s->problem, model, &records[r], r, own != NULL ? own : noise_rms);
    free(own);
    if (status != BF_OK)
        return status;
    s->rows = bf_alloc(s->problem.n_records + 1, sizeof *s->rows);
    return attainable_compress(&s->problem, x, EXTRA_NONE, s->rows, err);
}

/* Does `fitted` have the residues of all inputs of this channel? */
static bool is_known(const struct attainable_part *part, const struct attainable_stack *fitted, size_t n_slots)
{
    for (size_t i = 0; i < part->record->n_sources; i++) {
        const size_t slot = part->record->sources[i].slot;
        if (slot >= n_slots || fitted->column[slot] == SIZE_MAX)
            return false;
    }
    return fitted->n_parts > 0;
}

/* Takes the motion by the fitted residues off check->r. */
static void subtract(const struct attainable_problem *p, const struct attainable_stack *fitted, size_t n_slots,
                     struct attainable_stack *check)
{
    for (size_t i = 0; i < check->n; i++)
        check->r[i] = check->z[i];
    for (size_t slot = 0; slot < n_slots; slot++) {
        if (check->column[slot] == SIZE_MAX || fitted->column[slot] == SIZE_MAX)
            continue;
        for (size_t j = 0; j < attainable_block(p); j++) {
            const size_t at = check->column[slot] + j;
            const double c = fitted->c[fitted->column[slot] + j] * check->length[at];
            for (size_t i = 0; i < check->n; i++)
                check->r[i] -= c * check->A[i + at * check->n];
        }
    }
}

/* Adds squared ratios to the noise of this output's channels; a piece counts as the share of its record that it is. */
static enum bf_status add_output(const struct side *fitted, const struct side *check, size_t output, double *sum,
                                 double *n, struct bf_error *err)
{
    const size_t n_slots = fitted->problem.n_slots;
    struct attainable_stack a, b;
    attainable_stack_new(&fitted->problem, fitted->rows, output, &a);
    attainable_stack_new(&check->problem, check->rows, output, &b);
    const enum bf_status status = attainable_stack_solve(&a, err);
    if (status == BF_OK)
        subtract(&check->problem, &a, n_slots, &b);
    for (size_t k = 0; k < b.n_parts && status == BF_OK; k++) {
        const struct attainable_part *part = &b.parts[k];
        const struct attainable_data *data = &part->record->data[part->data];
        if (!(data->noise > 0.0) || !(part->weight > 0.0) || !is_known(part, &a, n_slots))
            continue;
        const double rms =
            dense_norm(part->n, b.r + part->first) / part->weight / sqrt((double)part->record->n) / data->noise;
        const double share = (double)part->record->n / (double)part->record->n_whole;
        *sum += share * rms * rms;
        *n += share;
    }
    attainable_stack_free(&a);
    attainable_stack_free(&b);
    return status;
}

enum bf_status attainable_check(const struct model *model, const struct record records[], size_t n_records,
                                const double noise_rms[], const struct record checks[], size_t n_checks,
                                struct attainable *found, struct bf_error *err)
{
    struct side fitted = {0}, check = {0};
    double sum = 0.0, n = 0.0;
    found->held_out_noise_ratio = nan("");
    if (found->modes == 0 || n_checks == 0)
        return BF_OK;
    double *x = bf_alloc(2 * found->modes, sizeof *x);
    for (size_t k = 0; k < found->modes; k++) {
        x[2 * k] = log(2.0 * M_PI * found->poles[k].frequency_Hz);
        x[2 * k + 1] = x[2 * k] + log(found->poles[k].damping_ratio);
    }
    enum bf_status status = side_new(model, records, n_records, noise_rms, x, found, model->n_inputs, &fitted, err);
    if (status == BF_OK)
        status = side_new(model, checks, n_checks, NULL, x, found, fitted.problem.n_slots, &check, err);
    for (size_t o = 0; o < model->n_outputs && status == BF_OK; o++)
        status = add_output(&fitted, &check, o, &sum, &n, err);
    if (status == BF_OK && n > 0.0)
        found->held_out_noise_ratio = sqrt(sum / n);
    side_free(&fitted);
    side_free(&check);
    free(x);
    return status;
}
