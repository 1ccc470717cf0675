/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * refit_horizon.h — how far a nonlinear motion can be predicted at all; inside the fit stage only.
 *
 * Impacts, and jumps between two branches of a response, let differences grow until the motion is another one. No value of
 * a parameter is told by rows after that, for the right model as for any other, and fitting them makes values wrong. Told by the
 * computation alone, without the measured outputs: half the time step gives another prediction.
 */
#ifndef BEAMFIT_REFIT_HORIZON_H
#define BEAMFIT_REFIT_HORIZON_H

#include "fit_problem.h"

/*
 * Sets p->horizon_s at theta[n_refs]: where the predictions of two time steps begin to differ, before they differ by more than 2 % of
 * the channel's rms (16 samples at a time); *any: somewhere they do. Takes effect with the next stage. Leaves p in the
 * stage of whole records. Cost: two predictions without derivatives and a predictor.
 */
enum bf_status horizon_find(struct fit_problem *p, const struct predict_options *predict, const double theta[],
                            bool *any, struct bf_error *err);

#endif
