/* SPDX-License-Identifier: GPL-3.0-or-later */
/* residual_parts.h — what the judgements of a residual in one piece and of one in segments have in common. Private to maths/. */
#ifndef BEAMFIT_RESIDUAL_PARTS_H
#define BEAMFIT_RESIDUAL_PARTS_H

#include "maths.h"

enum { RESIDUAL_LJUNG_BOX = 25 }; /* lags of the test, at most */

/* power[n/2 + 1] = |R|² of the transform of r[n]. */
enum bf_status residual_power(const double *r, size_t n, double power[], struct bf_error *err);
/* residual_band_shares() from it. */
void residual_power_bands(const double power[], size_t n, double dt_s, const double *edge_Hz, size_t n_edges,
                          double *share);
/* Mean square of z in a window centred on each sample, cut at the ends. power: [n]. */
void residual_running_power(const double *z, size_t n, size_t window, double *power);
/* residual_whiteness() from rho[lags + 1] of n samples and the power of transforms of m samples (sums over n/m of them). */
void residual_judge_whiteness(const double rho[], size_t lags, size_t n, const double power[], size_t m,
                              struct whiteness *out);

#endif
