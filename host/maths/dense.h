/* SPDX-License-Identifier: GPL-3.0-or-later */
/* dense.h — private to maths/: what its files share of dense. */
#ifndef BEAMFIT_DENSE_PRIVATE_H
#define BEAMFIT_DENSE_PRIVATE_H

#include "maths.h"

/* A X = B by LU with partial pivoting; B[n × n_rhs] in/out. BF_NUMERIC when A is exactly singular. */
enum bf_status dense_solve(size_t n, size_t n_rhs, const double A[], double B[], struct bf_error *err);
enum bf_status dense_solve_complex(size_t n, size_t n_rhs, const double complex A[], double complex B[],
                                   struct bf_error *err);

#endif
