/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * local_rational.h — what a linear system cannot have done, in narrow bands of one record's spectrum.
 *
 * In a band of a few dozen bins the spectrum of a channel of any linear system, in any initial and final state, is
 *     Y(x) = Σ_i U_i(x) [P_i(x) + Σ_j b_ij/(x − p_j)] + P_0(x) + Σ_j a_j/(x − p_j)
 * with quadratic polynomials P and at most two poles p_j: the local rational method (McKelvey & Guérin 2012), with
 * its poles found by variable projection (Kaufman 1975) instead of the linearised equation error, whose noise estimate
 * is biased by noise in its regressors, and only where an F test asks for them.
 * The residual of that fit is noise and whatever is not linear.
 */
#ifndef BEAMFIT_LOCAL_RATIONAL_H
#define BEAMFIT_LOCAL_RATIONAL_H

#include "ground/error.h"

struct local_rational; /* the fitted bands, as projections that can be applied to other data */

/* z: [n], u: n_inputs arrays of [n], n ≥ 64. Free with local_rational_free(). O(n). */
enum bf_status local_rational_new(const double *z, size_t n, const double *const u[], size_t n_inputs,
                                  struct local_rational **out, struct bf_error *err);
/* Residual of x (the record itself, or noise sent the same way) in time, without the mean. x, r: [n], may be the same. */
enum bf_status local_rational_residual(const struct local_rational *fit, const double *x, double *r,
                                       struct bf_error *err);
void local_rational_free(struct local_rational *fit);

#endif
