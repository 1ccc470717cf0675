/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factor_time.c — a beam's lowest mode and a record's strongest line, which must be able to meet. */
#include "factor_pair.h"

#include <math.h>
#include <stdlib.h>

#include "beam/beam.h"

enum bf_status factor_lowest_mode(const struct model *model, double *frequency_Hz, struct bf_error *err)
{
    struct reduced reduced;
    const struct reduced_options options = {.top_rad = 1.0, .min_modes = 4, .max_modes = 4};
    const enum bf_status status = reduced_new(model, &options, &reduced, err);
    *frequency_Hz = 0.0;
    if (status != BF_OK)
        return status;
    for (size_t m = 0; m < reduced.n_modes && !(*frequency_Hz > 0.0); m++) /* rigid-body modes have none */
        if (reduced.frequency_rad[m] > 1e-4 * reduced.frequency_rad[reduced.n_modes - 1])
            *frequency_Hz = reduced.frequency_rad[m] / (2.0 * M_PI);
    reduced_free(&reduced);
    return BF_OK;
}

enum bf_status factor_strongest_line(const struct record *record, const double z[], double *line_Hz,
                                     struct bf_error *err)
{
    double *amplitude = bf_alloc(record->n / 2 + 1, sizeof *amplitude);
    const enum bf_status status = spectrum_amplitude(z, record->n, WINDOW_HANN, amplitude, err);
    size_t best = 1;
    for (size_t k = 2; k <= record->n / 2 && !status; k++)
        best = amplitude[k] > amplitude[best] ? k : best;
    free(amplitude);
    *line_Hz = (double)best / ((double)record->n * record->dt_s);
    return status;
}
