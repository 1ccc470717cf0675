/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The Jacobian of long records block by block: handed on, or compressed to a triangle, never whole. */
#include "fit_problem.h"

#include <stdlib.h>
#include "fit_triangle.h"

enum { BLOCK = 1024 }; /* rows at a time: they stay in the processor's cache */

struct blocks {
    const struct fit_problem *p;
    const double *slope; /* [n_unknowns] dθ/dx */
    const struct fit_rows_sink *sink;
    double *J, *r; /* [BLOCK × n_unknowns], [BLOCK] */
};

/* Rows first … first + n − 1 of a block. */
static void weigh(const struct blocks *b, const struct predict_block *block, size_t first, size_t n)
{
    const struct fit_problem *p = b->p;
    const struct predict_channel *channel = &p->channels[block->channel];
    const double *w = p->weight + block->row + first;
    const double *z = channel->measured + (block->row - channel->row) + first;
    for (size_t k = 0; k < n; k++)
        b->r[k] = w[k] * (block->y[first + k] - z[k]);
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const double *column = block->column[p->unknowns[i].ref];
        for (size_t k = 0; k < n; k++)
            b->J[k + i * n] = column != NULL ? b->slope[i] * w[k] * column[first + k] : 0.0;
    }
}

static enum bf_status take(void *context, const struct predict_block *block, struct bf_error *err)
{
    const struct blocks *b = context;
    enum bf_status status = BF_OK;
    for (size_t end = block->n; end > 0 && status == BF_OK;) {
        const size_t n = end < BLOCK ? end : BLOCK;
        end -= n;
        weigh(b, block, end, n);
        status = b->sink->take(b->sink->context, block->channel, block->row + end, n, b->J, b->r, err);
    }
    return status;
}

enum bf_status fit_problem_blocks(struct fit_problem *p, const double x[], const struct fit_rows_sink *sink,
                                  struct prediction *out, struct bf_error *err)
{
    double *slope = bf_alloc(p->n_unknowns, sizeof *slope);
    struct blocks b = {.p = p, .slope = slope, .sink = sink};
    b.J = bf_alloc(BLOCK * p->n_unknowns, sizeof *b.J), b.r = bf_alloc(BLOCK, sizeof *b.r);
    for (size_t i = 0; i < p->n_unknowns; i++)
        slope[i] = fit_problem_slope(p, i, x);
    const enum bf_status status = predictor_run_blocks(p->predictor, p->theta, p->want,
                                                       &(struct predict_sink){.take = take, .context = &b}, out, err);
    free(slope), free(b.J), free(b.r);
    return status;
}

static enum bf_status add_rows(void *context, size_t channel, size_t row, size_t some, const double J[],
                               const double r[], struct bf_error *err)
{
    (void)channel, (void)row;
    return triangle_add(context, some, some, J, r, err);
}

enum bf_status fit_problem_compress(struct fit_problem *p, const double x[], struct prediction *out,
                                    struct bf_error *err)
{
    struct triangle t = triangle_new(p->n_unknowns);
    const enum bf_status status =
        fit_problem_blocks(p, x, &(struct fit_rows_sink){.take = add_rows, .context = &t}, out, err);
    triangle_into(&t, p->n_jacobian, p->jacobian, p->beside);
    triangle_free(&t);
    return status;
}
