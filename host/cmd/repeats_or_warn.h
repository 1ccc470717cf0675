/* SPDX-License-Identifier: GPL-3.0-or-later */
/* repeats_or_warn.h — how well repeated records agree, for a command that only mentions it. */
#ifndef BEAMFIT_REPEATS_OR_WARN_H
#define BEAMFIT_REPEATS_OR_WARN_H

#include "noise/noise.h"

/* A warning and nothing found where it cannot be computed. Free with repeatability_free(). */
struct repeatability repeats_or_warn(const struct model *model, const struct record records[], size_t n_records);

#endif
