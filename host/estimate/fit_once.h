/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_once.h — one fit at the steps a sample that the model has; private to estimate/. */
#ifndef BEAMFIT_FIT_ONCE_H
#define BEAMFIT_FIT_ONCE_H

#include "estimate.h"

/* As fit_run(). finer: steps a sample that the model's laws need where it ended; 0: no more than it had. */
enum bf_status fit_once(const struct model *model, const struct record records[], size_t n_records,
                        const struct fit_options *options, struct fit_result *out, int *finer, struct bf_error *err);

#endif
