/* SPDX-License-Identifier: GPL-3.0-or-later */
/* laminate.h — bending stiffness and mass per length of a beam with layers bonded on it. */
#ifndef BEAMFIT_LAMINATE_H
#define BEAMFIT_LAMINATE_H

#include "model.h"

/*
 * EI (N·m²) and mass per length (kg/m) of a beam with layers bonded on `sides` faces (0, 1, 2) of it. Two sides: eqs. 30,
 * 31 of the seed paper. One side: the same laminate theory about its own neutral axis.
 */
double laminate_EI(const struct layer *beam, const struct layer *patch, int sides);
double laminate_rho(const struct layer *beam, const struct layer *patch, int sides);

#endif
