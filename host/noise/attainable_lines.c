/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_lines.c — inputs and channels of a record, or of a piece of one, on its Laplace line. */
#include "attainable_problem.h"

#include <stdlib.h>
#include <string.h>

/* y[grid.n + n_tail]: x with a run-up before it, of samples or made of it, and a run-out after it: it begins and ends in no step. */
static void extend(const struct attainable_record *r, const double x[], double y[])
{
    const struct response_grid *grid = &r->grid;
    const size_t n = r->n + r->after;
    double *turned = bf_alloc(n, sizeof *turned),
           *long_one = bf_alloc(grid->n + n + 2 * grid->n_tail, sizeof *long_one);
    struct response_grid back = *grid; /* of n samples: the run-up is the run-out of the record turned round */
    back.n = n;
    if (!r->first) {
        memcpy(y, x - r->lead, r->lead * sizeof *y);
    } else if (r->lead > 0) {
        for (size_t k = 0; k < n; k++)
            turned[k] = x[n - 1 - k];
        response_tail(&back, turned, n, long_one);
        for (size_t k = 0; k < r->lead; k++)
            y[r->lead - 1 - k] = long_one[n + k];
    }
    memcpy(y + r->lead, x, n * sizeof *y);
    memcpy(long_one, y, grid->n * sizeof *y);
    response_tail(grid, long_one, grid->n, y);
    free(turned), free(long_one);
}

static enum bf_status transform(const struct attainable_record *r, const double x[], double complex **out,
                                struct bf_error *err)
{
    const size_t count = r->grid.n + r->grid.n_tail;
    double *y = bf_alloc(count, sizeof *y);
    *out = bf_alloc(r->grid.m, sizeof **out);
    extend(r, x, y);
    const enum bf_status status = response_transform(&r->grid, y, count, *out, err);
    free(y);
    return status;
}

static enum bf_status open_source(const struct attainable_record *r, struct attainable_source *source,
                                  struct bf_error *err)
{
    enum bf_status status = transform(r, source->u, &source->U, err);
    double complex *F = bf_alloc(r->grid.m, sizeof *F);
    double *y = bf_alloc(r->grid.n, sizeof *y);
    if (status == BF_OK)
        memcpy(F, source->U, r->grid.m * sizeof *F);
    for (size_t k = 0; k < ATTAINABLE_PATHS; k++) {
        source->path[k] = bf_alloc(r->n, sizeof *source->path[k]);
        if (status == BF_OK)
            status = response_back(&r->grid, F, y, err);
        memcpy(source->path[k], k == 0 ? source->u : y + r->lead, r->n * sizeof *y);
        for (size_t i = 0; i < r->grid.m; i++)
            F[i] *= r->grid.s[i];
    }
    free(F), free(y);
    return status;
}

/* What moves already has a run-up; one period of a steady state needs none. A piece sees its inputs as the whole record does. */
static enum bf_status make_grid(struct attainable_record *r, struct bf_error *err)
{
    const size_t n = r->n + r->after;
    if (r->periodic)
        return response_grid_periodic(n, r->dt_s, r->window_rate, &r->grid, err);
    enum bf_status status = response_grid_new(r->lead + n, r->dt_s, INTERSAMPLE_BAND_LIMITED, &r->grid, err);
    if (status == BF_OK && r->first && r->moving && r->lead == 0) {
        r->lead = r->grid.n_tail;
        response_grid_free(&r->grid);
        status = response_grid_new(r->lead + n, r->dt_s, INTERSAMPLE_BAND_LIMITED, &r->grid, err);
    }
    if (status == BF_OK && attainable_is_piece(r))
        r->grid.fade_rate = response_grid_rate(r->n_whole, INTERSAMPLE_BAND_LIMITED);
    return status;
}

enum bf_status attainable_open(struct attainable_record *r, bool with_measured, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    if (!r->open) {
        r->open = true;
        status = make_grid(r, err);
        for (size_t i = 0; i < r->n_sources && status == BF_OK; i++)
            status = open_source(r, &r->sources[i], err);
    }
    if (with_measured && !r->measured) {
        r->measured = true;
        for (size_t d = 0; d < r->n_data && status == BF_OK; d++)
            status = transform(r, r->data[d].z, &r->data[d].Y, err);
    }
    if (status != BF_OK)
        attainable_close(r);
    return status;
}

void attainable_close(struct attainable_record *r)
{
    for (size_t i = 0; i < r->n_sources; i++) {
        for (size_t k = 0; k < ATTAINABLE_PATHS; k++) {
            free(r->sources[i].path[k]);
            r->sources[i].path[k] = NULL;
        }
        free(r->sources[i].U);
        r->sources[i].U = NULL;
    }
    for (size_t d = 0; d < r->n_data; d++) {
        free(r->data[d].Y);
        r->data[d].Y = NULL;
    }
    response_grid_free(&r->grid);
    r->open = r->measured = false;
}
