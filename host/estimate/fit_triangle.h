/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_triangle.h — R of the QR decomposition of [J r] of rows that come one block after the other; private to estimate/. */
#ifndef BEAMFIT_FIT_TRIANGLE_H
#define BEAMFIT_FIT_TRIANGLE_H

#include "ground/ground.h"

struct triangle {
    size_t n;    /* columns: the unknowns, and the residual as the last one */
    double *R;   /* [n × n] of the rows so far, column-major */
    double *A;   /* R above the rows of a block */
    size_t most; /* rows that A has room for */
};

struct triangle triangle_new(size_t n_unknowns);
void triangle_free(struct triangle *t);
/* `some` rows below those so far: of J[stride × n_unknowns] the first ones, r[some]. O(some n²). */
enum bf_status triangle_add(struct triangle *t, size_t some, size_t stride, const double J[], const double r[],
                            struct bf_error *err);
/* R into jacobian[stride × n_unknowns] and beside[], n rows of each. */
void triangle_into(const struct triangle *t, size_t stride, double jacobian[], double beside[]);

#endif
