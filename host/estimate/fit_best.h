/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fit_best.h — no point that a fit has passed is better than its answer; inside the fit stage only.
 *
 * A walk down the windows is led by short pieces of the records: where the model lacks something, its end may describe the
 * whole records worse than the start did, or than the end of a window on the way.
 */
#ifndef BEAMFIT_FIT_BEST_H
#define BEAMFIT_FIT_BEST_H

#include "fit_stages.h"
#include "fit_tried.h"

/*
 * Where a point of `tried` is better on whole records than `found` at x[n_unknowns], goes down from the best of them; the
 * lower of the two ends is left in x and found, and p in the stage of whole records there. p must be in that stage. Values
 * that are not known are computed first (tried_value()); nothing is done when all are known and none is better.
 */
enum bf_status best_of_tried(struct tried *tried, struct fit_problem *p, const struct staircase *stairs, double x[],
                             struct optimise_result *found, struct bf_error *err);

/*
 * A descent that begins with a small damping may leave it where it changes nothing, and its logarithm has no gradient there: whole records once
 * more from where it is seen again (starts_restore_vanished()). The lower of the two ends is left in x and found, as above. Cost: a
 * Jacobian and a descent; nothing where the problem holds a Jacobian that says that nothing has vanished.
 */
enum bf_status best_raise_vanished(struct fit_problem *p, const struct staircase *stairs, double x[],
                                   struct optimise_result *found, struct bf_error *err);

/*
 * optimise_polish() at x[n_unknowns] on whole records, a few evaluations. It looks around, and the reduced space is rebuilt
 * where it looks: x is not judged in the space of another place. x stays when what was found is not below half_square in its
 * own. *gain: what was found, in the objective.
 */
enum bf_status best_polish(struct fit_problem *p, double x[], double half_square, double *gain, struct bf_error *err);

#endif
