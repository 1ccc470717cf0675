/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * law_transfer.h — transfer functions between sources, contact coordinates and outputs on the grids of a run, and their
 * derivatives: made once a run, shared by all records of a grid. Cost: one sum over the poles each (response.h).
 */
#ifndef BEAMFIT_LAW_TRANSFER_H
#define BEAMFIT_LAW_TRANSFER_H

#include "predict_work.h"

/* A functional over another. */
struct law_pair {
    const struct functional *of, *by;
    bool by_force; /* a law's, at a coordinate; else an input */
    int order;     /* time derivatives */
    size_t grid;
    double complex *H;   /* [m]; NULL: no record needs it */
    double complex **dH; /* [n_parameters] of [m]; NULL where the structure does not depend on the parameter */
};

struct law_transfers {
    size_t n, n_grids, n_coordinates, n_sources;
    struct law_pair *pairs; /* of each grid: sources by coordinates, then outputs by coordinates */
};

/* The list, without transfer functions; then each of the n by one call, in any order and from any thread. */
void law_transfers_new(const struct run *run, struct law_transfers *out);
void law_transfers_fill(const struct run *run, struct law_transfers *transfers, size_t i);
void law_transfers_free(const struct run *run, struct law_transfers *transfers);

const struct law_pair *law_from_source(const struct law_transfers *t, size_t grid, size_t source, size_t coordinate);
const struct law_pair *law_to_output(const struct law_transfers *t, size_t grid, size_t output, size_t coordinate);

/* As source_response() and source_response_derivative(), of a coordinate. */
void law_source_response(const struct run *run, const struct law_transfers *t, size_t record, size_t coordinate,
                         double complex W[]);
bool law_source_derivative(const struct run *run, const struct law_transfers *t, size_t record, size_t coordinate,
                           size_t parameter, double complex dW[]);

#endif
