/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fit_shares.h — a problem whose records others have (p->shares): what fit_problem.h does with them; private to estimate/.
 *
 * Answers are combined in the order of shares, whoever gave them, so that the numbers hang on the shares alone.
 */
#ifndef BEAMFIT_FIT_SHARES_H
#define BEAMFIT_FIT_SHARES_H

#include "estimate.h"
#include "fit_problem.h"

/* The reduced spaces at θ, and with `stage` the window of p->decay_ps and p->floor before; counts the rows. */
enum bf_status shares_rebase(struct fit_problem *p, const double theta[], bool stage, struct bf_error *err);
/* half_square at p->theta, which is that of x; with_jacobian: jacobian and beside too. */
enum bf_status shares_evaluate(struct fit_problem *p, const double x[], bool with_jacobian, struct bf_error *err);
/* square[n_unknowns²] += JᵀWCWJ at p->theta, which is that of x. */
enum bf_status shares_coloured(const struct fit_problem *p, const double x[], double square[], struct bf_error *err);
/* Errors of every channel at p->theta, of which *n; p->levels too. free() them. None where a share does not answer. */
struct fit_channel_error *shares_errors(const struct fit_problem *p, size_t *n);

#endif
