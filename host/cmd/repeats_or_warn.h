/* SPDX-License-Identifier: GPL-3.0-or-later */
/* repeats_or_warn.h — how well repeated records agree, for the commands that say it. */
#ifndef BEAMFIT_REPEATS_OR_WARN_H
#define BEAMFIT_REPEATS_OR_WARN_H

#include "noise/noise.h"

/* Of a channel of a record; 0: nothing is known. Sets rms[record · model->n_outputs + output]. */
void repeats_noise(const struct model *model, size_t record, const char *output, double noise_rms, double rms[]);

/* noise_rms as repeatability_find() takes it. A warning and nothing found where it cannot be computed. Free with repeatability_free(). */
struct repeatability repeats_or_warn(const struct model *model, const struct record records[], size_t n_records,
                                     const double noise_rms[]);

#endif
