/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reduced_basis.h — the vectors that span a reduced space. Private to beam/. */
#ifndef BEAMFIT_REDUCED_BASIS_H
#define BEAMFIT_REDUCED_BASIS_H

#include "beam.h"

/* The basis as it grows, and the fine mass matrix and factor of the stiffness that it is made with. */
struct basis {
    const struct fine_space *space;
    double *M;                    /* band [N][FINE_BAND] */
    struct sparse_factor *factor; /* of K, or of K about a shift for a free beam */
    double *V, *work;             /* V[N × capacity], work[N] */
    size_t n, limit;              /* columns of V: so far, and at most */
    int corrections;              /* dynamic corrections of each static response */
};

/* Modes and static responses of the model into b->V; fills b->M, b->factor and the modes of *out. */
enum bf_status reduced_basis(struct basis *b, const struct model *model, const struct reduced_options *options,
                             struct reduced *out, struct bf_error *err);

#endif
