/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_rows.c — inputs and measured channels of a record seen through pairs of poles, compressed to a triangle. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct pair {
    double b, A; /* q = s² + A s + b */
};

static struct pair pair_of(const double x[2])
{
    return (struct pair){.b = exp(2.0 * x[0]), .A = 2.0 * exp(x[1])};
}

/* ---- Columns on the Laplace line ---- */

struct sheet {
    const struct attainable_record *record;
    size_t rows;                    /* of X: the samples */
    double *X;                      /* [rows × columns] */
    double complex *F, *S, *factor; /* [grid.m] */
    double *y;                      /* [grid.n] */
};

static enum bf_status put_column(struct sheet *s, const double complex F[], size_t column, struct bf_error *err)
{
    const enum bf_status status = response_back(&s->record->grid, F, s->y, err);
    memcpy(s->X + column * s->rows, s->y + s->record->lead, s->record->n * sizeof *s->y);
    return status;
}

/* Columns ω²U/q and ω s U/q from `column`; and ω⁴U/q², ω³s U/q² from `derivative` (0: none). */
static enum bf_status put_pair(struct sheet *s, const double complex U[], const double x[2], size_t column,
                               size_t derivative, struct bf_error *err)
{
    const struct response_grid *grid = &s->record->grid;
    const struct pair pair = pair_of(x);
    const double omega = sqrt(pair.b);
    for (size_t k = 0; k < grid->m; k++) {
        const double complex z = grid->s[k], q = z * z + pair.A * z + pair.b;
        const double size = creal(q) * creal(q) + cimag(q) * cimag(q);
        s->factor[k] = pair.b / size * conj(q);
        s->F[k] = s->factor[k] * U[k];
        s->S[k] = s->F[k] * (z / omega);
    }
    enum bf_status status = put_column(s, s->F, column, err);
    if (status == BF_OK)
        status = put_column(s, s->S, column + 1, err);
    for (size_t k = 0; k < grid->m && derivative != 0; k++) {
        s->F[k] *= s->factor[k];
        s->S[k] *= s->factor[k];
    }
    if (status == BF_OK && derivative != 0)
        status = put_column(s, s->F, derivative, err);
    if (status == BF_OK && derivative != 0)
        status = put_column(s, s->S, derivative + 1, err);
    return status;
}

/*
 * The same columns for a pulse at the first sample: h = e^(−at) sin(ct)/c with c² = ω² − a² has 1/q, its derivative s/q;
 * (sin ct − ct cos ct) e^(−at)/(2c³) has 1/q².
 */
static void put_states(struct sheet *s, const double x[2], size_t column, size_t derivative)
{
    static const double apart = 1e-6; /* of c² from 0, as a share of ω²: nearer, 1/c³ cancels */
    const struct pair pair = pair_of(x);
    const double a = 0.5 * pair.A, omega = sqrt(pair.b), split = pair.b - a * a, dt_s = s->record->dt_s;
    const double complex i = CMPLX(0.0, 1.0), c = csqrt(fabs(split) > apart * pair.b ? split : apart * pair.b);
    const double complex per_c = 1.0 / c, half_cube = 0.5 * per_c * per_c * per_c;
    const double complex up_step = cexp((i * c - a) * dt_s), down_step = cexp((-i * c - a) * dt_s);
    double *const h = s->X + column * s->rows, *const v = h + s->rows;
    double *const h2 = s->X + derivative * s->rows, *const v2 = h2 + s->rows;
    double complex up = 0.5, down = 0.5;
    for (size_t k = 0; k < s->record->n; k++, up *= up_step, down *= down_step) {
        const double t = (double)k * dt_s;
        const double complex sine = -i * (up - down), cosine = up + down;
        h[k] = pair.b * creal(sine * per_c);
        v[k] = omega * creal(cosine - a * sine * per_c);
        if (derivative == 0)
            continue;
        const double complex twice = (sine - c * t * cosine) * half_cube;
        h2[k] = pair.b * pair.b * creal(twice);
        v2[k] = omega * pair.b * creal(0.5 * t * sine * per_c - a * twice);
    }
}

/* ---- One record ---- */

