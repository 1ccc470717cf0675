/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reconstruct_shape.h — what a reconstructed force looks like; private to estimate/. */
#ifndef BEAMFIT_RECONSTRUCT_SHAPE_H
#define BEAMFIT_RECONSTRUCT_SHAPE_H

#include "reconstruct_law.h"

/* Shares, curves, amplitude and frequency of *out from the force and law at its best place. */
enum bf_status reconstruct_shape(const struct site_force *force, const struct site_law *law, struct reconstruction *out,
                                 struct bf_error *err);

#endif
