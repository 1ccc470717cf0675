/* SPDX-License-Identifier: GPL-3.0-or-later */
/* refit.h — private to estimate/: what its files share of refit. */
#ifndef BEAMFIT_REFIT_PRIVATE_H
#define BEAMFIT_REFIT_PRIVATE_H

#include "estimate.h"

/*
 * Errors on records that were not fitted: values that belong to one record alone (phases) are estimated from it, see fit_own.h.
 * sigma as above for these records; *chi2_per_row and *noise_ratio as above.
 */
enum bf_status refit_check(const struct model *model, const struct record records[], size_t n_records,
                           const double sigma[], const struct predict_options *predict, double *chi2_per_row,
                           double *noise_ratio, struct bf_error *err);

#endif
