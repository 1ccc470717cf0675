/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_linear_unknowns.h — what is linear in one record of a fit: an unknown level, an initial state; private to estimate/ */
#ifndef BEAMFIT_FIT_LINEAR_UNKNOWNS_H
#define BEAMFIT_FIT_LINEAR_UNKNOWNS_H

#include <stddef.h>

#include "ground/ground.h"

/* Columns of the record's rows. The room for them stays from one evaluation to the next. */
struct linear_unknowns {
    size_t row, m;    /* first row, number of rows */
    size_t n;         /* columns */
    size_t *nuisance; /* [n] which of the prediction's columns; the level comes first, as SIZE_MAX */
    double *A;        /* [m × n] weighted */
    double *Q;        /* [m × rank] orthonormal, of A */
    double *R;        /* [n × n] scratch */
    size_t rank;
    double *c; /* [n] */
};

/* Room for n columns; c is zero. */
void linear_unknowns_room(struct linear_unknowns *part, size_t n);
/* Q, rank and the coefficients c = argmin ‖A c − target[m]‖; columns that depend on others do not count. */
enum bf_status linear_unknowns_solve(struct linear_unknowns *part, const double target[], struct bf_error *err);
void linear_unknowns_free(struct linear_unknowns *part);

#endif
