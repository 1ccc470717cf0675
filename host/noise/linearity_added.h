/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linearity_added.h — sinusoids of constant amplitude, offsets and drifts that no input has. Private to noise/. */
#ifndef BEAMFIT_LINEARITY_ADDED_H
#define BEAMFIT_LINEARITY_ADDED_H

#include "noise.h"

/*
 * Steady lines, offset and drift of a series: the channel itself where it is quiet, or better a residual. x: [n]. u: inputs of
 * the record, [n_inputs] of [n]; a line that an input has too is not reported. found: room for `room`, without record and
 * output; returns how many. Fewer than 256 samples: none.
 */
size_t linearity_find_added(const double x[], size_t n, double dt_s, const double *const u[], size_t n_inputs,
                            struct linearity_added found[], size_t room);

/* The added signal at sample i of n. */
double linearity_added_at(const struct linearity_added *added, size_t i, size_t n, double dt_s);

#endif
