/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "beam.h"
#include "poles.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* But for rounding it is: what does not cancel of W_jk − W_kj a rigid motion with light damping would show large. */
static void make_symmetric(size_t n, double G[])
{
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < k; j++)
            G[j + k * n] = G[k + j * n] = 0.5 * (G[j + k * n] + G[k + j * n]);
}

/* Q[n_all × n_poles] = φ_allᵀ B φ through one real product of [Re φ, Im φ]. */
static void pole_products(const struct system *s, const double B[], double work[], double complex Q[])
{
    size_t n = s->n, P = s->n_poles, m = 2 * P;
    double *R = work, *BR = R + n * m, *G = BR + n * m;
    for (size_t k = 0; k < P; k++) {
        for (size_t i = 0; i < n; i++) {
            R[i + k * n] = creal(s->phi[i + k * n]);
            R[i + (P + k) * n] = cimag(s->phi[i + k * n]);
        }
    }
    dense_gemm(false, false, n, m, n, 1.0, B, R, 0.0, BR);
    dense_gemm(true, false, m, m, n, 1.0, R, BR, 0.0, G);
    make_symmetric(m, G);
    for (size_t k = 0; k < P; k++) {
        for (size_t j = 0; j < P; j++) {
            double rr = G[j + k * m], ii = G[(P + j) + (P + k) * m];
            double ri = G[j + (P + k) * m], ir = G[(P + j) + k * m];
            Q[j + k * s->n_all] = CMPLX(rr - ii, ri + ir);
            if (j < s->n_pairs)
                Q[P + j + k * s->n_all] = CMPLX(rr + ii, ri - ir); /* conj(φ_j)ᵀ B φ_k */
        }
    }
}

/* δa(s) and δa'(s) of a block for changes d of its coefficients. */
static void coefficient_change(const double value[COEFFICIENTS], const double d[COEFFICIENTS], double complex s,
                               double complex *a, double complex *a_s)
{
    double tau = value[OF_RELAXATION];
    double complex t = 1.0 / (1.0 + s * tau);
    *a = (s * d[OF_MASS] + d[OF_DAMPING]) * s + d[OF_STIFFNESS] + d[OF_MEMORY] * s * tau * t +
         value[OF_MEMORY] * d[OF_RELAXATION] * s * t * t;
    *a_s = 2.0 * s * d[OF_MASS] + d[OF_DAMPING] + d[OF_MEMORY] * tau * t * t +
           value[OF_MEMORY] * d[OF_RELAXATION] * (1.0 - s * tau) * t * t * t;
}

struct pole_change {
    double complex *W;   /* [n_all × n_poles] */
    double complex *W_s; /* [n_poles × n_poles] W' of poles in one cluster */
};

static void add_change(const struct system *s, const struct block_use *use, const double d[COEFFICIENTS],
                       const double complex Q[], struct pole_change *change)
{
    for (size_t k = 0; k < s->n_poles; k++) {
        double complex a, a_s;
        coefficient_change(use->value, d, s->p[k], &a, &a_s);
        for (size_t j = 0; j < s->n_all; j++)
            change->W[j + k * s->n_all] += a * Q[j + k * s->n_all];
        for (size_t j = s->cluster[k]; j < s->n_poles; j++)
            if (s->cluster[j] == s->cluster[k])
                change->W_s[j + k * s->n_poles] += a_s * Q[j + k * s->n_all];
    }
}

/* dd/d parameter of a space that moves by d, and the blocks' derivatives by d; 0: it does not. */
static double move_by(const struct system *s, size_t parameter, double *const **block_by)
{
    for (int g = 0; g < MODEL_MOVES; g++) {
        *block_by = s->block_by_move[g];
        const double by = *block_by != NULL ? s->move_by[parameter * MODEL_MOVES + (size_t)g] : 0.0;
        if (by < 0.0 || by > 0.0)
            return by;
    }
    return 0.0;
}

/* A moved place: δA = a(s) dB/d(at). */
static void add_move(const struct system *s, const struct block_use *use, const double complex Q[],
                     struct pole_change *change)
{
    const double zero_memory[COEFFICIENTS] = {use->value[OF_MASS], use->value[OF_DAMPING], use->value[OF_STIFFNESS],
                                              use->value[OF_MEMORY], 0.0};
    add_change(s, use, zero_memory, Q, change);
}

