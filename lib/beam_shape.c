/* SPDX-License-Identifier: MIT */
/* Values of the built-in B-splines (Cox, de Boor; derivatives by differences of the knots). */
#include "beam_tables.h"

enum { SPLINES = BEAM_N + 2 };

beam_real beam_length(void)
{
    return beam_geometry_table.length_m;
}

/* b[i] = the i-th spline of this degree at x; zero where its support does not hold x. */
static void splines(const beam_real t[BEAM_KNOTS], int degree, beam_real x, beam_real b[BEAM_KNOTS])
{
    int piece = BEAM_DEGREE;
    for (int i = 0; i < BEAM_KNOTS; i++)
        b[i] = BEAM_K(0.0);
    while (piece < SPLINES - 1 && !beam_less(x, t[piece + 1]))
        piece++;
    b[piece] = BEAM_K(1.0);
    for (int d = 1; d <= degree; d++)
        for (int i = piece - d; i <= piece; i++) {
            const beam_real left_width = t[i + d] - t[i], right_width = t[i + d + 1] - t[i + 1];
            beam_real value = BEAM_K(0.0);
            if (beam_less(BEAM_K(0.0), left_width))
                value += (x - t[i]) / left_width * b[i];
            if (beam_less(BEAM_K(0.0), right_width))
                value += (t[i + d + 1] - x) / right_width * b[i + 1];
            b[i] = value;
        }
}

enum beam_status beam_shape(enum beam_basis basis, beam_real x_m, int derivative, beam_real out[BEAM_N])
{
    beam_real b[BEAM_KNOTS];
    if ((basis != BEAM_BASIS_UNIFORM && basis != BEAM_BASIS_PATCH) || derivative < 0 || derivative > 2)
        return BEAM_ERROR_ARGUMENT;
    if (!beam_finite(x_m) || beam_less(x_m, BEAM_K(0.0)) || beam_less(beam_geometry_table.length_m, x_m))
        return BEAM_ERROR_PLACE;
    const beam_real *t = beam_tables[basis].knots;
    splines(t, BEAM_DEGREE - derivative, x_m, b);
    for (int d = BEAM_DEGREE - derivative + 1; d <= BEAM_DEGREE;
         d++) /* Bᵢ' = d (Bᵢ/(tᵢ₊d − tᵢ) − Bᵢ₊₁/(tᵢ₊d₊₁ − tᵢ₊₁)) */
        for (int i = 0; i < BEAM_KNOTS - d - 1; i++) {
            const beam_real left_width = t[i + d] - t[i], right_width = t[i + d + 1] - t[i + 1];
            beam_real value = BEAM_K(0.0);
            if (beam_less(BEAM_K(0.0), left_width))
                value += b[i] / left_width;
            if (beam_less(BEAM_K(0.0), right_width))
                value -= b[i + 1] / right_width;
            b[i] = (beam_real)d * value;
        }
    for (int i = 0; i < BEAM_N; i++)
        out[i] = b[i + 2];
    return BEAM_OK;
}
