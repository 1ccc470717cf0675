/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_plot_drift.c — the decay of the modes that dominate the channel in which one drifts most with its amplitude. */
#include "compare/compare.h"
#include "diagnose_pictures.h"
#include "drift_modes.h"
#include "show.h"
#include "plot.h"

#include <math.h>
#include <stdint.h>
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

static enum bf_status draw(const struct diagnose_pictures *p, const struct amplitude_curves *before,
                           const struct amplitude_curves *after, struct bf_error *err)
{
    const struct amplitude_curve *like = most_drifting(before);
    struct drift_modes modes;
    char title[400];
    (void)snprintf(title, sizeof title, "%s, %s", like->channel, p->heading);
    drift_modes_make(before, p->best != NULL ? after : NULL, like->channel, SIZE_MAX, like->mode, &modes);
    const struct plot_drift picture = {.directory = p->directory,
                                       .stem = "diagnose-amplitude",
                                       .title = title,
                                       .quantity = like->channel,
                                       .n_modes = modes.n,
                                       .modes = modes.modes};
    const enum bf_status status = plot_drift(&picture, err);
    drift_modes_free(&modes);
    return status;
}

static void say_that_none_decays(const struct amplitude_curves *curves)
{
    bf_warn("no picture of a decay: %s",
            curves->n_records > 0 ? amplitude_no_decay(curves, 0) : "there is no sampled record");
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
    else if (!status)
        say_that_none_decays(&before);
    amplitude_free(&before);
    amplitude_free(&after);
    return status;
}
