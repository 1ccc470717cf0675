/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_input.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* Noise over the peak of an input: above, the input never rests; below, its noise is that of a number written in a file. */
static const double rests = 0.1, seen = 1e-6;
static const double median_of_normal = 0.6744897501960817; /* median of |x|, unit variance */

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median_of(double *x, size_t n)
{
    qsort(x, n, sizeof *x, ascending);
    return n % 2 == 1 ? x[n / 2] : 0.5 * (x[n / 2 - 1] + x[n / 2]);
}

/* Rms of the noise of an input that rests most of the time; 0: none that can be told. */
static double resting_noise(const double *u, size_t n)
{
    double *copy = bf_alloc(n, sizeof *copy), peak = 0.0;
    memcpy(copy, u, n * sizeof *copy);
    const double middle = median_of(copy, n);
    for (size_t i = 0; i < n; i++) {
        copy[i] = fabs(u[i] - middle);
        peak = fmax(peak, copy[i]);
    }
    const double noise = median_of(copy, n) / median_of_normal;
    free(copy);
    return noise > seen * peak && noise < rests * peak ? noise : 0.0;
}

/* psd[n_bins] at 0, df, 2 df …: one-sided, each the mean over the periodogram's bins that are nearest to it. */
static enum bf_status periodogram(const double *x, size_t n, double dt_s, double df_Hz, size_t n_bins, double psd[],
                                  struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(n, &plan, err);
    if (status)
        return status;
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    double *count = bf_alloc(n_bins, sizeof *count);
    fft_forward(plan, x, X);
    for (size_t k = 0; k < n_bins; k++)
        psd[k] = 0.0;
    for (size_t k = 1; k <= n / 2; k++) {
        const size_t bin = (size_t)lround((double)k / ((double)n * dt_s) / df_Hz);
        if (bin >= n_bins)
            continue;
        psd[bin] += 2.0 * dt_s / (double)n * (creal(X[k]) * creal(X[k]) + cimag(X[k]) * cimag(X[k]));
        count[bin] += 1.0;
    }
    for (size_t k = 0; k < n_bins; k++)
        psd[k] = count[k] > 0.0 ? psd[k] / count[k] : k > 0 ? psd[k - 1] : 0.0;
    free(X), free(count);
    return BF_OK;
}

static enum bf_status add_input(const double *u, double noise, size_t n, double dt_s, const double output[],
                                struct noise_estimate *estimate, struct bf_error *err)
{
    double *input = bf_alloc(estimate->n_bins, sizeof *input);
    const enum bf_status status = periodogram(u, n, dt_s, estimate->df_Hz, estimate->n_bins, input, err);
    for (size_t k = 0; k < estimate->n_bins && !status; k++) {
        const double share = input[k] > 0.0 ? fmin(2.0 * dt_s * noise * noise / input[k], 1.0) : 0.0;
        estimate->psd[k] += share * fmax(output[k] - estimate->psd[k], 0.0);
    }
    free(input);
    return status;
}

enum bf_status noise_add_inputs(const double *z, const double *const u[], size_t n_inputs, size_t n, double dt_s,
                                struct noise_estimate *estimate, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    double *output = NULL, before = 0.0, after = 0.0;
    for (size_t k = 0; k < estimate->n_bins; k++)
        before += estimate->psd[k];
    for (size_t i = 0; i < n_inputs && before > 0.0 && !status; i++) {
        const double noise = resting_noise(u[i], n);
        if (!(noise > 0.0))
            continue;
        if (output == NULL) {
            output = bf_alloc(estimate->n_bins, sizeof *output);
            status = periodogram(z, n, dt_s, estimate->df_Hz, estimate->n_bins, output, err);
        }
        if (!status)
            status = add_input(u[i], noise, n, dt_s, output, estimate, err);
    }
    for (size_t k = 0; k < estimate->n_bins && output != NULL; k++)
        after += estimate->psd[k];
    if (output != NULL && !status && after > before) {
        estimate->rms *= sqrt(after / before);
        estimate->rms_sd *= sqrt(after / before);
    }
    free(output);
    return status;
}
