/* SPDX-License-Identifier: GPL-3.0-or-later */
/* noise_join.c — estimates of noise that are there: copied, joined, asked for a band, freed. */
#include "noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

void noise_free(struct noise_estimate *estimate)
{
    free(estimate->psd), free(estimate->crowding);
    *estimate = (struct noise_estimate){0};
}

double noise_doubt(const struct noise_estimate *estimate)
{
    return estimate->rms > 0.0 ? 2.0 * estimate->rms_sd / estimate->rms : 1.0;
}

double noise_ratio_doubt(const double doubt[], const size_t record[], size_t n)
{
    double square = 0.0;
    for (size_t c = 0; c < n; c++)
        for (size_t other = 0; other < n; other++)
            square += record[other] == record[c] ? doubt[c] * doubt[other] : 0.0;
    return n > 0 ? sqrt(square) / (double)n : 0.0;
}

static double *copy_of(const double x[], size_t n)
{
    double *copy = x != NULL ? bf_alloc(n, sizeof *copy) : NULL;
    if (x != NULL)
        memcpy(copy, x, n * sizeof *copy);
    return copy;
}

struct noise_estimate noise_copy(const struct noise_estimate *estimate)
{
    struct noise_estimate copy = *estimate;
    copy.psd = copy_of(estimate->psd, estimate->n_bins);
    copy.crowding = copy_of(estimate->crowding, estimate->n_bins);
    return copy;
}

void noise_join(struct noise_estimate *sum, const struct noise_estimate *more)
{
    const double a = (double)sum->n_used, b = (double)more->n_used;
    if (more->method == NOISE_NONE || !(b > 0.0))
        return;
    if (sum->method == NOISE_NONE) {
        *sum = noise_copy(more);
        return;
    }
    const double old = sum->rms, square = (a * old * old + b * more->rms * more->rms) / (a + b);
    sum->rms_sd = hypot(a * old * sum->rms_sd, b * more->rms * more->rms_sd) / ((a + b) * sqrt(square));
    sum->rms = sqrt(square);
    sum->used_share = (a * sum->used_share + b * more->used_share) / (a + b);
    sum->quantisation = fmax(sum->quantisation, more->quantisation);
    sum->n_used += more->n_used;
    double power = 0.0;
    for (size_t k = 0; k < sum->n_bins; k++) {
        const double f = (double)k * sum->df_Hz, half = 0.5 * sum->df_Hz;
        sum->psd[k] = a * sum->psd[k] + b * noise_power(more, f - half, f + half) / sum->df_Hz;
        power += sum->psd[k] * sum->df_Hz;
    }
    for (size_t k = 0; k < sum->n_bins; k++)
        sum->psd[k] *= square / power;
    free(sum->crowding); /* of stretches, each with an amplitude of its own: the sum's is more even */
    sum->crowding = NULL;
}

/* Of bin k, which stands for half a bin to either side, what lies between two frequencies, Hz. */
static double width_of(const struct noise_estimate *noise, size_t k, double from_Hz, double to_Hz)
{
    const double low = fmax(from_Hz, ((double)k - 0.5) * noise->df_Hz);
    const double high = fmin(to_Hz, ((double)k + 0.5) * noise->df_Hz);
    return fmax(high - low, 0.0);
}

double noise_power(const struct noise_estimate *noise, double from_Hz, double to_Hz)
{
    double sum = 0.0;
    for (size_t k = 0; k < noise->n_bins; k++)
        sum += noise->psd[k] * width_of(noise, k, from_Hz, to_Hz);
    return sum;
}

double noise_bins(const struct noise_estimate *noise, double from_Hz, double to_Hz, double length_s)
{
    double sum = 0.0, square = 0.0;
    for (size_t k = 0; k < noise->n_bins && noise->crowding != NULL; k++) {
        const double width = width_of(noise, k, from_Hz, to_Hz);
        sum += noise->psd[k] * width;
        square += noise->crowding[k] * noise->psd[k] * noise->psd[k] * width;
    }
    return fmax(1.0, length_s * (square > 0.0 ? sum * sum / square : to_Hz - from_Hz));
}
