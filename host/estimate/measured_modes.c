/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const struct beam_mode_limits beam_mode_limits = {.in_band = 0.8, .damping = 0.3, .decay = 0.1, .counts = 1.1};

bool beam_mode_decays(double frequency_Hz, double damping_ratio, double longest_s)
{
    return damping_ratio * 2.0 * M_PI * frequency_Hz * longest_s > beam_mode_limits.decay;
}

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
    return pole->frequency_Hz < beam_mode_limits.in_band * span->nyquist_Hz &&
           pole->damping_ratio < beam_mode_limits.damping &&
           beam_mode_decays(pole->frequency_Hz, pole->damping_ratio, span->longest_s) &&
           !(pole->without_noise_ratio < beam_mode_limits.counts * a->noise_ratio);
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

double measured_modes_weight(const struct measured_modes *modes, const struct model *model, size_t mode, size_t path)
{
    return pow(cabs(modes->pole[mode]), 1.0 - output_order(model->outputs[path / modes->n_inputs].kind));
}
