/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_result.h — from the optimum to the answer: standard errors, identifiability, warnings; inside the fit stage only. */
#ifndef BEAMFIT_FIT_RESULT_H
#define BEAMFIT_FIT_RESULT_H

#include "estimate.h"
#include "fit_problem.h"

/*
 * Fills parameters, names, levels, identifiability and warnings of *out from the problem as last evaluated (with its
 * Jacobian, whole records, weights of the noise) at x. Of long records that is one prediction with derivatives more.
 */
enum bf_status fit_statistics(struct fit_problem *p, const struct model *model, const double x[],
                              struct fit_result *out, struct bf_error *err);

/* What the last evaluation leaves, channels first, groups of lines behind; noise: [n_channels], 0 where it is not known. free() it. */
struct fit_channel_error *fit_channel_errors(const struct fit_problem *p, const double noise[], size_t *n);

#endif
