/* SPDX-License-Identifier: GPL-3.0-or-later */
/* −H (∂A/∂θ_j) x̂: the predictor's Jacobian is that of the predicted motion; here the deviation's part is added. */
#include "estimate.h"
#include "motion.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "motion_modes.h"

struct change {
    double *D[3]; /* [n × n] of s², s, 1, in modes */
    bool used[3];
};

static bool any(size_t count, const double x[])
{
    for (size_t i = 0; i < count; i++)
        if (x[i] < 0.0 || x[i] > 0.0)
            return true;
    return false;
}

/* a[n][m] = G Σ_l (s² D0 + s D1 + D2)_kl q_l. */
static void modal_forces(const struct motion *motion, const struct response_grid *grid, const struct change *change,
                         const double complex G[], const double complex q[], double complex a[])
{
    size_t n = motion->modes.n, m = grid->m;
    memset(a, 0, n * m * sizeof *a);
    for (int power = 0; power < 3; power++) { /* Horner: from s² down */
        for (size_t k = 0; k < n; k++) {
            double complex *row = a + k * m;
            for (size_t i = 0; power > 0 && i < m; i++)
                row[i] *= grid->s[i];
            for (size_t l = 0; change->used[power] && l < n; l++) {
                double d = change->D[power][k + l * n];
                const double complex *x = q + l * m;
                for (size_t i = 0; i < m; i++)
                    row[i] += d * x[i];
            }
        }
    }
    for (size_t i = 0; i < n * m; i++)
        a[i] *= G[i];
}

/* row −= chain s^ν Σ_k ψ_k(o) a_k in the time domain. */
static enum bf_status add_channel(const struct motion *motion, size_t channel, const struct response_grid *grid,
                                  const double complex a[], double column[], struct bf_error *err)
{
    const struct predict_channel *c = &motion->channels[channel];
    size_t m = grid->m;
    int order;
    const double *g = transfer_output_functional(motion->predictor, c->output, &order);
    double complex *Y = bf_alloc(m, sizeof *Y);
    double *y = bf_alloc(c->n, sizeof *y);
    for (size_t k = 0; k < motion->modes.n; k++) {
        double shape = motion_shape(&motion->modes, k, g);
        for (size_t i = 0; i < m; i++)
            Y[i] += shape * a[k * m + i];
    }
    for (size_t i = 0; i < m; i++) {
        for (int o = 0; o < order; o++)
            Y[i] *= grid->s[i];
        Y[i] *= motion->chain[channel][i];
    }
    enum bf_status status = response_back(grid, Y, y, err);
    for (size_t k = 0; status == BF_OK && k < c->n; k++)
        column[c->row + k] -= y[k];
    free(Y);
    free(y);
    return status;
}

static enum bf_status add_record(const struct motion *motion, size_t record, const struct change *change,
                                 double column[], struct bf_error *err)
{
    const struct transfer_record t = transfer_record(motion->predictor, record);
    size_t count = motion->modes.n * t.grid->m;
    double complex *G = bf_alloc(2 * count, sizeof *G), *a = G + count;
    motion_resonances(&motion->modes, t.grid, G);
    modal_forces(motion, t.grid, change, G, motion->records[record].q, a);
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < t.n_channels; c++)
        status = add_channel(motion, t.first_channel + c, t.grid, a, column, err);
    free(G);
    return status;
}

/* A gain multiplies what was measured: d(gain · x)/d gain = z/gain. */
static void add_gain(const struct motion *motion, size_t parameter, double column[])
{
    double gain = motion->theta[parameter];
    for (size_t c = 0; c < motion->n_channels; c++) {
        const struct predict_channel *channel = &motion->channels[c];
        if (transfer_gain_parameter(motion->predictor, c) != parameter || !(gain > 0.0 || gain < 0.0))
            continue;
        for (size_t k = channel->row; k < channel->row + channel->n; k++)
            column[k] += motion->residual[k] / gain;
    }
}

enum bf_status motion_update_jacobian(struct motion *motion, struct bf_error *err)
{
    size_t n = motion->modes.n, rows = motion->n_rows;
    if (motion->jacobian == NULL)
        motion->jacobian = bf_alloc(motion->n_parameters * rows, sizeof(double));
    double *D = bf_alloc(3 * n * n, sizeof *D);
    struct change change = {.D = {D, D + n * n, D + 2 * n * n}};
    enum bf_status status = BF_OK;
    for (size_t j = 0; status == BF_OK && j < motion->n_parameters; j++) {
        double *column = motion->jacobian + j * rows;
        if (!motion->free[j])
            continue;
        memcpy(column, motion->predicted + j * rows, rows * sizeof *column);
        add_gain(motion, j, column);
        if (!transfer_stiffness_change(motion->predictor, &motion->modes, j, change.D))
            continue;
        for (int k = 0; k < 3; k++)
            change.used[k] = any(n * n, change.D[k]);
        for (size_t r = 0; status == BF_OK && r < motion->n_records; r++)
            status = add_record(motion, r, &change, column, err);
    }
    free(D);
    return status;
}
