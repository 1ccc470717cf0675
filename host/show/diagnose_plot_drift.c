/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_plot_drift.c — frequency and damping of the mode that drifts most with its amplitude. */
#include "compare/compare.h"
#include "diagnose_pictures.h"
#include "show.h"
#include "plot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Drift in standard errors, of frequency or damping. */
static double drift(const struct amplitude_curve *c)
{
    const double f = fabs(c->frequency_drift) / c->frequency_drift_sd,
                 zeta = fabs(c->damping_drift) / c->damping_drift_sd;
    return fmax(isfinite(f) ? f : 0.0, isfinite(zeta) ? zeta : 0.0);
}

static const struct amplitude_curve *most_drifting(const struct amplitude_curves *all)
{
    const struct amplitude_curve *most = NULL;
    for (size_t i = 0; i < all->n; i++)
        if (most == NULL || drift(&all->curves[i]) > drift(most))
            most = &all->curves[i];
    return most;
}

/* Curves of one mode in one channel, of all records; measured or predicted. Returns how many; free() *out. */
static size_t curves_of(const struct amplitude_curves *all, const struct amplitude_curve *like, bool predicted,
                        struct plot_drift_curve **out)
{
    size_t n = 0;
    *out = bf_alloc(all->n, sizeof **out);
    for (size_t i = 0; i < all->n; i++) {
        const struct amplitude_curve *c = &all->curves[i];
        if (c->mode != like->mode || strcmp(c->channel, like->channel) != 0)
            continue;
        (*out)[n] = predicted ? (struct plot_drift_curve){.n = c->n,
                                                          .amplitude = c->model_amplitude,
                                                          .frequency_Hz = c->model_frequency_Hz,
                                                          .damping = c->model_damping_ratio}
                              : (struct plot_drift_curve){.n = c->n,
                                                          .amplitude = c->amplitude,
                                                          .frequency_Hz = c->frequency_Hz,
                                                          .damping = c->damping_ratio,
                                                          .frequency_sd_Hz = c->frequency_sd_Hz,
                                                          .damping_sd = c->damping_sd};
        n++;
    }
    return n;
}

static enum bf_status draw(const struct diagnose_pictures *p, const struct amplitude_curves *before,
                           const struct amplitude_curves *after, struct bf_error *err)
{
    const struct amplitude_curve *like = most_drifting(before);
    struct plot_drift_curve *measured, *model_before, *model_after;
    char title[400];
    (void)snprintf(title, sizeof title, "Mode %zu in %s, %s", like->mode, like->channel, p->heading);
    struct plot_drift picture = {
        .directory = p->directory, .stem = "diagnose-amplitude", .title = title, .quantity = like->channel};
    picture.n_measured = curves_of(before, like, false, &measured);
    picture.n_before = curves_of(before, like, true, &model_before);
    picture.n_after = curves_of(after, like, true, &model_after);
    picture.measured = measured;
    picture.before = model_before;
    picture.after = model_after;
    const enum bf_status status = plot_drift(&picture, err);
    free(measured), free(model_before), free(model_after);
    return status;
}

enum bf_status diagnose_plot_drift(const struct diagnose_pictures *p, bool *drawn, struct bf_error *err)
{
    struct amplitude_curves before, after = {0};
    enum bf_status status = amplitude_measure(&p->before, &before, err);
    if (!status && p->best != NULL)
        status = amplitude_measure(&p->after, &after, err);
    *drawn = !status && before.n > 0;
    if (*drawn)
        status = draw(p, &before, &after, err);
    amplitude_free(&before);
    amplitude_free(&after);
    return status;
}
