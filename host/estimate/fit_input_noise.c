/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * What the noise of measured inputs makes of standard errors. The prediction answers a recorded force with its noise: e = h * n in every channel of the record at
 * once, so near resonances, where the derivatives are, too; what a fit leaves does not show it, for the fit has followed it. Of white noise of variance σ² it adds
 *
 *     JᵀW E[e eᵀ] WJ = σ² Σ_s q(s) q(s)ᵀ,      q(s) = Σ_channels Σ_{t ≥ s} h(t − s) w(t) J(t),
 *
 * which is the convolution with h of what is reversed in time. Of an input that was cleaned (inputs_clean()) the noise is a part of that, n -> M n, and Mᵀ q stands for q.
 */
#include "fit_coloured.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

#include "noise/noise.h"

/* x[grid->n]: column j of WJ in the rows of a channel, last row first; rows that a window has left out are zero. */
static void reversed(const struct fit_problem *p, const struct predict_channel *channel, size_t j, size_t n, double x[])
{
    const double *J = p->jacobian + j * p->n_jacobian + channel->row, *w = p->weight + channel->row;
    for (size_t k = 0; k < n; k++)
        x[n - 1 - k] = k < channel->n ? w[k] * J[k] : 0.0;
}

/* Q[n_unknowns][m] += H of the channel times the transforms of its columns. */
static enum bf_status add_channel(const struct fit_problem *p, size_t c, const struct response_grid *grid,
                                  const double complex H[], double complex Q[], struct bf_error *err)
{
    double *x = bf_alloc(grid->n, sizeof *x);
    double complex *X = bf_alloc(grid->m, sizeof *X);
    enum bf_status status = BF_OK;
    for (size_t j = 0; j < p->n_unknowns && !status; j++) {
        reversed(p, &p->channels[c], j, grid->n, x);
        status = response_transform(grid, x, grid->n, X, err);
        for (size_t k = 0; k < grid->m && !status; k++)
            Q[j * grid->m + k] += H[k] * X[k];
    }
    free(x), free(X);
    return status;
}

/* q[n] of Q: turned round in time, and through M = Mᵀ. */
static enum bf_status keep(const struct response_grid *grid, const struct column_noise *cells, double q[],
                           struct bf_error *err)
{
    if (cells == NULL)
        return BF_OK;
    for (size_t k = 0; 2 * k + 1 < grid->n; k++) {
        const double first = q[k];
        q[k] = q[grid->n - 1 - k], q[grid->n - 1 - k] = first;
    }
    return input_noise_keep(cells, q, grid->n, q, err);
}

/* square += σ² Σ q qᵀ. */
static enum bf_status add_square(size_t n, const struct response_grid *grid, const double complex Q[], double sigma,
                                 const struct column_noise *cells, double square[], struct bf_error *err)
{
    double *q = bf_alloc(n * grid->n, sizeof *q);
    enum bf_status status = BF_OK;
    for (size_t j = 0; j < n && !status; j++) {
        status = response_back(grid, Q + j * grid->m, q + j * grid->n, err);
        if (!status)
            status = keep(grid, cells, q + j * grid->n, err);
    }
    if (!status)
        dense_gemm(true, false, n, n, grid->n, sigma * sigma, q, q, 1.0, square);
    free(q);
    return status;
}

static enum bf_status add_input(const struct fit_problem *p, size_t record, size_t input, double sigma,
                                const struct column_noise *cells, double square[], struct bf_error *err)
{
    const struct transfer_record t = transfer_record(p->predictor, record);
    double complex *H = bf_alloc(t.grid->m, sizeof *H), *Q = bf_alloc(p->n_unknowns * t.grid->m, sizeof *Q);
    enum bf_status status = BF_OK;
    bool any = false;
    for (size_t c = t.first_channel; c < t.first_channel + t.n_channels && !status; c++)
        if (transfer_path(p->predictor, p->theta, c, input, H)) {
            status = add_channel(p, c, t.grid, H, Q, err);
            any = true;
        }
    if (any && !status)
        status = add_square(p->n_unknowns, t.grid, Q, sigma, cells, square, err);
    free(H), free(Q);
    return status;
}

enum bf_status fit_input_square(const struct fit_problem *p, double square[], struct bf_error *err)
{
    enum bf_status status = BF_OK;
    if (p->predictor == NULL || !transfer_of_all(p->predictor))
        return BF_OK;
    for (size_t r = 0; r < transfer_records(p->predictor); r++)
        for (size_t i = 0; i < p->model->n_inputs && !status; i++) {
            const struct column_noise *cells;
            const double sigma =
                fabs(p->levels[r]) * noise_of_record_input(&p->records[r], p->model->inputs[i].name, &cells);
            if (sigma > 0.0)
                status = add_input(p, r, i, sigma, cells, square, err);
        }
    return status;
}
