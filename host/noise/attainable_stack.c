/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_stack.c — the rows of one output, record under record, and the best residues at given poles. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Directions of the residues with singular values below this share of the largest are not told apart from rounding. */
const double attainable_dependent = 1e-10;

static double weight_of(const struct attainable_problem *p, const struct attainable_data *data)
{
    /* A channel of unknown noise is one whose noise is small; no recorder is better than this share of the signal. */
    static const double recorder = 1e-4;
    const double form = (p->form_error + recorder) * data->rms;
    const double square = data->noise * data->noise + form * form;
    return square > 0.0 ? 1.0 / sqrt(square) : 0.0;
}

void attainable_stack_free(struct attainable_stack *s)
{
    free(s->parts), free(s->column), free(s->A), free(s->z), free(s->r), free(s->length), free(s->U), free(s->c);
}

static const double *column_of(const struct attainable_part *part, size_t j)
{
    return part->rows->R + part->rows->n_states + j * part->rows->n;
}

size_t attainable_measured_column(const struct attainable_part *part)
{
    return part->rows->n - part->record->n_data + part->data;
}

/* X[row, j] += factor × column `from` of a part's rows. */
void attainable_add_rows(const struct attainable_part *part, double factor, size_t from, size_t stride, double X[],
                         size_t j)
{
    const double *R = column_of(part, from);
    for (size_t i = 0; i < part->n; i++)
        X[part->first + i + j * stride] += factor * R[i];
}

static void find_parts(const struct attainable_problem *p, const struct attainable_rows rows[], size_t output,
                       struct attainable_stack *s)
{
    size_t most = 0;
    for (size_t r = 0; r < p->n_records; r++)
        most += p->records[r].n_data;
    s->parts = bf_alloc(most + 1, sizeof *s->parts);
    s->column = bf_alloc(p->n_slots + 1, sizeof *s->column);
    for (size_t k = 0; k < p->n_slots; k++)
        s->column[k] = SIZE_MAX;
    for (size_t r = 0; r < p->n_records; r++) {
        const struct attainable_record *record = &p->records[r];
        for (size_t d = 0; d < record->n_data; d++) {
            if (record->data[d].output != output)
                continue;
            struct attainable_part *part = &s->parts[s->n_parts++];
            *part = (struct attainable_part){
                .record = record, .rows = &rows[r], .data = d, .channel = record->data[d].channel, .first = s->n};
            part->n = rows[r].n - rows[r].n_states;
            part->weight = weight_of(p, &record->data[d]);
            s->n += part->n;
            for (size_t i = 0; i < record->n_sources; i++)
                if (s->column[record->sources[i].slot] == SIZE_MAX) {
                    s->column[record->sources[i].slot] = s->columns;
                    s->columns += attainable_block(p);
                }
        }
    }
}

static void fill(const struct attainable_problem *p, struct attainable_stack *s)
{
    const size_t block = attainable_block(p);
    s->A = bf_alloc(s->n * s->columns + 1, sizeof *s->A);
    s->z = bf_alloc(s->n + 1, sizeof *s->z);
    s->r = bf_alloc(s->n + 1, sizeof *s->r);
    s->length = bf_alloc(s->columns + 1, sizeof *s->length);
    for (size_t k = 0; k < s->n_parts; k++) {
        const struct attainable_part *part = &s->parts[k];
        attainable_add_rows(part, part->weight, attainable_measured_column(part), s->n, s->z, 0);
        for (size_t i = 0; i < part->record->n_sources; i++)
            for (size_t j = 0; j < block; j++)
                attainable_add_rows(part, part->weight, part->rows->n_states + i * block + j, s->n, s->A,
                                    s->column[part->record->sources[i].slot] + j);
    }
    for (size_t j = 0; j < s->columns; j++) {
        double *A = s->A + j * s->n;
        s->length[j] = dense_norm(s->n, A);
        for (size_t i = 0; i < s->n && s->length[j] > 0.0; i++)
            A[i] /= s->length[j];
    }
}

void attainable_stack_new(const struct attainable_problem *p, const struct attainable_rows rows[], size_t output,
                          struct attainable_stack *s)
{
    *s = (struct attainable_stack){0};
    find_parts(p, rows, output, s);
    fill(p, s);
}

/* c and r = z − A c, by the singular values that count. */
enum bf_status attainable_stack_solve(struct attainable_stack *s, struct bf_error *err)
{
    const size_t least = s->n < s->columns ? s->n : s->columns;
    double *value = bf_alloc(least + 1, sizeof *value), *V = bf_alloc(s->columns * s->columns + 1, sizeof *V);
    s->U = bf_alloc(s->n * least + 1, sizeof *s->U);
    s->c = bf_alloc(s->columns + 1, sizeof *s->c);
    memcpy(s->r, s->z, s->n * sizeof *s->r);
    const enum bf_status status = dense_svd(s->n, s->columns, s->A, s->U, value, V, err);
    while (status == BF_OK && s->rank < least && value[s->rank] > attainable_dependent * value[0])
        s->rank++;
    for (size_t k = 0; k < s->rank; k++) {
        const double along = dense_dot(s->n, s->U + k * s->n, s->z);
        for (size_t j = 0; j < s->columns; j++)
            s->c[j] += along / value[k] * V[j + k * s->columns] / (s->length[j] > 0.0 ? s->length[j] : 1.0);
        for (size_t i = 0; i < s->n; i++)
            s->r[i] -= along * s->U[i + k * s->n];
    }
    free(value), free(V);
    return status;
}

double attainable_squares(const struct attainable_stack *s, double square[])
{
    double sum = 0.0;
    for (size_t k = 0; k < s->n_parts; k++) {
        const struct attainable_part *part = &s->parts[k];
        const double one = dense_dot(part->n, s->r + part->first, s->r + part->first);
        sum += one;
        if (square != NULL)
            square[part->channel] += part->weight > 0.0 ? one / (part->weight * part->weight) : 0.0;
    }
    return 0.5 * sum;
}

enum bf_status attainable_value(const struct attainable_problem *p, const struct attainable_rows rows[],
                                double *half_square, double square[], struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *half_square = 0.0;
    for (size_t c = 0; square != NULL && c < p->n_channels; c++)
        square[c] = 0.0;
    for (size_t o = 0; o < p->n_outputs && status == BF_OK; o++) {
        struct attainable_stack s;
        attainable_stack_new(p, rows, o, &s);
        status = attainable_stack_solve(&s, err);
        *half_square += attainable_squares(&s, square);
        attainable_stack_free(&s);
    }
    return status;
}
