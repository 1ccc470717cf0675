/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_plot_free.c — the pictures of a comparison that show what no model made: decays, and poles of free linear models. */
#include "compare_plot.h"
#include "drift_modes.h"
#include "plot.h"
#include "plot_gnuplot.h"

#include <stdio.h>
#include <stdlib.h>

enum bf_status compare_plot_amplitude(const struct comparison *all, const struct amplitude_curves *curves,
                                      const char *directory, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < all->n_channels && status == BF_OK; i++) {
        const struct comparison_channel *c = &all->channels[i];
        struct drift_modes modes;
        char stem[PLOT_STEM + 16], title[120];
        compare_amplitude_stem(all->records, c->record, c->name, stem);
        plot_forget(directory, stem);
        drift_modes_make(curves, NULL, c->name, c->record, 0, &modes);
        (void)snprintf(title, sizeof title, "%.60s: decay where nothing drives", c->name);
        const struct plot_drift picture = {.directory = directory,
                                           .stem = stem,
                                           .title = title,
                                           .note = record_base_name(&all->records[c->record]),
                                           .quantity = c->name,
                                           .n_modes = modes.n,
                                           .modes = modes.modes};
        if (modes.n > 0)
            status = plot_drift(&picture, err);
        drift_modes_free(&modes);
    }
    return status;
}

enum bf_status compare_plot_stabilisation(const struct comparison *all, const struct stabilisation *found,
                                          const char *directory, struct bf_error *err)
{
    char title[160];
    const size_t n = all->n_records - all->n_held_out;
    plot_forget(directory, COMPARE_STABILISATION);
    if (found->modes == 0)
        return BF_OK;
    (void)snprintf(title, sizeof title,
                   "Poles of free linear models, %zu %s; stable: frequency within 1 %%, damping within 5 %%", n,
                   n == 1 ? "record" : "records");
    const struct plot_stabilisation diagram = {.directory = directory,
                                               .stem = COMPARE_STABILISATION,
                                               .title = title,
                                               .found = found,
                                               .n_modes = all->n_modes,
                                               .mode_Hz = all->frequency_Hz};
    return plot_stabilisation(&diagram, err);
}
