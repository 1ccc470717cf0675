/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fine.h — matrices and functionals on a fine spline space. Private to beam/; see FINE in beam.h. */
#ifndef BEAMFIT_FINE_H
#define BEAMFIT_FINE_H

#include "beam.h"

enum { FINE_BAND = 4 }; /* diagonal and three upper diagonals */

/*
 * root_released: y'(0) stays free although the support clamps it (effects with releases_root). knots_on_edges: these
 * double knots; without, equidistant knots and C² splines, the seed paper's uniform space.
 */
enum bf_status fine_new(const struct model *model, size_t n_splines, bool root_released, bool knots_on_edges,
                        struct fine_space *out, struct bf_error *err);
void fine_free(struct fine_space *space);
/* Allocates and fills space->gauss from its splines, of a space that has none. */
void fine_fill_gauss(struct fine_space *space);

/*
 * Adds scale · ∫ D^k φ_i D^k φ_j dx over [from_m, to_m] to
 * band[n][FINE_BAND], band[i][d] = A(i, i+d). k = derivative order 0, 1, 2. Exact Gauss quadrature.
 */
void fine_add_form(const struct fine_space *space, int derivative, double from_m, double to_m, double scale,
                   double band[]);

/* Adds scale · g gᵀ for a functional whose nonzero entries are adjacent (point or slope, not a difference). */
void fine_add_point(const struct fine_space *space, int derivative, double at_m, double scale, double band[]);

/*
 * g[n] += scale · D^k φ(at_m); k = 0 … 3. From k = 2 on the mean of both limits: so a slope that is felt at a knot where
 * y″ jumps changes with its place.
 */
void fine_add_functional(const struct fine_space *space, int derivative, double at_m, double scale, double g[]);

/* y[n] = A x[n] for a band matrix. */
void fine_multiply(const struct fine_space *space, const double band[], const double x[], double y[]);

#endif
