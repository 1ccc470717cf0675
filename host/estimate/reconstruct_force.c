/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A scalar force at one place of the beam: its functional, and its history from the residual. */
#include "reconstruct_force.h"

#include <math.h>
#include <stdlib.h>

enum {
    SPREAD_POINTS = 48, /* of the integral of a force spread over the beam */
    SMOOTH = 16         /* points of the Laplace line to each side over which the power is averaged */
};

static void functional_of(const struct motion *motion, const struct reconstruct_site *site, double g[])
{
    const struct reduced *reduced = transfer_reduced(motion->predictor);
    const struct model *model = transfer_model(motion->predictor);
    const struct beam_operator patch = {.kind = BEAM_AT_PATCH};
    double *work = bf_alloc(reduced->n, sizeof *work);
    switch (site->place) {
    case RECONSTRUCT_POINT:
        reduced_point(reduced, 0, site->at_m, g);
        break;
    case RECONSTRUCT_PATCH:
        reduced_place(reduced, &patch, model, g, work);
        break;
    case RECONSTRUCT_SPREAD:
        for (int q = 0; q < SPREAD_POINTS; q++) { /* ∫ φ dx */
            reduced_point(reduced, 0, model->length_m * (q + 0.5) / SPREAD_POINTS, work);
            for (size_t i = 0; i < reduced->n; i++)
                g[i] += work[i] * model->length_m / SPREAD_POINTS;
        }
        break;
    }
    free(work);
}

void site_force_new(const struct motion *motion, const struct reconstruct_site *site, struct site_force *out)
{
    *out = (struct site_force){.motion = motion};
    out->g = bf_alloc(motion->modes.dimension, sizeof(double));
    functional_of(motion, site, out->g);
    motion_paths_new(motion, out->g, 1, &out->paths);
    out->F = bf_alloc(motion->n_records, sizeof *out->F);
    out->seen = bf_alloc(motion->n_records, sizeof *out->seen);
    for (size_t r = 0; r < motion->n_records; r++) {
        out->F[r] = bf_alloc(motion->records[r].m, sizeof *out->F[r]);
        out->seen[r] = bf_alloc(motion->records[r].m, sizeof *out->seen[r]);
    }
}

void site_force_free(struct site_force *force)
{
    for (size_t r = 0; force->F != NULL && r < force->motion->n_records; r++) {
        free(force->F[r]);
        free(force->seen[r]);
    }
    free(force->F);
    free(force->seen);
    free(force->g);
    if (force->motion != NULL)
        motion_paths_free(force->motion, &force->paths);
    *force = (struct site_force){0};
}

/* Sums over the channels of a record, in units of their noise: hᴴR, |h|², |R|². */
struct products {
    double complex *hR;           /* [m] */
    double *hh, *excess, *signal; /* [m] |h|²; cumulative |hᴴR|²/|h|² − 1, and |h|² ([m + 1]) */
};

static enum bf_status add_channel(const struct site_force *force, size_t channel, const double residual[],
                                  struct products *sums, struct bf_error *err)
{
    const struct motion *motion = force->motion;
    const struct predict_channel *c = &motion->channels[channel];
    const struct response_grid *grid = transfer_record(motion->predictor, c->record).grid;
    double *x = bf_alloc(grid->n + grid->n_tail, sizeof *x), energy = 0.0;
    double complex *R = bf_alloc(grid->m, sizeof *R);
    for (size_t k = 0; k < c->n; k++)
        energy += grid->weight[k] * grid->weight[k];
    double noise = motion->sigma[channel] * sqrt(energy);
    response_tail(grid, residual + c->row, c->n, x);
    enum bf_status status = response_transform(grid, x, grid->n + grid->n_tail, R, err);
    for (size_t i = 0; status == BF_OK && i < grid->m; i++) {
        double complex h = -motion->chain[channel][i] * force->paths.H[channel][i] / noise;
        sums->hR[i] += conj(h) * R[i] / noise;
        sums->hh[i] += square(h);
    }
    free(x);
    free(R);
    return status;
}

/* F = Φ hᴴR/(1 + Φ|h|²): the part of R along h has the power 1 + Φ|h|², averaged over bands. */
static void wiener(const struct products *p, size_t m, double complex F[], double seen[])
{
    for (size_t i = 0; i < m; i++) {
        double along = p->hh[i] > 0.0 ? square(p->hR[i]) / p->hh[i] : 0.0;
        p->excess[i + 1] = p->excess[i] + along - 1.0;
        p->signal[i + 1] = p->signal[i] + p->hh[i];
    }
    for (size_t i = 0; i < m; i++) {
        size_t from = i > SMOOTH ? i - SMOOTH : 0, to = i + SMOOTH < m ? i + SMOOTH + 1 : m;
        double excess = p->excess[to] - p->excess[from], signal = p->signal[to] - p->signal[from];
        double power = excess > 0.0 && signal > 0.0 ? excess / signal : 0.0;
        F[i] = power * p->hR[i] / (1.0 + power * p->hh[i]);
        seen[i] = power * p->hh[i] / (1.0 + power * p->hh[i]);
    }
}

enum bf_status site_force_estimate(struct site_force *force, const double residual[], struct bf_error *err)
{
    const struct motion *motion = force->motion;
    enum bf_status status = BF_OK;
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++) {
        const struct transfer_record t = transfer_record(motion->predictor, r);
        size_t m = t.grid->m;
        struct products sums = {.hR = bf_alloc(m, sizeof *sums.hR)};
        sums.hh = bf_alloc(3 * m + 2, sizeof *sums.hh);
        sums.excess = sums.hh + m;
        sums.signal = sums.excess + m + 1;
        for (size_t c = t.first_channel; status == BF_OK && c < t.first_channel + t.n_channels; c++)
            if (motion->sigma[c] > 0.0)
                status = add_channel(force, c, residual, &sums, err);
        wiener(&sums, m, force->F[r], force->seen[r]);
        free(sums.hR);
        free(sums.hh);
    }
    return status;
}