/* δX of hysteretic damping: X M⁻¹ X = K, so in undamped modes δX_ij = (δK_ij + ω_i ω_j δM_ij)/(ω_i + ω_j). */
static void modal_damping_change(const struct system *s, size_t parameter, double out[])
{
    size_t n = s->n;
    double *const *block_by;
    const double by = move_by(s, parameter, &block_by);
    double *dK = bf_alloc(4 * n * n, sizeof *dK), *dM = dK + n * n, *work = dM + n * n, *X = work + n * n;
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        const struct block_use *use = &s->use[b];
        for (size_t i = 0; i < use->n_dependencies; i++) {
            if (use->dependency[i].parameter != parameter || s->reduced->blocks[b].kind == BLOCK_MODES)
                continue;
            for (size_t e = 0; e < n * n; e++) {
                dK[e] += use->dependency[i].d[OF_STIFFNESS] * use->B[e];
                dM[e] += use->dependency[i].d[OF_MASS] * use->B[e];
            }
        }
        for (size_t e = 0; use->position == parameter && e < n * n; e++) {
            dK[e] += use->value[OF_STIFFNESS] * use->B_at[e];
            dM[e] += use->value[OF_MASS] * use->B_at[e];
        }
        for (size_t e = 0; (by < 0.0 || by > 0.0) && block_by[b] != NULL && e < n * n; e++) {
            dK[e] += by * use->value[OF_STIFFNESS] * block_by[b][e];
            dM[e] += by * use->value[OF_MASS] * block_by[b][e];
        }
    }
    system_to_modal(s, dK, work, X);
    system_to_modal(s, dM, work, dK);
    for (size_t j = 0; j < n; j++) {
        for (size_t i = 0; i < n; i++) {
            double wi = s->omega_rad[i], wj = s->omega_rad[j], sum = wi + wj;
            X[i + j * n] = sum > 0.0 ? (X[i + j * n] + wi * wj * dK[i + j * n]) / sum : 0.0;
        }
    }
    dense_gemm(false, false, n, n, n, 1.0, s->M, s->modes, 0.0, work); /* M Φ takes modal coordinates back */
    dense_gemm(false, false, n, n, n, 1.0, work, X, 0.0, dM);
    dense_gemm(false, true, n, n, n, 1.0, dM, work, 0.0, out);
    free(dK);
}

/*
 * Z_jk of poles that nearly coincide: W_jk/(p_k − p_j) with its symmetric part, which keeps their vectors apart, as the derivative that it tends to,
 * ½ (W_jk − W_kj)/(p_k − p_j) → ½ W'_jk.
 */
static double complex together(const struct system *s, const struct pole_change *change, size_t j, size_t k)
{
    const double complex W_s = change->W_s[j + k * s->n_poles];
    if (j == k)
        return 0.5 * W_s;
    return 0.5 * (W_s + (change->W[j + k * s->n_all] + change->W[k + j * s->n_all]) / (s->p[k] - s->p[j]));
}

/* Z and δp of one parameter from its W. */
static void finish_derivative(const struct system *s, const struct pole_change *change, struct pole_derivative *out)
{
    size_t J = s->n_all, P = s->n_poles;
    out->p = bf_grow(out->p, P, sizeof *out->p);
    out->Z = bf_grow(out->Z, J * P, sizeof *out->Z);
    for (size_t k = 0; k < P; k++) {
        out->p[k] = -change->W[k + k * J];
        for (size_t j = 0; j < J; j++) {
            const double complex pj = j < P ? s->p[j] : conj(s->p[j - P]);
            if (j < P && s->cluster[j] == s->cluster[k])
                out->Z[j + k * J] = together(s, change, j, k);
            else
                out->Z[j + k * J] = change->W[j + k * J] / (s->p[k] - pj);
        }
    }
}

