/* SPDX-License-Identifier: GPL-3.0-or-later */
/* refit_law.h — starts for effects with a law; inside the fit stage only. */
#ifndef BEAMFIT_REFIT_LAW_H
#define BEAMFIT_REFIT_LAW_H

#include "fit_starts.h"

/* Some effect from first_effect on has a law, and a free strength. */
bool law_is_new(const struct fit_problem *p, size_t first_effect);

/*
 * Starts for the laws of the effects from first_effect on. With the laws out, the other parameters are fitted in windows
 * e^(−s t) that grow from first_ps while the linear part explains them; there the motion is too short to tell a law. In the
 * next window the laws are scanned with the rest held: size in half decades from 0.01 to 1000 times the catalogue's start
 * in both signs, thresholds, places; at most `values` predictions without derivatives. The best are added to *out,
 * ranked by ½χ² in that window; *scanned_ps is its s. theta0: [n_refs] where all begin.
 */
enum bf_status law_starts(struct fit_problem *p, size_t first_effect, size_t values, double first_ps, double last_ps,
                          const double theta0[], struct starts *out, double *scanned_ps, struct bf_error *err);

/*
 * One more start: the equation-error trial of trial.h when exactly one effect of the model, from first_effect on, has a law.
 * theta0: the baseline, `fitted` to the records or to be fitted first. *possible: theta[n_refs] is a start.
 */
enum bf_status law_trial(const struct fit_problem *p, const struct predict_options *predict, size_t first_effect,
                         bool fitted, const double theta0[], double theta[], bool *possible, struct bf_error *err);

#endif
