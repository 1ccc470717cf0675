/* SPDX-License-Identifier: GPL-3.0-or-later */
/* residual.h — private to maths/: what its files share of residual. */
#ifndef BEAMFIT_RESIDUAL_PRIVATE_H
#define BEAMFIT_RESIDUAL_PRIVATE_H

#include "maths.h"

/* Autocovariance at lags 0 … n_lags − 1. */
void ar_autocovariance(const struct ar_model *model, size_t n_lags, double *c);

/* Two-sided quantile of the normal distribution: P(|N| > q) = alpha, 0 < alpha < 1. */
double normal_two_sided(double alpha);

#endif
