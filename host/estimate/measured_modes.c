/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* All that is set by hand. */
static const struct mode_limits {
    double in_band; /* of the Nyquist frequency: above it a pole stands for what lies beyond */
    double damping; /* ratio: above, it is no mode */
    double decay;   /* nats within the longest record: what decays less is a tone that something drives */
    double counts;  /* times the floor: without a pole that counts the free linear model leaves more */
} limits = {.in_band = 0.8, .damping = 0.3, .decay = 0.1, .counts = 1.1};

struct span {
    double nyquist_Hz, longest_s;
};

static struct span span_of(const struct record records[], size_t n_records)
{
    struct span span = {0};
    for (size_t r = 0; r < n_records; r++) {
        span.nyquist_Hz = fmax(span.nyquist_Hz, 0.5 / records[r].dt_s);
        span.longest_s = fmax(span.longest_s, (double)records[r].n * records[r].dt_s);
    }
    return span;
}

static bool counts(const struct attainable *a, const struct attainable_pole *pole, const struct span *span)
{
    return pole->frequency_Hz < limits.in_band * span->nyquist_Hz && pole->damping_ratio < limits.damping &&
           pole->damping_ratio * 2.0 * M_PI * pole->frequency_Hz * span->longest_s > limits.decay &&
           !(pole->without_noise_ratio < limits.counts * a->noise_ratio);
}

struct measured_modes measured_modes_of(const struct attainable *a, const struct record records[], size_t n_records)
{
    const size_t n_paths = a->n_outputs * a->n_inputs;
    const struct span span = span_of(records, n_records);
    struct measured_modes modes = {.n_outputs = a->n_outputs,
                                   .n_inputs = a->n_inputs,
                                   .pole = bf_alloc(a->modes + 1, sizeof *modes.pole),
                                   .residue = bf_alloc(a->modes * n_paths + 1, sizeof *modes.residue)};
    for (size_t k = 0; k < a->modes; k++) {
        const struct attainable_pole *pole = &a->poles[k];
        if (!counts(a, pole, &span))
            continue;
        const double size = 2.0 * M_PI * pole->frequency_Hz, damping = pole->damping_ratio;
        memcpy(modes.residue + modes.n * n_paths, a->residue + k * n_paths, n_paths * sizeof *modes.residue);
        modes.pole[modes.n++] = CMPLX(-damping * size, sqrt(1.0 - damping * damping) * size);
    }
    return modes;
}

void measured_modes_free(struct measured_modes *modes)
{
    free(modes->pole), free(modes->residue);
    *modes = (struct measured_modes){0};
}
