/* SPDX-License-Identifier: GPL-3.0-or-later */
/* identifiability.h — private to estimate/: what its files share of identifiability. */
#ifndef BEAMFIT_IDENTIFIABILITY_PRIVATE_H
#define BEAMFIT_IDENTIFIABILITY_PRIVATE_H

#include "estimate.h"

/*
 * J: [n_rows × n] column-major. prior_precision: [n] diagonal 1/sd², 0 where there is no prior. extent: [n] the move of
 * each unknown that counts as 100 % (1 for logarithms). inflation ≥ 1: how many times larger than the noise the residual
 * is. n_rows < n is allowed. O(n_rows n²). Free with identifiability_free().
 */
enum bf_status identifiability_compute(size_t n_rows, size_t n, const double J[], const double prior_precision[],
                                       const double extent[], double inflation, struct identifiability *out,
                                       struct bf_error *err);
void identifiability_free(struct identifiability *identifiability);

#endif
