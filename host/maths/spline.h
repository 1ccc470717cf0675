/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * spline.h — cubic B-splines on [0, ℓ] whose second derivative may jump at given edges (double knots there).
 * Basis functions are numbered 0 … n−1; at any x at most four of them are not zero.
 */
#ifndef BEAMFIT_SPLINE_H
#define BEAMFIT_SPLINE_H

#include <stddef.h>
#include "ground/error.h"

enum { SPLINE_ORDER = 4 };

struct spline {
    size_t n;       /* basis functions, before any boundary condition */
    size_t n_knots; /* n + 4 */
    double *knots;  /* non-decreasing; 4-fold at both ends, 2-fold at the edges */
};

/* Values and derivatives of the four functions first … first+3 at x: d[k][j] = k-th derivative of function first+j. */
struct spline_values {
    size_t first;
    double d[4][SPLINE_ORDER];
};

/*
 * edges[n_edges]: strictly increasing, inside (0, length_m). About n functions: elements of nearly equal length, at
 * least two between neighbouring edges.
 */
enum bf_status spline_new(double length_m, const double edges[], size_t n_edges, size_t n, struct spline *out,
                          struct bf_error *err);
void spline_free(struct spline *spline);
/* x in [0, ℓ]; at an edge the limit from the right (from the left at ℓ). Cost: about 40 flops. */
void spline_evaluate(const struct spline *spline, double x, struct spline_values *out);

#endif
