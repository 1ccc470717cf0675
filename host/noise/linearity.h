/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linearity.h — private to noise/: what its files share of linearity. */
#ifndef BEAMFIT_LINEARITY_PRIVATE_H
#define BEAMFIT_LINEARITY_PRIVATE_H

#include "noise.h"

/* Above this a pair is not linear; see docs/diagnose.md, 'Linearity', for the simulation that set it. */
extern const double linearity_threshold;

/*
 * Steady lines, offset and drift of a series: the channel itself where it is quiet, or better a residual. u: inputs of the
 * record, [n_inputs] of [n]; a line that an input has too is not reported. found: room for `room`; returns how many.
 */
size_t linearity_find_added(const double x[], size_t n, double dt_s, const double *const u[], size_t n_inputs,
                            struct linearity_added found[], size_t room);

#endif
