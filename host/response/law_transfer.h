/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * law_transfer.h — transfer functions between sources, contact coordinates and outputs on the grids of a run, and their
 * derivatives: made once a run, shared by all records of a grid. Cost: one sum over the poles each (response.h).
 */
#ifndef BEAMFIT_LAW_TRANSFER_H
#define BEAMFIT_LAW_TRANSFER_H

#include "modal_system.h"

/* A functional over another, both NULL where no record needs it. */
struct law_pair {
    const struct functional *of, *by;
    int order; /* time derivatives */
    const struct response_grid *grid;
    const struct response_kernel *kernel; /* of the force's kind: a law's, or an input held as the grid says */
};

/* A row is a source or an output on one grid; rows are numbered as the caller likes. */
struct law_transfers {
    const struct system *system;
    size_t n, n_coordinates;
    struct law_pair *pairs;   /* [rows][n_coordinates] */
    struct modal_path *paths; /* the same */
};

/*
 * Rows without functionals; then the functional of every row that is needed; then each of the n by one call, in any order and
 * from any thread.
 */
void law_transfers_new(const struct system *system, size_t rows, size_t n_coordinates, struct law_transfers *out);
/* `pair` names one functional: `by`, a source of the coordinates, or `of`, an output of forces at them. */
void law_transfers_row(struct law_transfers *t, size_t row, const struct law_pair *pair,
                       const struct functional coordinates[]);
/* structural: as functionals_evaluate() was given it. */
void law_transfers_fill(struct law_transfers *t, const bool structural[], size_t i);
void law_transfers_free(struct law_transfers *t);

/* W[m] of a coordinate under the record's inputs, before the recorder's filter; and its derivative, false: it is zero. */
void law_source_response(const struct modal_system *s, size_t coordinate, double complex W[]);
bool law_source_derivative(const struct modal_system *s, size_t coordinate, size_t parameter, double complex dW[]);

#endif
