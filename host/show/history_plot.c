/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The errors of a chain of models as a picture. */
#include "compare/compare.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"
#include "show.h"
#include "plot.h"

/* Error that a perfect model would have: root mean square over channels, as nrmse is. 0: the noise is not known. */
static double noise_floor(const struct fit_info *fit, bool held_out)
{
    double sum = 0.0;
    size_t n = 0;
    for (size_t r = 0; r < fit->n_records; r++)
        for (size_t c = 0; c < fit->records[r].n_channels && fit->records[r].held_out == held_out; c++) {
            const struct fit_channel *channel = &fit->records[r].channels[c];
            if (!(channel->nrmse > 0.0 && channel->noise_ratio > 0.0))
                continue;
            sum += (channel->nrmse / channel->noise_ratio) * (channel->nrmse / channel->noise_ratio);
            n++;
        }
    return n > 0 ? sqrt(sum / (double)n) : 0.0;
}

enum bf_status history_plot(const struct history *h, const char *directory, struct bf_error *err)
{
    const char **label = bf_alloc((size_t)h->n, sizeof *label);
    double *fitted = bf_alloc((size_t)h->n, sizeof *fitted), *held_out = bf_alloc((size_t)h->n, sizeof *held_out);
    double floor = 0.0, held_out_floor = 0.0; /* of the newest fit */
    size_t n = 0;
    for (int i = 0; i < h->n; i++) {
        const struct history_entry *e = &h->entries[h->order[i]];
        const struct fit_info *fit = &e->model.fit;
        if (!fit->present)
            continue;
        label[n] = text_base_name(e->file);
        fitted[n] = history_error(fit->nrmse);
        held_out[n++] = history_error(fit->check_nrmse);
        floor = noise_floor(fit, false) > 0.0 ? noise_floor(fit, false) : floor;
        held_out_floor = noise_floor(fit, true) > 0.0 ? noise_floor(fit, true) : held_out_floor;
    }
    enum bf_status status = BF_OK;
    if (n == 0) {
        status = bf_fail(err, BF_USAGE, "none of the models was fitted, so there is no error to draw");
    } else {
        const struct plot_history plot = {.directory = directory,
                                          .stem = "history",
                                          .title = "Error against model",
                                          .n = n,
                                          .label = label,
                                          .fitted = fitted,
                                          .held_out = held_out,
                                          .noise_floor = floor,
                                          .held_out_floor = held_out_floor};
        status = plot_history(&plot, err);
    }
    free(label);
    free(fitted);
    free(held_out);
    return status;
}
