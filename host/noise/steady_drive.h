/* SPDX-License-Identifier: GPL-3.0-or-later */
/* steady_drive.h — does something move before the record begins? Private to noise/; initial_state.c. */
#ifndef BEAMFIT_STEADY_DRIVE_H
#define BEAMFIT_STEADY_DRIVE_H

#include "model/model.h"
#include "record/record.h"

/* How often x[n] passes its mean, up or down. */
size_t mean_crossings(const double x[], size_t n);

/* Some input moves in its first period as it does at large. O(n). */
bool drive_goes_on(const struct model *model, const struct record *record);

#endif