static bool depends_on(const struct system *s, size_t parameter)
{
    double *const *block_by;
    const double by = move_by(s, parameter, &block_by);
    if (by < 0.0 || by > 0.0)
        return true;
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        const struct block_use *use = &s->use[b];
        if (use->position == parameter)
            return true;
        for (size_t i = 0; i < use->n_dependencies; i++)
            if (use->dependency[i].parameter == parameter)
                return true;
    }
    return false;
}

static void add_block_changes(const struct system *s, size_t parameter, size_t b, const double complex Q[],
                              const double complex Q_at[], struct pole_change *change)
{
    const struct block_use *use = &s->use[b];
    for (size_t d = 0; d < use->n_dependencies; d++)
        if (use->dependency[d].parameter == parameter)
            add_change(s, use, use->dependency[d].d, Q, change);
    if (use->position == parameter)
        add_move(s, use, Q_at, change);
}

/* The whole space moves. */
static void add_shift(const struct system *s, size_t parameter, double work[], double complex Q[],
                      struct pole_change *change)
{
    double *const *block_by;
    const double by = move_by(s, parameter, &block_by);
    for (size_t b = 0; (by < 0.0 || by > 0.0) && b < s->reduced->n_blocks; b++) {
        if (block_by[b] == NULL)
            continue;
        double scaled[COEFFICIENTS];
        const double *value = s->use[b].value;
        for (int c = 0; c < COEFFICIENTS; c++)
            scaled[c] = c == OF_RELAXATION ? 0.0 : by * value[c];
        pole_products(s, block_by[b], work, Q);
        add_change(s, &s->use[b], scaled, Q, change);
    }
}

static void add_modal_changes(const struct system *s, size_t parameter, double work[], double complex Q[],
                              struct pole_change *change)
{
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        if (s->reduced->blocks[b].kind != BLOCK_MODES)
            continue;
        double *X = bf_alloc(s->n * s->n, sizeof *X);
        modal_damping_change(s, parameter, X);
        pole_products(s, X, work, Q);
        add_change(s, &s->use[b], s->use[b].value, Q, change);
        free(X);
    }
}

enum bf_status poles_differentiate(struct system *s, const bool want[], struct bf_error *err)
{
    (void)err;
    size_t J = s->n_all, P = s->n_poles, n_blocks = s->reduced->n_blocks, size = J * P;
    double *work = bf_alloc(4 * s->n * P + 4 * P * P, sizeof *work);
    double complex *Q = bf_alloc((2 * n_blocks + 1) * size, sizeof *Q), *Q_at = Q + n_blocks * size;
    struct pole_change change = {.W = bf_alloc(size, sizeof *Q), .W_s = bf_alloc(P * P, sizeof *Q)};
    for (size_t b = 0; b < n_blocks; b++) {
        pole_products(s, s->use[b].B, work, Q + b * size);
        if (s->use[b].position != SIZE_MAX)
            pole_products(s, s->use[b].B_at, work, Q_at + b * size);
    }
    for (size_t i = 0; i < s->map->n; i++) {
        if (!want[i] || !depends_on(s, i))
            continue;
        memset(change.W, 0, size * sizeof *change.W);
        memset(change.W_s, 0, P * P * sizeof *change.W_s);
        for (size_t b = 0; b < n_blocks; b++)
            add_block_changes(s, i, b, Q + b * size, Q_at + b * size, &change);
        add_shift(s, i, work, Q_at + n_blocks * size, &change);
        add_modal_changes(s, i, work, Q_at + n_blocks * size, &change);
        finish_derivative(s, &change, &s->derivative[i]);
    }
    free(change.W);
    free(change.W_s);
    free(Q);
    free(work);
    return BF_OK;
}

void system_functional_derivative(const struct system *s, size_t i, const double complex alpha[],
                                  double complex d_alpha[])
{
    const double complex *Z = s->derivative[i].Z;
    size_t P = s->n_poles, J = s->n_all;
    for (size_t k = 0; k < P; k++) {
        double complex sum = 0.0;
        for (size_t j = 0; Z != NULL && j < J; j++)
            sum -= (j < P ? alpha[j] : conj(alpha[j - P])) * Z[j + k * J];
        d_alpha[k] = sum;
    }
}