static enum bf_status fill(const struct attainable_problem *p, const double x[], enum attainable_extra extra,
                           const struct attainable_rows *rows, struct sheet *s, struct bf_error *err)
{
    const struct attainable_record *record = s->record;
    const bool derivatives = extra == EXTRA_DERIVATIVES;
    size_t column = rows->n_states, next = rows->n_states + rows->n_residues; /* of the extra columns */
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < record->n_sources; i++) {
        for (size_t k = 0; k < p->m && status == BF_OK; k++, column += 2, next += derivatives ? 2 : 0)
            status = put_pair(s, record->sources[i].U, x + 2 * k, column, derivatives ? next : 0, err);
        for (size_t k = 0; k < ATTAINABLE_PATHS; k++, column++)
            memcpy(s->X + column * s->rows, record->sources[i].path[k], record->n * sizeof *s->X);
    }
    for (size_t k = 0; k < p->m && record->moving; k++, next += derivatives ? 2 : 0)
        put_states(s, x + 2 * k, 2 * k, derivatives ? next : 0);
    for (size_t i = 0; i < record->n_rings; i++)
        recorder_ring(record->ring, i, record->n, s->X + (2 * p->m + i) * s->rows);
    for (size_t d = 0; d < record->n_data && extra == EXTRA_MEASURED; d++)
        for (size_t k = 0; k < p->m && status == BF_OK; k++, next += 2)
            status = put_pair(s, record->data[d].Y, x + 2 * k, next, 0, err);
    for (size_t d = 0; d < record->n_data; d++, next++)
        memcpy(s->X + next * s->rows, record->data[d].z, record->n * sizeof *s->X);
    return status;
}

/* R[n × n] of X[rows × n], block by block: a long record leaves the processor's cache else. */
static enum bf_status triangle(size_t rows, size_t n, const double X[], double R[], struct bf_error *err)
{
    enum { BLOCK = 1024 };
    double *A = bf_alloc((n + BLOCK) * n, sizeof *A);
    enum bf_status status = BF_OK;
    memset(R, 0, n * n * sizeof *R);
    for (size_t first = 0; first < rows && status == BF_OK; first += BLOCK) {
        const size_t some = rows - first < BLOCK ? rows - first : BLOCK, height = n + some;
        for (size_t j = 0; j < n; j++) {
            memcpy(A + j * height, R + j * n, n * sizeof *A);
            memcpy(A + j * height + n, X + first + j * rows, some * sizeof *A);
        }
        status = dense_qr_triangle(height, n, A, R, err);
    }
    free(A);
    return status;
}

static enum bf_status compress(const struct attainable_problem *p, const double x[], enum attainable_extra extra,
                               struct attainable_record *record, struct attainable_rows *rows, struct bf_error *err)
{
    enum bf_status status = attainable_open(record, extra == EXTRA_MEASURED, err);
    if (status != BF_OK)
        return status;
    const size_t pairs = 2 * p->m, moving = record->moving ? pairs : 0, states = moving + record->n_rings;
    *rows = (struct attainable_rows){.n_states = states, .n_residues = record->n_sources * attainable_block(p)};
    if (extra == EXTRA_DERIVATIVES)
        rows->n_extra = record->n_sources * pairs + moving;
    else if (extra == EXTRA_MEASURED)
        rows->n_extra = record->n_data * pairs;
    rows->n = states + rows->n_residues + rows->n_extra + record->n_data;
    struct sheet s = {.record = record, .rows = record->n};
    s.X = bf_alloc(s.rows * rows->n, sizeof *s.X);
    s.F = bf_alloc(record->grid.m, sizeof *s.F);
    s.S = bf_alloc(record->grid.m, sizeof *s.S);
    s.factor = bf_alloc(record->grid.m, sizeof *s.factor);
    s.y = bf_alloc(record->grid.n, sizeof *s.y);
    rows->R = bf_alloc(rows->n * rows->n, sizeof *rows->R);
    status = fill(p, x, extra, rows, &s, err);
    if (status == BF_OK)
        status = triangle(s.rows, rows->n, s.X, rows->R, err);
    free(s.X), free(s.F), free(s.S), free(s.factor), free(s.y);
    if (attainable_is_piece(record))
        attainable_close(record);
    return status;
}

enum bf_status attainable_compress(const struct attainable_problem *p, const double x[], enum attainable_extra extra,
                                   struct attainable_rows rows[], struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t r = 0; r < p->n_records; r++)
        rows[r] = (struct attainable_rows){0};
    for (size_t r = 0; r < p->n_records && status == BF_OK; r++)
        status = compress(p, x, extra, &p->records[r], &rows[r], err);
    return status;
}

void attainable_rows_free(struct attainable_rows rows[], size_t n)
{
    for (size_t r = 0; r < n; r++)
        free(rows[r].R);
}
