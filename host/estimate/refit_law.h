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

/* Index of the only law among the effects from first_effect on; n_effects when there is none, or others have one too. */
size_t law_only(const struct model *model, size_t first_effect);
/* p's model at theta[n_refs] without effect e; its parameters are p's in the same order, without those of e. Free with model_free(). */
enum bf_status law_drop(const struct fit_problem *p, size_t e, const double theta[], struct model *out,
                        struct bf_error *err);

/*
 * One more start, by the equation-error trial trial_run(), when law_only() finds a law. baseline[n_refs]: the model without that law,
 * fitted to the records (the law's own elements are not read). theta0[n_refs]: start of what the trial does not estimate. *possible:
 * theta[n_refs] is a start.
 */
enum bf_status law_trial(const struct fit_problem *p, const struct predict_options *predict, size_t first_effect,
                         const double baseline[], const double theta0[], double theta[], bool *possible,
                         struct bf_error *err);

#endif
