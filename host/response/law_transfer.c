/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_transfer.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static size_t index_of(const struct law_transfers *t, size_t grid, size_t row, size_t coordinate)
{
    size_t rows = t->n / (t->n_grids * t->n_coordinates);
    return (grid * rows + row) * t->n_coordinates + coordinate;
}

const struct law_pair *law_from_source(const struct law_transfers *t, size_t grid, size_t source, size_t coordinate)
{
    return &t->pairs[index_of(t, grid, source, coordinate)];
}

const struct law_pair *law_to_output(const struct law_transfers *t, size_t grid, size_t output, size_t coordinate)
{
    return &t->pairs[index_of(t, grid, t->n_sources + output, coordinate)];
}

/* A pair that some record of the grid needs has its functionals set. */
static void need_row(const struct run *run, struct law_transfers *t, size_t grid, size_t row,
                     const struct functional *other, bool output, int order)
{
    for (size_t c = 0; c < t->n_coordinates; c++) {
        const struct functional *f = &run->p->coordinates[c];
        t->pairs[index_of(t, grid, row, c)] = (struct law_pair){
            .of = output ? other : f, .by = output ? f : other, .by_force = output, .order = order, .grid = grid};
    }
}

void law_transfers_new(const struct run *run, struct law_transfers *out)
{
    const struct predictor *p = run->p;
    *out = (struct law_transfers){.n_grids = p->n_grids, .n_coordinates = p->n_coordinates, .n_sources = p->n_sources};
    out->n = p->n_grids * (p->n_sources + p->model.n_outputs) * p->n_coordinates;
    out->pairs = bf_alloc(out->n, sizeof *out->pairs);
    for (size_t r = 0; r < p->n_records; r++) {
        const struct record_plan *plan = &p->plans[r];
        for (size_t i = 0; i < p->model.n_inputs; i++)
            if (plan->input[i] != NULL)
                need_row(run, out, plan->grid, plan->source[i], &p->inputs[plan->source[i]], false, 0);
        for (size_t c = 0; c < plan->n_channels; c++) {
            size_t o = p->channels[plan->first_channel + c].output;
            need_row(run, out, plan->grid, out->n_sources + o, &p->outputs[o], true,
                     output_order(p->model.outputs[o].kind));
        }
    }
}

void law_transfers_fill(const struct run *run, struct law_transfers *transfers, size_t i)
{
    const struct predictor *p = run->p;
    struct law_pair *pair = &transfers->pairs[i];
    if (pair->of == NULL)
        return;
    const struct functional *a = pair->of, *b = pair->by;
    const struct response_kernel *kernel = pair->by_force ? p->force_kernels[pair->grid] : p->kernels[pair->grid];
    size_t m = p->grids[pair->grid].m, n_poles = p->system->n_poles;
    pair->H = bf_grow(NULL, m, sizeof *pair->H);
    response_value(kernel, pair->order, a->alpha, b->alpha, pair->H);
    if (run->want == NULL)
        return;
    pair->dH = bf_alloc(p->map.n, sizeof *pair->dH);
    struct response_change *changes = bf_alloc(p->map.n + 1, sizeof *changes);
    size_t n = 0;
    for (size_t j = 0; j < p->map.n; j++) {
        if (!run_structural(run, j))
            continue;
        pair->dH[j] = bf_grow(NULL, m, sizeof **pair->dH);
        changes[n++] = (struct response_change){.d_alpha = a->d_alpha + j * n_poles,
                                                .d_beta = b->d_alpha + j * n_poles,
                                                .d_p = p->system->derivative[j].p,
                                                .H = pair->dH[j]};
    }
    response_derivatives(kernel, pair->order, a->alpha, b->alpha, changes, n);
    free(changes);
}

void law_transfers_free(const struct run *run, struct law_transfers *transfers)
{
    for (size_t i = 0; i < transfers->n; i++) {
        for (size_t j = 0; transfers->pairs[i].dH != NULL && j < run->p->map.n; j++)
            free(transfers->pairs[i].dH[j]);
        free(transfers->pairs[i].dH);
        free(transfers->pairs[i].H);
    }
    free(transfers->pairs);
}

/* W += scale · H · U */
static void add_path(size_t m, double scale, const double complex H[], const double complex U[], double complex W[])
{
    for (size_t k = 0; k < m; k++)
        W[k] += scale * (H[k] * U[k]);
}

void law_source_response(const struct run *run, const struct law_transfers *t, size_t record, size_t coordinate,
                         double complex W[])
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    size_t m = p->grids[plan->grid].m, parameter;
    memset(W, 0, m * sizeof *W);
    for (size_t i = 0; i < p->model.n_inputs; i++)
        if (plan->input[i] != NULL)
            add_path(m, input_gain(run, i, &parameter), law_from_source(t, plan->grid, plan->source[i], coordinate)->H,
                     plan->U[i], W);
    recorder_undo(plan, m, W);
}

bool law_source_derivative(const struct run *run, const struct law_transfers *t, size_t record, size_t coordinate,
                           size_t parameter, double complex dW[])
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    bool structural = run_structural(run, parameter);
    size_t m = p->grids[plan->grid].m, gain_parameter;
    if (!structural && !source_depends(run, record, parameter))
        return false;
    memset(dW, 0, m * sizeof *dW);
    for (size_t i = 0; i < p->model.n_inputs; i++) {
        if (plan->input[i] == NULL)
            continue;
        const struct law_pair *pair = law_from_source(t, plan->grid, plan->source[i], coordinate);
        double gain = input_gain(run, i, &gain_parameter);
        if (structural)
            add_path(m, gain, pair->dH[parameter], plan->U[i], dW);
        else if (gain_parameter == parameter)
            add_path(m, 1.0, pair->H, plan->U[i], dW);
    }
    for (size_t c = 0; c < plan->n_changes; c++) {
        const struct drive_change *change = &plan->changes[c];
        if (change->parameter == parameter)
            add_path(m, input_gain(run, change->input, &gain_parameter),
                     law_from_source(t, plan->grid, plan->source[change->input], coordinate)->H, change->U, dW);
    }
    recorder_undo(plan, m, dW);
    return true;
}
