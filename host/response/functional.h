/* SPDX-License-Identifier: GPL-3.0-or-later */
/* functional.h — inputs, outputs and coordinates of laws as functionals on the reduced space, in modes of a system. */
#ifndef BEAMFIT_FUNCTIONAL_H
#define BEAMFIT_FUNCTIONAL_H

#include "beam/beam.h"

/* g depends on a parameter: dg. */
struct functional_change {
    size_t parameter;
    double *g; /* [n] */
};

/* α = gᵀφ of one functional and its derivative by every structural parameter. */
struct functional {
    double *g;               /* [n] */
    double complex *alpha;   /* [n_poles] */
    double complex *d_alpha; /* [n_parameters][n_poles], where the system or g depends on the parameter */
    size_t n_changes;
    struct functional_change *changes;
};

struct functional *functionals_new(size_t count, size_t n);
void functionals_free(struct functional **list, size_t count);
/* g of a model's inputs and outputs. */
void functionals_place(const struct model *model, const struct reduced *reduced, struct functional inputs[],
                       struct functional outputs[]);
/* dg by a parameter, [n], zero when it is new. */
double *functional_change(struct functional *f, size_t n, size_t parameter);
/* g depends on this parameter. */
bool functional_changes(const struct functional *f, size_t parameter);
/*
 * α = gᵀφ of each at the system as last evaluated, and its derivatives by the parameters with structural[j], those by which
 * the system or some g changes (NULL: none).
 */
void functionals_evaluate(const struct system *system, const bool structural[], struct functional list[], size_t count);

#endif
