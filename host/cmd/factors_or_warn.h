/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factors_or_warn.h — wrong signs and units of channels, before a command's own answer, which stands without them. */
#ifndef BEAMFIT_FACTORS_OR_WARN_H
#define BEAMFIT_FACTORS_OR_WARN_H

#include "compare/compare.h"

/* A failure is a warning and leaves *out empty. Free with channel_factors_free(). */
void factors_or_warn(const struct model *model, const struct record records[], size_t n_records,
                     const struct predict_options *options, struct channel_factors *out);

#endif
