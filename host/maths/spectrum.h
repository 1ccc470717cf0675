/* SPDX-License-Identifier: GPL-3.0-or-later */
/* spectrum.h — correlation by transforms, for the tests of residuals. */
#ifndef BEAMFIT_SPECTRUM_H
#define BEAMFIT_SPECTRUM_H

#include "maths.h"

/*
 * Correlation sums c[lag] = Σ_t x[t] y[t + lag], lag = 0 … n_lags − 1, without wrap-around. n_lags ≤ n.
 */
enum bf_status correlate(const double *x, const double *y, size_t n, size_t n_lags, double *c, struct bf_error *err);

#endif
