/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_parts.h — what a channel in memory and one that is read piece by piece are judged by. Private to compare/. */
#ifndef BEAMFIT_COMPARE_PARTS_H
#define BEAMFIT_COMPARE_PARTS_H

#include "compare.h"

enum {
    COMPARE_LAGS = 1200,      /* of the residual's autocorrelation, at most */
    COMPARE_INPUT_LAGS = 150, /* to each side */
    COMPARE_WINDOWS = 64      /* a record's samples by its windows: one in which the size of the motion is taken */
};

/* Least-squares factor and correlation of measured z and predicted y, from Σ z², Σ z y, Σ y². */
void compare_set_scale(struct comparison_channel *c, double zz, double zy, double yy);
/* Needs the channel's noise and residual_rms. edge: [n_edges], share: [n_edges − 1]. */
void compare_set_bands(const struct comparison *all, struct comparison_channel *c, const double edge[], size_t n_edges,
                       const double share[]);
size_t compare_edges_room(const struct comparison *all); /* of residual_band_edges() */
void compare_set_coherence(const struct cross_spectrum *s, struct comparison_input *input);
/* Root mean squares over the channels, from what they say now. */
void compare_totals(struct comparison *out);

#endif
