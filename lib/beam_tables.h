/* SPDX-License-Identifier: MIT */
/*
 * beam_tables.h — the parameter-free Galerkin integrals of the two built-in bases; made by tools/galerkin_tables.c.
 * Private to lib/.
 */
#ifndef BEAM_TABLES_H
#define BEAM_TABLES_H

#include "beam.h"

enum {
    BEAM_DEGREE = 3,
    BEAM_KNOTS = BEAM_N + 2 + BEAM_DEGREE + 1, /* two splines at the clamp are left out */
    BEAM_REGIONS = 2,                          /* 0 beam, 1 patch */
    BEAM_SPAN_POINTS = 8                       /* quadrature of the laws over the span */
};

/* Bands: [i][d] = ∫ over the region of φᵢφᵢ₊d, of first or of second derivatives; symmetric, 0 beyond d = 3. */
struct beam_table {
    beam_real knots[BEAM_KNOTS];
    beam_real mass[BEAM_REGIONS][BEAM_N][BEAM_DEGREE + 1];      /* ∫ φᵢ φⱼ    m    */
    beam_real slope[BEAM_REGIONS][BEAM_N][BEAM_DEGREE + 1];     /* ∫ φᵢ' φⱼ'  1/m  */
    beam_real curvature[BEAM_REGIONS][BEAM_N][BEAM_DEGREE + 1]; /* ∫ φᵢ″ φⱼ″  1/m³ */
    beam_real load[BEAM_REGIONS][BEAM_N];                       /* ∫ φᵢ       m    */
};

struct beam_span {
    beam_real length_m, patch_from_m, patch_to_m;
    beam_real span_at_m[BEAM_SPAN_POINTS], span_weight_m[BEAM_SPAN_POINTS]; /* Gauss, split at the patch edges */
    int span_region[BEAM_SPAN_POINTS];
};

#define beam_tables         BEAM_NAME(tables)
#define beam_geometry_table BEAM_NAME(geometry_table)
extern const struct beam_table beam_tables[2]; /* by enum beam_basis */
extern const struct beam_span beam_geometry_table;

#endif
