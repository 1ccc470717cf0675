/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * target_image_observer.c — the observer of lib/beam_image.h. Its model is the free motion of the plan's own blocks and an offset of the
 * sensor, each shaken as much as makes the filter take up a change within a set time; the sensor's noise is the board's.
 */
#include "deployment.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STATES = 2 * BEAM_OBSERVED + 1 };

/* A push must be taken up well before an alarm is confirmed; an offset may take longer, a slow motion looks like one. */
static const double push_share = 1.0 / 8.0, offset_share = 1.0 / 4.0, top_share = 0.45, half_scale_codes = 2048.0;

struct observed_block {
    int block;
    double complex turn; /* eigenvalue with Im > 0 of 1 + ψ */
};

/* Does it oscillate below the top of the band, where the sensor hears it? */
static bool is_observed(const struct target_image *image, int b, struct observed_block *out)
{
    const beam_real *psi = image->plan.x.phi[b], *row = &image->plan.x.row[0][2 * b];
    const double half = 0.5 * (psi[0] + psi[3]), square = psi[0] * psi[3] - psi[1] * psi[2] - half * half;
    if (!(square > 0.0) || !(fabs(psi[1]) > 0.0) || !(fabs(row[0]) + fabs(row[1]) > 0.0))
        return false;
    *out = (struct observed_block){b, CMPLX(1.0 + half, sqrt(square))};
    return carg(out->turn) < 2.0 * acos(-1.0) * top_share && cabs(out->turn) < 1.0;
}

static int by_frequency(const void *a, const void *b)
{
    const double x = carg(((const struct observed_block *)a)->turn), y = carg(((const struct observed_block *)b)->turn);
    return (x > y) - (x < y);
}

static int by_block(const void *a, const void *b)
{
    return ((const struct observed_block *)a)->block - ((const struct observed_block *)b)->block;
}

/* The lowest ones, as many as there is room for, in the order of the plan. */
static size_t choose_blocks(const struct target_image *image, struct observed_block out[BEAM_BLOCKS])
{
    size_t n = 0;
    for (int b = 0; b < image->plan.n.n_blocks - image->n_beside; b++)
        n += is_observed(image, b, &out[n]) ? 1 : 0;
    qsort(out, n, sizeof *out, by_frequency);
    n = n < BEAM_OBSERVED ? n : BEAM_OBSERVED;
    qsort(out, n, sizeof *out, by_block);
    return n;
}

/* The model of the filter, in units of the sensor's noise. */
struct filter {
    size_t n;
    double A[STATES * STATES], Q[STATES * STATES], c[STATES], P[STATES * STATES], K[STATES];
};

/*
 * One block: a complex amplitude z that turns by itself, heard as Re z; of white shaking q in each of its parts the filter makes a memory of
 * √(2/q) samples. In the block's own coordinates ε₀ = Re z, and ε₁ follows from ε₀⁺ = ε₀ + ψ₀₀ ε₀ + ψ₀₁ ε₁.
 */
static void add_block(struct filter *f, size_t at, const beam_real psi[4], double complex turn, double q)
{
    const size_t n = f->n;
    const double u = (creal(turn) - 1.0 - psi[0]) / psi[1], v = -cimag(turn) / psi[1];
    for (size_t i = 0; i < 2; i++)
        for (size_t j = 0; j < 2; j++)
            f->A[at + i + (at + j) * n] = (i == j ? 1.0 : 0.0) + psi[2 * i + j];
    f->Q[at + at * n] = q;
    f->Q[at + (at + 1) * n] = f->Q[at + 1 + at * n] = q * u;
    f->Q[at + 1 + (at + 1) * n] = q * (u * u + v * v);
    f->c[at] = 1.0;
}

static void make_filter(const struct target_image *image, size_t n_blocks, const struct observed_block blocks[],
                        struct filter *f)
{
    const double push = image->dt_s / image->observer_s,
                 offset = image->dt_s / (offset_share * image->board.averaging_s);
    *f = (struct filter){.n = 2 * n_blocks + 1};
    for (size_t i = 0; i < n_blocks; i++)
        add_block(f, 2 * i, image->plan.x.phi[blocks[i].block], blocks[i].turn, 2.0 * push * push);
    const size_t last = f->n - 1;
    f->A[last + last * f->n] = f->c[last] = 1.0;
    f->Q[last + last * f->n] = offset * offset;
}

/* After this time neither a motion that filled the sensor's range nor what it left in the running variance is above clear_ratio. */
static double disturbance_s(const struct target_image *image, size_t n_blocks, const struct observed_block blocks[])
{
    const struct model_board *b = &image->board;
    double slowest_s = 2.0 * b->averaging_s;
    for (size_t i = 0; i < n_blocks; i++)
        slowest_s = fmax(slowest_s, -image->dt_s / log(cabs(blocks[i].turn)));
    const double loudest = half_scale_codes * fabs(b->sensor_per_code) / (b->clear_ratio * b->noise_rms);
    return fmin(slowest_s * fmax(log(loudest), 1.0) + 2.0 * b->averaging_s, 1e9);
}

enum bf_status deploy_observer(struct target_image *image, struct bf_error *err)
{
    struct observed_block blocks[BEAM_BLOCKS] = {{0, 0.0}};
    struct beam_image_observer *out = &image->file.front.observer;
    const size_t n_blocks = choose_blocks(image, blocks);
    struct filter *f = bf_alloc(1, sizeof *f);
    image->n_observed = n_blocks;
    image->observer_s = push_share * image->board.averaging_s;
    make_filter(image, n_blocks, blocks, f);
    struct kalman kalman = {.covariance = f->P, .gain = f->K};
    const enum bf_status status = kalman_steady(f->n, f->A, f->c, f->Q, 1.0, &kalman, err);
    *out = (struct beam_image_observer){.gain_offset = (float)f->K[f->n - 1]};
    out->innovation_rms = (float)(image->board.noise_rms * sqrt(kalman.innovation_variance));
    out->disturbance_s = (float)disturbance_s(image, n_blocks, blocks);
    for (size_t i = 0; i < n_blocks; i++) {
        out->blocks |= 1u << blocks[i].block;
        for (size_t j = 0; j < 2; j++)
            out->gain[i][j] = (float)f->K[2 * i + j];
    }
    free(f);
    return status;
}
