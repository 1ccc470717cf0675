/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_or_warn.h — the attainable floor beside a command's own answer, which stands without it. */
#ifndef BEAMFIT_ATTAINABLE_OR_WARN_H
#define BEAMFIT_ATTAINABLE_OR_WARN_H

#include "noise/noise.h"

/* Of the records, and what it leaves of the checks. A failure is a warning and leaves *out without modes. n_records 0 is no failure. */
void attainable_or_warn(const struct model *model, const struct record records[], size_t n_records,
                        const struct record checks[], size_t n_checks, struct attainable *out);

#endif
