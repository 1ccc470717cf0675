/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_plot_force.c — the force that a model lacks, as reconstruct_run() found it. */
#include "diagnose_pictures.h"
#include "show.h"
#include "plot.h"
#include "maths/maths.h"

#include <stdlib.h>

enum { WINDOWS = 48 }; /* of a record: one point of size against size each */

static const struct {
    const char *force, *displacement, *velocity;
} labels[] = {
    [RECONSTRUCT_POINT] = {"Force (N)", "Displacement (m)", "Velocity (m/s)"},
    [RECONSTRUCT_PATCH] = {"Moment (N·m)", "Slope difference of the patch (rad)", "Its rate (rad/s)"},
    [RECONSTRUCT_SPREAD] = {"Force per length (N/m)", "∫ y dx (m²)", "∫ dy/dt dx (m²/s)"},
};

static size_t sizes(const struct reconstruction *r, double *w, double *f)
{
    size_t n = 0;
    for (size_t i = 0; i < r->n_records; i++) {
        const struct reconstruct_record *record = &r->records[i];
        const size_t length = record->n / WINDOWS;
        for (size_t k = 0; length > 0 && k < WINDOWS; k++) {
            w[n] = root_mean_square(record->w + k * length, length);
            f[n] = root_mean_square(record->f + k * length, length);
            n += w[n] > 0.0 && f[n] > 0.0;
        }
    }
    return n;
}

enum bf_status diagnose_plot_force(const struct diagnose_pictures *p, struct bf_error *err)
{
    const struct reconstruction *r = &p->d->reconstruction;
    const struct reconstruct_record *strongest = &r->records[r->strongest];
    double *size_w = bf_alloc(WINDOWS * r->n_records + 1, sizeof *size_w);
    double *size_f = bf_alloc(WINDOWS * r->n_records + 1, sizeof *size_f);
    char title[200];
    if (r->best.place == RECONSTRUCT_POINT)
        (void)snprintf(title, sizeof title, "Missing force at x = %.3g m%s", r->best.at_m,
                       r->located ? "" : " (the place is uncertain)");
    else
        (void)snprintf(title, sizeof title, "Missing %s%s",
                       r->best.place == RECONSTRUCT_PATCH ? "moment of the patch" : "force along the beam",
                       r->located ? "" : " (the place is uncertain)");
    const struct plot_force picture = {.directory = p->directory,
                                       .stem = "diagnose-force",
                                       .title = title,
                                       .force = labels[r->best.place].force,
                                       .displacement = labels[r->best.place].displacement,
                                       .velocity = labels[r->best.place].velocity,
                                       .n = strongest->n,
                                       .f = strongest->f,
                                       .w = strongest->w,
                                       .v = strongest->v,
                                       .n_bins = RECONSTRUCT_BINS,
                                       .w_bin = r->w_bin,
                                       .f_of_w = r->f_of_w,
                                       .v_bin = r->v_bin,
                                       .f_of_v = r->f_of_v,
                                       .n_sizes = sizes(r, size_w, size_f),
                                       .size_w = size_w,
                                       .size_f = size_f,
                                       .n_lines = r->n_lines,
                                       .df_Hz = r->df_Hz,
                                       .spectrum = r->spectrum,
                                       .n_modes = p->before.n_modes,
                                       .mode_Hz = p->before.frequency_Hz};
    const enum bf_status status = plot_force(&picture, err);
    free(size_w), free(size_f);
    return status;
}
