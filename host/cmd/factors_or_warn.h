/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factors_or_warn.h — wrong signs and units of channels, before a command's own answer, which stands without them. */
#ifndef BEAMFIT_FACTORS_OR_WARN_H
#define BEAMFIT_FACTORS_OR_WARN_H

#include "compare/compare.h"

/* As channel_factors_find(). A failure is a warning and leaves *out empty, and so is it after a fit that was interrupted. */
void factors_or_warn(const struct model *model, const struct record records[], size_t n_records,
                     const struct predict_options *options, const struct fit_result *fitted, bool places,
                     struct channel_factors *out);

#endif
