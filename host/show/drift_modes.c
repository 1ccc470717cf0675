/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "drift_modes.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct plot_drift_curve view(const struct amplitude_curve *c, bool predicted)
{
    if (predicted)
        return (struct plot_drift_curve){.n = c->n,
                                         .t_s = c->t_s,
                                         .amplitude = c->model_amplitude,
                                         .frequency_Hz = c->model_frequency_Hz,
                                         .damping = c->model_damping_ratio};
    return (struct plot_drift_curve){.n = c->n,
                                     .t_s = c->t_s,
                                     .amplitude = c->amplitude,
                                     .frequency_Hz = c->frequency_Hz,
                                     .damping = c->damping_ratio,
                                     .frequency_sd_Hz = c->frequency_sd_Hz,
                                     .damping_sd = c->damping_sd,
                                     .amplitude_sd = c->amplitude_sd};
}

/* Curves of that mode, channel and record, to `to`, measured or predicted; how many. first: one of them. */
static size_t curves_of(const struct amplitude_curves *all, const char *channel, size_t record, size_t mode,
                        bool predicted, struct plot_drift_curve *to, const struct amplitude_curve **first)
{
    size_t n = 0;
    for (size_t i = 0; i < all->n; i++) {
        const struct amplitude_curve *c = &all->curves[i];
        if (c->mode != mode || strcmp(c->channel, channel) != 0 || (record != SIZE_MAX && c->record != record))
            continue;
        to[n++] = view(c, predicted);
        *first = c;
    }
    return n;
}

void drift_modes_make(const struct amplitude_curves *curves, const struct amplitude_curves *after, const char *channel,
                      size_t record, size_t also, struct drift_modes *out)
{
    size_t mode[PLOT_DRIFT_MODES];
    *out = (struct drift_modes){.n = amplitude_dominant(curves, channel, record, also, mode, PLOT_DRIFT_MODES)};
    out->curves = bf_alloc(2 * curves->n + (after != NULL ? after->n : 0) + 1, sizeof *out->curves);
    struct plot_drift_curve *to = out->curves;
    const struct amplitude_curve *one = NULL;
    for (size_t m = 0; m < out->n; m++) {
        struct plot_drift_mode *column = &out->modes[m];
        column->after = to;
        if (after != NULL)
            to += column->n_after = curves_of(after, channel, record, mode[m], true, to, &one);
        struct plot_drift_curve *model = to;
        const size_t n_model = curves_of(curves, channel, record, mode[m], true, to, &one);
        to += n_model;
        column->before = model;
        *(after != NULL ? &column->n_before : &column->n_after) = n_model;
        column->measured = to;
        to += column->n_measured = curves_of(curves, channel, record, mode[m], false, to, &one);
        (void)snprintf(out->title[m], sizeof out->title[m], "Mode %zu, %.4g Hz", mode[m],
                       one != NULL ? one->frequency_Hz[0] : 0.0);
        column->title = out->title[m];
    }
}

void drift_modes_free(struct drift_modes *modes)
{
    free(modes->curves);
    *modes = (struct drift_modes){0};
}
