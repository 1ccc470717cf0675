/* SPDX-License-Identifier: GPL-3.0-or-later */
/* noise_carried.c — what the noise of measured inputs makes of an output. */
#include "noise_input.h"

#include <math.h>
#include <stdlib.h>

#include "ground/ground.h"

double noise_rms_of(const struct noise_channel_input *input, size_t n)
{
    return input->cells != NULL ? input->cells->rms : noise_of_input(input->u, n);
}

/* ---- The noise in the record's own bins ---- */

/* What is known of a channel while inputs are added: powers of the record's own spectrum, and the densities that are carried. */
struct carried {
    size_t n; /* samples */
    double dt_s;
    const struct noise_estimate *estimate;
    double *Y;       /* [n/2 + 1] |output|² */
    double *density; /* [n/2 + 1] one-sided, carried by all inputs */
    double *
        square; /* [n/2 + 1] its square over the part of the time in which the noise is there: shorter noise has fewer amplitudes */
};

/* Of the estimate's bins the one that bin k is in; n_bins: none. */
static size_t bin_of(const struct carried *c, size_t k)
{
    const size_t bin = (size_t)lround((double)k / ((double)c->n * c->dt_s) / c->estimate->df_Hz);
    return bin < c->estimate->n_bins ? bin : c->estimate->n_bins;
}

/* Bins k from *from to the next bin of the estimate; false: there are none. */
static bool next_group(const struct carried *c, size_t *from, size_t *to)
{
    *from = *to;
    while (*to <= c->n / 2 && bin_of(c, *to) == bin_of(c, *from))
        (*to)++;
    return *from <= c->n / 2 && bin_of(c, *from) < c->estimate->n_bins;
}

/* One-sided density of the output above its own noise, mean over a group. */
static double answer_in(const struct carried *c, size_t from, size_t to)
{
    double Y = 0.0;
    for (size_t k = from; k < to; k++)
        Y += 2.0 * c->dt_s / (double)c->n * c->Y[k] / (double)(to - from);
    return fmax(Y - c->estimate->psd[bin_of(c, from)], 0.0);
}

static double kept_at(const struct carried *c, const struct noise_channel_input *input, size_t k)
{
    return input->cells != NULL ? input_noise_kept(input->cells, 2.0 * (double)k / (double)c->n) : 1.0;
}

static void add_bin(const struct carried *c, size_t k, double density, double kept)
{
    c->density[k] += density;
    c->square[k] += kept > 0.0 ? density * density / kept : 0.0;
}

/* σ² |H|², never more than the output has. */
static void add_gain(const struct carried *c, const struct noise_channel_input *input, double rms, size_t from,
                     size_t to)
{
    const double white = 2.0 * c->dt_s * rms * rms;
    double mean = 0.0;
    for (size_t k = from; k < to; k++)
        mean += white * input->gain[k] / (double)(to - from);
    const double part = mean > 0.0 ? fmin(1.0, answer_in(c, from, to) / mean) : 0.0;
    for (size_t k = from; k < to; k++)
        add_bin(c, k, part * white * input->gain[k], kept_at(c, input, k));
}

/* The part S_u/P_u of the output's power above its own noise, taken to be behind one resonance. */
static void add_part(const struct carried *c, const struct noise_channel_input *input, const double U[], double rms,
                     size_t from, size_t to)
{
    const double count = (double)(to - from), kept = kept_at(c, input, from);
    double sum = 0.0;
    size_t peak = from;
    for (size_t k = from; k < to; k++) {
        sum += U[k];
        peak = c->Y[k] > c->Y[peak] ? k : peak;
    }
    if (sum > 0.0)
        add_bin(c, peak, count * fmin(kept * (double)c->n * rms * rms * count / sum, 1.0) * answer_in(c, from, to),
                kept);
}

static enum bf_status add_input(const struct carried *c, const struct noise_channel_input *input, struct bf_error *err)
{
    const double rms = noise_rms_of(input, c->n);
    if (!(rms > 0.0))
        return BF_OK;
    double *U = bf_alloc(c->n / 2 + 1, sizeof *U);
    const enum bf_status status = spectrum_power(input->u, c->n, U, err);
    for (size_t from, to = 1; !status && next_group(c, &from, &to);) {
        if (input->gain != NULL)
            add_gain(c, input, rms, from, to);
        else
            add_part(c, input, U, rms, from, to);
    }
    free(U);
    return status;
}

/*
 * Behind a resonance noise is one amplitude and one phase, whatever the length of the record: the power in N bins of the record's own is known to √(1/N), the rms
 * to half of that.
 */
static void take(const struct carried *c, struct noise_estimate *estimate)
{
    double before = 0.0, sum = 0.0, square = 0.0;
    double *crowding = bf_alloc(estimate->n_bins, sizeof *crowding);
    for (size_t b = 0; b < estimate->n_bins; b++) {
        before += estimate->psd[b] * estimate->df_Hz;
        crowding[b] = 1.0;
    }
    for (size_t from, to = 1; next_group(c, &from, &to);) {
        const size_t b = bin_of(c, from);
        const double own = estimate->psd[b], count = (double)(to - from), df_Hz = 1.0 / ((double)c->n * c->dt_s);
        double added = 0.0, added_square = 0.0;
        for (size_t k = from; k < to; k++)
            added += c->density[k], added_square += c->square[k];
        added_square = fmin(added_square, added * added);
        sum += added * df_Hz, square += added_square * df_Hz * df_Hz;
        const double mean = own + added / count;
        estimate->psd[b] = mean;
        crowding[b] = mean > 0.0 ? (own * own + (2.0 * own * added + added_square) / count) / (mean * mean) : 1.0;
    }
    if (sum > 0.0 && before > 0.0) {
        const double share = sum / (before + sum), grown = sqrt((before + sum) / before);
        estimate->rms *= grown;
        estimate->rms_sd = hypot(estimate->rms_sd * grown, 0.5 * sqrt(square) / sum * share * estimate->rms);
        estimate->crowding = crowding;
    } else {
        free(crowding);
    }
}

enum bf_status noise_add_inputs(const double *z, const struct noise_channel_input inputs[], size_t n_inputs, size_t n,
                                double dt_s, struct noise_estimate *estimate, struct bf_error *err)
{
    if (n_inputs == 0 || estimate->method == NOISE_NONE)
        return BF_OK;
    const size_t m = n / 2 + 1;
    struct carried c = {.n = n,
                        .dt_s = dt_s,
                        .estimate = estimate,
                        .Y = bf_alloc(m, sizeof(double)),
                        .density = bf_alloc(m, sizeof(double)),
                        .square = bf_alloc(m, sizeof(double))};
    enum bf_status status = spectrum_power(z, n, c.Y, err);
    for (size_t i = 0; i < n_inputs && !status; i++)
        status = add_input(&c, &inputs[i], err);
    if (!status)
        take(&c, estimate);
    free(c.Y), free(c.density), free(c.square);
    return status;
}
