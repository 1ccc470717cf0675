/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_coloured.h — what the noise that is left makes of standard errors; private to estimate/. */
#ifndef BEAMFIT_FIT_COLOURED_H
#define BEAMFIT_FIT_COLOURED_H

#include "fit_problem.h"
#include "intervals.h"

/* An autoregressive model of what the last evaluation left of each channel whose samples are here: channels[n_channels]. */
void fit_noise_models(const struct fit_problem *p, struct interval_channel channels[]);
/*
 * square[n × n] = Σ JᵀWCWJ of all channels, behind which are those of lines, at the x of the last evaluation with a Jacobian; of shares with the noise that
 * each share finds.
 */
enum bf_status fit_coloured_square(struct fit_problem *p, const double x[], struct interval_channel channels[],
                                   size_t n_channels, double square[], struct bf_error *err);
/* fit_input_noise.c: the same of the noise of recorded inputs, as it comes through a linear beam; added to square. Nothing where rows are not kept. */
enum bf_status fit_input_square(const struct fit_problem *p, double square[], struct bf_error *err);

#endif
