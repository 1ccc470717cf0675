/* SPDX-License-Identifier: GPL-3.0-or-later */
/* sparse.h — sparse factorisation, solves and lowest modes. Only sparse.c sees CHOLMOD and ARPACK. */
#ifndef BEAMFIT_SPARSE_H
#define BEAMFIT_SPARSE_H

#include "ground/error.h"

struct sparse_factor;

/*
 * Cholesky factor of the symmetric banded matrix A(i, i+d) = band[i·width + d], i = 0 … n−1, d = 0 … width−1.
 * BF_NUMERIC when A is not positive definite or not finite.
 */
enum bf_status sparse_factorise(size_t n, size_t width, const double band[], struct sparse_factor **out,
                                struct bf_error *err);
/* x[n] = A⁻¹ b[n]; x may be b. */
enum bf_status sparse_solve(struct sparse_factor *factor, const double b[], double x[], struct bf_error *err);
void sparse_free(struct sparse_factor *factor);

/*
 * The n_modes lowest eigenpairs of K v = λ M v by shift-invert Lanczos (ARPACK) about `shift` < λ_1: factor holds
 * K − shift·M. values[n_modes] ascend, vectors[n_modes][n] with vᵀMv = 1, largest entry positive. n_modes ≤ n − 2.
 * multiply(context, x, y): y = M x.
 */
enum bf_status sparse_modes(struct sparse_factor *factor, size_t n, size_t n_modes, double shift,
                            void (*multiply)(const void *context, const double x[], double y[]), const void *context,
                            double values[], double vectors[], struct bf_error *err);

#endif
