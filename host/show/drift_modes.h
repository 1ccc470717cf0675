/* SPDX-License-Identifier: GPL-3.0-or-later */
/* drift_modes.h — the dominant modes of a decay as columns of a picture. Private to show/. */
#ifndef BEAMFIT_DRIFT_MODES_H
#define BEAMFIT_DRIFT_MODES_H

#include "compare/compare.h"
#include "plot.h"

struct drift_modes {
    size_t n; /* 0: that channel has no decay there */
    struct plot_drift_mode modes[PLOT_DRIFT_MODES];
    char title[PLOT_DRIFT_MODES][60];
    struct plot_drift_curve *curves; /* of all modes */
};

/*
 * The dominant modes of one channel in one record (SIZE_MAX: in all), `also` among them (0: none in particular). With two predictions
 * `after` has the second; NULL: `curves` has the only one. curves and after outlive the modes. Free with drift_modes_free().
 */
void drift_modes_make(const struct amplitude_curves *curves, const struct amplitude_curves *after, const char *channel,
                      size_t record, size_t also, struct drift_modes *out);
void drift_modes_free(struct drift_modes *modes);

#endif
