/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_transfer.h"

#include <stdlib.h>
#include <string.h>

#include "recorder.h"

void law_transfers_new(const struct system *system, size_t rows, size_t n_coordinates, struct law_transfers *out)
{
    *out = (struct law_transfers){.system = system, .n = rows * n_coordinates, .n_coordinates = n_coordinates};
    out->pairs = bf_alloc(out->n, sizeof *out->pairs);
    out->paths = bf_alloc(out->n, sizeof *out->paths);
}

void law_transfers_row(struct law_transfers *t, size_t row, const struct law_pair *pair,
                       const struct functional coordinates[])
{
    for (size_t c = 0; c < t->n_coordinates; c++) {
        struct law_pair *own = &t->pairs[row * t->n_coordinates + c];
        *own = *pair;
        if (own->of == NULL)
            own->of = &coordinates[c];
        else
            own->by = &coordinates[c];
    }
}

void law_transfers_fill(struct law_transfers *t, const bool structural[], size_t i)
{
    const struct law_pair *pair = &t->pairs[i];
    struct modal_path *path = &t->paths[i];
    if (pair->of == NULL)
        return;
    const struct functional *a = pair->of, *b = pair->by;
    size_t m = pair->grid->m, n_poles = t->system->n_poles;
    path->H = bf_grow(NULL, m, sizeof *path->H);
    response_value(pair->kernel, pair->order, a->alpha, b->alpha, path->H);
    if (structural == NULL)
        return;
    path->dH = bf_alloc(t->system->map->n, sizeof *path->dH);
    struct response_change *changes = bf_alloc(t->system->map->n + 1, sizeof *changes);
    size_t n = 0;
    for (size_t j = 0; j < t->system->map->n; j++) {
        if (!structural[j])
            continue;
        path->dH[j] = bf_grow(NULL, m, sizeof **path->dH);
        changes[n++] = (struct response_change){.d_alpha = a->d_alpha + j * n_poles,
                                                .d_beta = b->d_alpha + j * n_poles,
                                                .d_p = t->system->derivative[j].p,
                                                .H = path->dH[j]};
    }
    response_derivatives(pair->kernel, pair->order, a->alpha, b->alpha, changes, n);
    free(changes);
}

void law_transfers_free(struct law_transfers *t)
{
    for (size_t i = 0; i < t->n; i++) {
        for (size_t j = 0; t->paths[i].dH != NULL && j < t->system->map->n; j++)
            free(t->paths[i].dH[j]);
        free(t->paths[i].dH);
        free(t->paths[i].H);
    }
    free(t->pairs);
    free(t->paths);
}

/* W += scale · H · U */
static void add_path(size_t m, double scale, const double complex H[], const double complex U[], double complex W[])
{
    for (size_t k = 0; k < m; k++)
        W[k] += scale * (H[k] * U[k]);
}

void law_source_response(const struct modal_system *s, size_t coordinate, double complex W[])
{
    size_t m = s->grid->m;
    memset(W, 0, m * sizeof *W);
    for (size_t i = 0; i < s->n_inputs; i++)
        add_path(m, s->inputs[i].gain, s->inputs[i].paths[coordinate].H, s->inputs[i].U, W);
    recorder_undo(s->recorder, m, W);
}

bool law_source_derivative(const struct modal_system *s, size_t coordinate, size_t parameter, double complex dW[])
{
    const struct modal_parameter *role = &s->parameters[parameter];
    size_t m = s->grid->m;
    if ((!role->structural && !role->of_input) || s->n_inputs == 0)
        return false;
    memset(dW, 0, m * sizeof *dW);
    for (size_t i = 0; i < s->n_inputs; i++) {
        const struct modal_input *input = &s->inputs[i];
        const struct modal_path *path = &input->paths[coordinate];
        if (role->structural)
            add_path(m, input->gain, path->dH[parameter], input->U, dW);
        else if (input->gain_parameter == parameter)
            add_path(m, 1.0, path->H, input->U, dW);
        for (size_t c = 0; c < input->n_changes; c++)
            if (input->changes[c].parameter == parameter)
                add_path(m, input->gain, path->H, input->changes[c].d, dW);
    }
    recorder_undo(s->recorder, m, dW);
    return true;
}
