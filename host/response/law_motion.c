/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The linear motion of the contact coordinates, and transforms between samples and the steps. */
#include "law_run.h"

#include <stdlib.h>
#include <string.h>

#include "law_transfer.h"
#include "maths/maths.h"

/* Of a step in a transform of n: those before the record stand at its end. */
static size_t place_of(const struct law_run *l, size_t n, size_t step)
{
    return step < l->lead ? n - l->lead + step : step - l->lead;
}

enum bf_status law_upsample(const struct law_run *l, const double complex W[], double out[], struct bf_error *err)
{
    size_t m = l->grid->m, factor = (size_t)l->oversample, n_fine = l->grid->n_fft * factor;
    const struct fft *plan;
    enum bf_status status = fft_get(n_fine, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *wide = bf_grow(NULL, n_fine / 2 + 1, sizeof *wide);
    double *x = bf_grow(NULL, n_fine, sizeof *x);
    for (size_t k = 0; k < m; k++)
        wide[k] = (double)factor * W[k];
    memset(wide + m, 0, (n_fine / 2 + 1 - m) * sizeof *wide);
    if (factor > 1)
        wide[m - 1] *= 0.5; /* one line at the old Nyquist frequency becomes a pair */
    fft_inverse(plan, wide, x);
    for (size_t k = 0; k < l->N; k++)
        out[k] = x[place_of(l, n_fine, k)] * l->growth[k];
    free(wide);
    free(x);
    return BF_OK;
}

enum bf_status law_transform(const struct law_run *l, const double f[], size_t stride, double complex F[],
                             struct bf_error *err)
{
    size_t factor = (size_t)l->oversample, n_fine = l->grid->n_fft * factor;
    const struct fft *plan;
    enum bf_status status = fft_get(n_fine, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *wide = bf_grow(NULL, n_fine / 2 + 1, sizeof *wide);
    double *x = bf_grow(NULL, n_fine, sizeof *x);
    memset(x, 0, n_fine * sizeof *x);
    for (size_t k = 0; k < l->N; k++)
        x[place_of(l, n_fine, k)] = f[k * stride] / l->growth[k];
    fft_forward(plan, x, wide);
    for (size_t k = 0; k < l->grid->m; k++)
        F[k] = wide[k] / (double)factor;
    free(wide);
    free(x);
    return BF_OK;
}

struct clamp_question law_clamp(const struct law_run *l, size_t c, int order)
{
    struct clamp_question q = clamp_relative(l->system->clamp, &l->system->coordinates[c], order, l->h_s, l->N);
    q.t0_s = l->system->t0_s - (double)l->lead * l->h_s;
    q.steady = l->system->free_state;
    return q;
}

/* One time derivative of a coordinate: the response with spectrum W, the free motion, and what a shaken clamp adds. */
static enum bf_status add_motion(const struct law_run *l, size_t c, int order, const double complex W[], double out[],
                                 struct bf_error *err)
{
    enum bf_status status = law_upsample(l, W, out, err);
    if (status != BF_OK)
        return status;
    law_state_add(l, c, order, out);
    if (l->system->clamp != NULL) {
        struct clamp_question q = law_clamp(l, c, order);
        clamp_motion_add(&q, out);
    }
    return BF_OK;
}

static enum bf_status coordinate_motion(struct law_run *l, size_t c, double complex W[], struct bf_error *err)
{
    enum bf_status status = BF_OK;
    law_source_response(l->system, c, W);
    if (l->uses_w)
        status = add_motion(l, c, 0, W, l->w_lin + c * l->N, err);
    for (size_t k = 0; k < l->grid->m; k++)
        W[k] *= l->grid->s[k];
    if (status == BF_OK && l->uses_v)
        status = add_motion(l, c, 1, W, l->v_lin + c * l->N, err);
    for (size_t k = 0; l->uses_a && k < l->grid->m; k++)
        W[k] *= l->grid->s[k];
    if (status == BF_OK && l->uses_a)
        status = add_motion(l, c, 2, W, l->a_lin + c * l->N, err);
    return status;
}

enum bf_status law_linear_motion(struct law_run *l, struct bf_error *err)
{
    double complex *W = bf_grow(NULL, l->grid->m, sizeof *W);
    enum bf_status status = BF_OK;
    l->w_lin = bf_alloc((l->uses_a ? 3u : 2u) * l->D * l->N, sizeof(double));
    l->v_lin = l->w_lin + l->D * l->N;
    l->a_lin = l->uses_a ? l->v_lin + l->D * l->N : NULL;
    for (size_t c = 0; status == BF_OK && c < l->D; c++)
        status = coordinate_motion(l, c, W, err);
    free(W);
    return status;
}
