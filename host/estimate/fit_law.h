/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_law.h — the model without its only law, fitted: from there a trial of the law begins; private to estimate/. */
#ifndef BEAMFIT_FIT_LAW_H
#define BEAMFIT_FIT_LAW_H

#include "fit_problem.h"

/*
 * baseline[n_refs]: the parameters of p's model without its only law, refitted from theta0; those of the law are theta0's. *possible:
 * false when the model has no law or several, when the law has no trial, or when the refit has no value. Cost: a refit.
 */
enum bf_status fit_without_law(const struct fit_problem *p, const struct predict_options *predict,
                               const double theta0[], double baseline[], bool *possible, struct bf_error *err);

#endif
