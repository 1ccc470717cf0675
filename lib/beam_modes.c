/* SPDX-License-Identifier: MIT */
/* Undamped modes of K ψ = ω² M ψ: Cholesky of K (of K + σM when the beam can move freely), then Jacobi. */
#include "beam_modal.h"

#ifdef BEAM_FLOAT
#define RIGID BEAM_K(0.1) /* share of the shift σ below which ω² counts as zero */
#else
#define RIGID BEAM_K(1e-6)
#endif

void beam_modal_form(const struct beam_modes *modes, const beam_real x[BEAM_N][BEAM_N], beam_real out[BEAM_N][BEAM_N])
{
    for (int j = 0; j < BEAM_N; j++) {
        beam_real column[BEAM_N];
        for (int i = 0; i < BEAM_N; i++) {
            column[i] = BEAM_K(0.0);
            for (int k = 0; k < BEAM_N; k++)
                column[i] += x[i][k] * modes->shape[k][j];
        }
        for (int i = 0; i < BEAM_N; i++) {
            out[i][j] = BEAM_K(0.0);
            for (int k = 0; k < BEAM_N; k++)
                out[i][j] += modes->shape[k][i] * column[k];
        }
    }
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < i; j++)
            out[i][j] = out[j][i] = BEAM_K(0.5) * (out[i][j] + out[j][i]);
}

/* L of K + σM = LLᵀ; 0 when that is positive definite. */
static int factor_stiffness(const struct beam_model *model, beam_real shift, beam_real l[BEAM_N][BEAM_N])
{
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            l[i][j] = model->K[i][j] + shift * model->M[i][j];
    return beam_cholesky(BEAM_N, BEAM_N, l[0]);
}

/* b = L⁻¹ M L⁻ᵀ */
static void reduce(const struct beam_model *model, beam_real l[BEAM_N][BEAM_N], beam_real b[BEAM_N][BEAM_N])
{
    for (int i = 0; i < BEAM_N; i++) { /* row i: column i of L⁻¹M */
        for (int j = 0; j < BEAM_N; j++)
            b[i][j] = model->M[i][j];
        beam_lower_solve(BEAM_N, BEAM_N, l[0], b[i]);
    }
    for (int j = 0; j < BEAM_N; j++) {
        beam_real column[BEAM_N];
        for (int i = 0; i < BEAM_N; i++)
            column[i] = b[i][j];
        beam_lower_solve(BEAM_N, BEAM_N, l[0], column);
        for (int i = 0; i < BEAM_N; i++)
            b[i][j] = column[i];
    }
}

enum beam_status beam_find_modes(const struct beam_model *model, struct beam_modes *out)
{
    beam_real l[BEAM_N][BEAM_N], b[BEAM_N][BEAM_N], vectors[BEAM_N][BEAM_N], inverse[BEAM_N];
    beam_real trace_m = BEAM_K(0.0), trace_k = BEAM_K(0.0), shift = BEAM_K(0.0);
    for (int i = 0; i < BEAM_N; i++) {
        trace_m += model->M[i][i];
        trace_k += model->K[i][i];
        for (int j = 0; j < BEAM_N; j++)
            l[i][j] = model->M[i][j];
    }
    if (beam_cholesky(BEAM_N, BEAM_N, l[0]) != 0)
        return BEAM_ERROR_MASS;
    if (factor_stiffness(model, shift, l) != 0) {
        shift = BEAM_K(1e-6) * trace_k / trace_m;
        if (!beam_less(BEAM_K(0.0), shift) || factor_stiffness(model, shift, l) != 0)
            return BEAM_ERROR_STIFFNESS;
    }
    reduce(model, l, b);
    if (beam_symmetric_eigen(BEAM_N, BEAM_N, b[0], vectors[0], inverse) != 0)
        return BEAM_ERROR_STIFFNESS;
    for (int j = 0; j < BEAM_N; j++) { /* largest 1/(ω² + σ) first: lowest mode first */
        const int from = BEAM_N - 1 - j;
        beam_real x[BEAM_N];
        if (!beam_less(BEAM_K(0.0), inverse[from]))
            return BEAM_ERROR_MASS;
        const beam_real square = BEAM_K(1.0) / inverse[from] - shift; /* ω² */
        if (beam_less(square, -RIGID * shift))
            return BEAM_ERROR_STIFFNESS;
        out->omega_radps[j] = beam_less(RIGID * shift, square) ? beam_sqrt(square) : BEAM_K(0.0);
        for (int i = 0; i < BEAM_N; i++)
            x[i] = vectors[i][from];
        beam_lower_transposed_solve(BEAM_N, BEAM_N, l[0], x);
        for (int i = 0; i < BEAM_N; i++)
            out->shape[i][j] = x[i] / beam_sqrt(inverse[from]);
    }
    return BEAM_OK;
}
