/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * intervals.h — standard errors and intervals of a weighted least-squares fit whose residuals are coloured.
 *
 *   A = JᵀJ + P,  B = Jᵀ W C W J + P,  cov = A⁻¹ B A⁻¹     (J = W dŷ/dx, C the covariance of the residual, P of priors)
 *
 * C is that of an autoregressive model per channel, so no n × n matrix is ever formed. With white residuals of the
 * variance that the weights assume, cov = A⁻¹.
 */
#ifndef BEAMFIT_INTERVALS_H
#define BEAMFIT_INTERVALS_H

#include <stdbool.h>
#include "maths/maths.h"

struct interval_channel {
    size_t row, n;         /* its rows in J and weight */
    struct ar_model noise; /* of z − ŷ, unit of the channel */
};

/*
 * J: [n_rows × n] weighted, column-major; weight: [n_rows]; prior_precision: [n] diagonal of P; form_scale s ≥ 1 (fit_problem_form_scale()): the data
 * say the same s times, so that A = JᵀJ + s P and B = JᵀΣJ + (s − 1) JᵀJ + s² P. The inverse of A is taken
 * in the space of the `kept` orthonormal columns of basis [n × n] (identifiability.h); NULL: the whole space.
 * covariance: [n × n] out. O(n_rows n (n + order)).
 */
enum bf_status intervals_covariance(size_t n_rows, size_t n, const double J[], const double weight[],
                                    const double prior_precision[], double form_scale, size_t n_channels,
                                    const struct interval_channel channels[], const double basis[], size_t kept,
                                    double covariance[], struct bf_error *err);

/* The same in two: B += JᵀWCWJ of some channels … */
void intervals_add_coloured(size_t n_rows, size_t n, const double J[], const double weight[], size_t n_channels,
                            const struct interval_channel channels[], double B[]);
/*
 * … or of `some` rows of one channel, which come from its end: V[some × n], those of WJ (in), is overwritten; later[n × noise->order] is what the rows behind have
 * left (zero before the last block). …
 */
void intervals_add_block(const struct ar_model *noise, size_t some, size_t n, double V[], double later[], double B[]);
/* … and the rest, from the B so added. J may be any rows with the same JᵀJ. */
enum bf_status intervals_from_coloured(size_t n_rows, size_t n, const double J[], const double prior_precision[],
                                       double form_scale, const double coloured[], const double basis[], size_t kept,
                                       double covariance[], struct bf_error *err);

/* Two-sided 95 % quantile of Student's t (1.96 for many degrees of freedom), dof ≥ 1; relative error < 1e-4. */
double intervals_student95(double dof);

/*
 * 95 % interval of a parameter: value·e^(±q s) for a logarithmic one (s = sd of ln θ), value ± q s otherwise; cut at the
 * bounds of the fit.
 */
void intervals_95(double value, double s, bool logarithmic, double dof, double min, double max, double ci[2]);

#endif
