/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reconstruct_text.h — a reconstructed force in words; private to estimate/. */
#ifndef BEAMFIT_RECONSTRUCT_TEXT_H
#define BEAMFIT_RECONSTRUCT_TEXT_H

#include "estimate.h"

/* sensor_like and channel. */
void reconstruct_channels(const struct motion *motion, struct reconstruction *out);
/* out->text. */
void reconstruct_text(struct reconstruction *out);

#endif
