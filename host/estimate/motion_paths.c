/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From the Laplace line to time and back: the motion of a functional, and what forces do to the channels. */
#include "estimate.h"
#include "motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion_modes.h"
#include "maths/maths.h"

/* ---- Motion of a functional ---- */

/* W[m] to n · factor points of time. */
static enum bf_status to_time(const struct response_grid *grid, size_t factor, const double complex W[], double out[],
                              struct bf_error *err)
{
    const struct fft *plan;
    size_t n_fine = grid->n_fft * factor;
    enum bf_status status = fft_get(n_fine, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *wide = bf_alloc(n_fine / 2 + 1, sizeof *wide);
    double *x = bf_alloc(n_fine, sizeof *x);
    for (size_t k = 0; k < grid->m; k++)
        wide[k] = (double)factor * W[k];
    if (factor > 1)
        wide[grid->m - 1] *= 0.5; /* one line at the old Nyquist frequency becomes a pair */
    fft_inverse(plan, wide, x);
    double h = grid->dt_s / (double)factor;
    for (size_t k = 0; k < grid->n * factor; k++)
        out[k] = x[k] * exp(grid->sigma * h * (double)k);
    free(wide);
    free(x);
    return BF_OK;
}

enum bf_status motion_of(const struct motion *motion, size_t record, const double g[], int oversample, double w[],
                         double v[], double a[], struct bf_error *err)
{
    const struct transfer_record t = transfer_record(motion->predictor, record);
    size_t m = t.grid->m;
    double complex *W = bf_alloc(m, sizeof *W);
    transfer_motion(motion->predictor, motion->theta, record, g, W);
    for (size_t k = 0; k < motion->modes.n; k++) {
        double shape = motion_shape(&motion->modes, k, g);
        const double complex *q = motion->records[record].q + k * m;
        for (size_t i = 0; i < m; i++)
            W[i] += shape * q[i];
    }
    double *const out[3] = {w, v, a};
    enum bf_status status = BF_OK;
    for (int order = 0; order < 3; order++) {
        for (size_t i = 0; order > 0 && i < m; i++)
            W[i] *= t.grid->s[i];
        if (out[order] == NULL || status != BF_OK)
            continue;
        status = to_time(t.grid, (size_t)oversample, W, out[order], err);
        transfer_state_motion(motion->predictor, motion->theta, record, g, order, oversample, out[order]);
    }
    free(W);
    return status;
}

/* ---- Forces ---- */

enum bf_status motion_transform(const struct motion *motion, size_t record, const double f[], size_t stride,
                                int oversample, double complex F[], struct bf_error *err)
{
    const struct response_grid *grid = transfer_record(motion->predictor, record).grid;
    const struct fft *plan;
    size_t factor = (size_t)oversample, n_fine = grid->n_fft * factor;
    enum bf_status status = fft_get(n_fine, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *wide = bf_alloc(n_fine / 2 + 1, sizeof *wide);
    double *x = bf_alloc(n_fine, sizeof *x);
    double h = grid->dt_s / (double)factor;
    for (size_t k = 0; k < grid->n * factor; k++)
        x[k] = f[k * stride] * exp(-grid->sigma * h * (double)k);
    fft_forward(plan, x, wide);
    for (size_t k = 0; k < grid->m; k++)
        F[k] = wide[k] / (double)factor;
    free(wide);
    free(x);
    return BF_OK;
}

/* An earlier channel of the same output on the same grid, or the channel itself. */
static size_t same_path(const struct motion *motion, size_t channel)
{
    size_t grid = transfer_record(motion->predictor, motion->channels[channel].record).grid_index;
    for (size_t c = 0; c < channel; c++)
        if (motion->channels[c].output == motion->channels[channel].output &&
            transfer_record(motion->predictor, motion->channels[c].record).grid_index == grid)
            return c;
    return channel;
}

void motion_paths_new(const struct motion *motion, const double g[], size_t d, struct motion_paths *out)
{
    *out = (struct motion_paths){.d = d};
    out->H = bf_alloc(motion->n_channels, sizeof *out->H);
    out->own = bf_alloc(motion->n_channels, sizeof *out->own);
    for (size_t c = 0; c < motion->n_channels; c++) {
        const struct transfer_record t = transfer_record(motion->predictor, motion->channels[c].record);
        size_t first = same_path(motion, c);
        out->own[c] = first == c || out->H[first] == NULL;
        if (!out->own[c]) {
            out->H[c] = out->H[first];
            continue;
        }
        out->H[c] = bf_alloc(d * t.grid->m, sizeof *out->H[c]);
        for (size_t j = 0; j < d; j++)
            transfer_force(motion->predictor, t.grid_index, motion->channels[c].output, g + j * motion->modes.dimension,
                           out->H[c] + j * t.grid->m);
    }
}

void motion_paths_free(const struct motion *motion, struct motion_paths *paths)
{
    for (size_t c = 0; paths->H != NULL && c < motion->n_channels; c++)
        if (paths->own[c])
            free(paths->H[c]);
    free(paths->H);
    free(paths->own);
    *paths = (struct motion_paths){0};
}

enum bf_status motion_respond(const struct motion *motion, const struct motion_paths *paths, size_t record,
                              const double complex F[], double rows[], struct bf_error *err)
{
    const struct transfer_record t = transfer_record(motion->predictor, record);
    size_t m = t.grid->m;
    double complex *Y = bf_alloc(m, sizeof *Y);
    double *y = bf_alloc(t.grid->n, sizeof *y);
    enum bf_status status = BF_OK;
    for (size_t i = 0; status == BF_OK && i < t.n_channels; i++) {
        size_t c = t.first_channel + i;
        memset(Y, 0, m * sizeof *Y);
        for (size_t j = 0; j < paths->d; j++)
            for (size_t k = 0; k < m; k++)
                Y[k] -= paths->H[c][j * m + k] * F[j * m + k];
        for (size_t k = 0; k < m; k++)
            Y[k] *= motion->chain[c][k];
        status = response_back(t.grid, Y, y, err);
        for (size_t k = 0; k < motion->channels[c].n; k++)
            rows[motion->channels[c].row + k] += y[k];
    }
    free(Y);
    free(y);
    return status;
}
