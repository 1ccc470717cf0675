/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_pictures.h — the pictures of a diagnosis, one file each, and what all of them draw from. Private to show/. */
#ifndef BEAMFIT_DIAGNOSE_PICTURES_H
#define BEAMFIT_DIAGNOSE_PICTURES_H

#include "compare/compare.h"
#include "explain/explain.h"

struct diagnose_pictures {
    const struct diagnosis *d;
    const char *directory;
    const struct hypothesis *best; /* the first that was refitted; NULL: none */
    char best_name[120];
    char heading[240];               /* verdict, and what is before and after */
    struct comparison before, after; /* of fitted, then held-out records; after: empty without best */
};

/* diagnose_plot_misfit.c: by band and amplitude. */
enum bf_status diagnose_plot_misfit(const struct diagnose_pictures *p, struct bf_error *err);
/* diagnose_plot_drift.c: amplitude in time, frequency and damping against it; *drawn false: no record has a free stretch. */
enum bf_status diagnose_plot_drift(const struct diagnose_pictures *p, bool *drawn, struct bf_error *err);
/* diagnose_plot_force.c: the reconstructed force. */
enum bf_status diagnose_plot_force(const struct diagnose_pictures *p, struct bf_error *err);

#endif
