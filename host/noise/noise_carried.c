/* SPDX-License-Identifier: GPL-3.0-or-later */
/* noise_carried.c — what the noise of measured inputs makes of an output. */
#include "noise_input.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

#include "ground/ground.h"

/* |X|²[n/2 + 1] */
static enum bf_status powers(const double *x, size_t n, double **out, struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(n, &plan, err);
    *out = NULL;
    if (status)
        return status;
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    *out = bf_alloc(n / 2 + 1, sizeof **out);
    fft_forward(plan, x, X);
    for (size_t k = 0; k <= n / 2; k++)
        (*out)[k] = creal(X[k]) * creal(X[k]) + cimag(X[k]) * cimag(X[k]);
    free(X);
    return BF_OK;
}

double noise_rms_of(const struct noise_channel_input *input, size_t n)
{
    return input->cells != NULL ? input->cells->rms : noise_of_input(input->u, n);
}

/* ---- The noise in the bins of an estimate ---- */

/* Sums over the bins of the record's spectrum in each of the estimate's. */
struct bins {
    double *count, *Y, *U, *carried; /* [n_bins]: |output|², |input|² and σ² |H|² */
};

static struct bins bins_new(size_t n_bins)
{
    return (struct bins){.count = bf_alloc(n_bins, sizeof(double)),
                         .Y = bf_alloc(n_bins, sizeof(double)),
                         .U = bf_alloc(n_bins, sizeof(double)),
                         .carried = bf_alloc(n_bins, sizeof(double))};
}

static void bins_free(struct bins *b)
{
    free(b->count), free(b->Y), free(b->U), free(b->carried);
}

static void fill_bins(const struct noise_channel_input *input, double rms, size_t n, double dt_s, const double Y[],
                      const double U[], const struct noise_estimate *estimate, struct bins *b)
{
    for (size_t k = 1; k <= n / 2; k++) {
        const size_t bin = (size_t)lround((double)k / ((double)n * dt_s) / estimate->df_Hz);
        if (bin >= estimate->n_bins)
            continue;
        b->count[bin] += 1.0, b->Y[bin] += Y[k], b->U[bin] += U[k];
        if (input->gain != NULL)
            b->carried[bin] += rms * rms * input->gain[k];
    }
}

/* added[n_bins], one-sided densities: σ² |H|² where |H|² is known, and S_u/P_u of the output's power above its own noise; never more than all of it. */
static void add_bins(const struct noise_channel_input *input, double rms, size_t n, double dt_s,
                     const struct noise_estimate *estimate, const struct bins *b, double added[])
{
    const size_t last = estimate->n_bins - 1;
    for (size_t i = 0; i <= last; i++) {
        if (!(b->count[i] > 0.0))
            continue;
        const double Y = 2.0 * dt_s / (double)n * b->Y[i] / b->count[i], answer = fmax(Y - estimate->psd[i], 0.0);
        const double kept = input->cells != NULL ? input_noise_kept(input->cells, (double)i / (double)last) : 1.0;
        if (input->gain != NULL)
            added[i] += fmin(2.0 * dt_s * b->carried[i] / b->count[i], answer);
        else if (b->U[i] > 0.0)
            added[i] += fmin(kept * (double)n * rms * rms * b->count[i] / b->U[i], 1.0) * answer;
    }
}

static enum bf_status add_input(const struct noise_channel_input *input, size_t n, double dt_s, const double Y[],
                                const struct noise_estimate *estimate, double added[], struct bf_error *err)
{
    const double rms = noise_rms_of(input, n);
    double *U;
    if (!(rms > 0.0))
        return BF_OK;
    const enum bf_status status = powers(input->u, n, &U, err);
    if (!status) {
        struct bins b = bins_new(estimate->n_bins);
        fill_bins(input, rms, n, dt_s, Y, U, estimate, &b);
        add_bins(input, rms, n, dt_s, estimate, &b, added);
        bins_free(&b);
    }
    free(U);
    return status;
}

/*
 * Behind a resonance noise is one amplitude and one phase, whatever the length of the record: where the power is in N bins, it is known to √(1/N), the rms to half
 * of that.
 */
static void take(struct noise_estimate *estimate, const double added[])
{
    double before = 0.0, sum = 0.0, square = 0.0;
    for (size_t k = 0; k < estimate->n_bins; k++) {
        before += estimate->psd[k];
        estimate->psd[k] += added[k];
        sum += added[k], square += added[k] * added[k];
    }
    if (!(sum > 0.0) || !(before > 0.0))
        return;
    const double grown = sqrt((before + sum) / before), share = sum / (before + sum);
    estimate->rms *= grown;
    estimate->rms_sd = hypot(estimate->rms_sd * grown, 0.5 * sqrt(square) / sum * share * estimate->rms);
}

enum bf_status noise_add_inputs(const double *z, const struct noise_channel_input inputs[], size_t n_inputs, size_t n,
                                double dt_s, struct noise_estimate *estimate, struct bf_error *err)
{
    if (n_inputs == 0 || estimate->method == NOISE_NONE)
        return BF_OK;
    double *Y, *added = bf_alloc(estimate->n_bins + 1, sizeof *added);
    enum bf_status status = powers(z, n, &Y, err);
    for (size_t i = 0; i < n_inputs && !status; i++)
        status = add_input(&inputs[i], n, dt_s, Y, estimate, added, err);
    if (!status)
        take(estimate, added);
    free(Y), free(added);
    return status;
}
