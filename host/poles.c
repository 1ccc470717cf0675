/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "system_work.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "dense.h"

/* A pole whose imaginary part is smaller than this part of its size is real. */
static const double real_pole = 1e-9;
/* Two poles closer than this (relative) are one semisimple pole: their vectors do not mix. */
static const double same_pole = 1e-10;
/* Modes slower than this part of the fastest are scaled as if they had it: rigid modes have no ω of their own. */
static const double rigid_scale = 1e-6;

/* ---- First-order form in scaled undamped modal coordinates: x̂ = Ωx, v, and memory states ξ̂ ---- */

struct first_order {
    size_t n, dimension;
    double *A;       /* [dimension × dimension] */
    double *scale;   /* [n] Ω, kept away from 0 for rigid modes */
};

static bool has_memory(const struct block_use *use)
{
    return use->value[OF_MEMORY] < 0.0 || use->value[OF_MEMORY] > 0.0;
}

/* B in modal coordinates: ΦᵀBΦ. */
static void to_modal(const struct system *s, const double B[], double work[], double out[])
{
    dense_gemm(false, false, s->n, s->n, s->n, 1.0, B, s->modes, 0.0, work);
    dense_gemm(true, false, s->n, s->n, s->n, 1.0, s->modes, work, 0.0, out);
}

/* n memory states at `first`: ξ̂' = Ωv − ξ̂/τ, force −B Ω⁻¹ ξ̂ (B holds E). */
static void add_memory_form(struct first_order *f, const double B[], double tau, size_t first)
{
    size_t n = f->n, d = f->dimension;
    for (size_t j = 0; j < n; j++) {
        f->A[(first + j) + (n + j) * d] = f->scale[j];
        f->A[(first + j) + (first + j) * d] = -1.0 / tau;
        for (size_t i = 0; i < n; i++)
            f->A[(n + i) + (first + j) * d] = -B[i + j * n] / f->scale[j];
    }
}

/* One memory state for B = g gᵀ: ξ' = gᵀv − ξ/τ, force −E g ξ. */
static void add_memory_place(struct first_order *f, const double B[], double E, double tau, size_t first)
{
    size_t n = f->n, d = f->dimension, largest = 0;
    for (size_t i = 1; i < n; i++)
        if (B[i + i * n] > B[largest + largest * n])
            largest = i;
    double root = sqrt(B[largest + largest * n]); /* g = B(:, l)/√B(l, l) */
    if (!(root > 0.0))
        root = 1.0;
    f->A[first + first * d] = -1.0 / tau;
    for (size_t i = 0; i < n; i++) {
        f->A[first + (n + i) * d] = B[i + largest * n] / root;
        f->A[(n + i) + first * d] = -E * B[i + largest * n] / root;
    }
}

static bool same_term(const struct block *a, const struct block *b)
{
    return a->kind == b->kind && a->effect == b->effect && a->term == b->term;
}

/* A form has one block a material, all with one τ: they share the states of the first. */
static size_t memory_states(const struct system *s, size_t block)
{
    const struct block *blocks = s->reduced->blocks;
    if (!has_memory(&s->work->use[block]))
        return 0;
    if (blocks[block].kind == BLOCK_PLACE)
        return 1;
    for (size_t b = 0; b < block; b++)
        if (same_term(&blocks[b], &blocks[block]) && has_memory(&s->work->use[b]))
            return 0;
    return s->n;
}

/* Σ E B over the blocks of a term, in undamped modes. */
static void memory_matrix(const struct system *s, size_t block, double work[], double out[])
{
    size_t size = s->n * s->n;
    double *sum = bf_alloc(size, sizeof *sum);
    for (size_t b = block; b < s->reduced->n_blocks; b++) {
        const struct block_use *use = &s->work->use[b];
        if (same_term(&s->reduced->blocks[b], &s->reduced->blocks[block]) && has_memory(use))
            for (size_t i = 0; i < size; i++)
                sum[i] += use->value[OF_MEMORY] * use->B[i];
    }
    to_modal(s, sum, work, out);
    free(sum);
}

static struct first_order first_order_new(const struct system *s)
{
    size_t n = s->n;
    struct first_order f = {.n = n, .dimension = 2 * n};
    for (size_t b = 0; b < s->reduced->n_blocks; b++)
        f.dimension += memory_states(s, b);
    size_t d = f.dimension;
    f.A = bf_alloc(d * d, sizeof(double));
    f.scale = bf_alloc(n, sizeof(double));
    double *work = bf_alloc(2 * n * n, sizeof *work), *B = work + n * n;
    to_modal(s, s->C, work, B);
    for (size_t j = 0; j < n; j++) {
        f.scale[j] = fmax(s->omega_rad[j], rigid_scale * s->omega_rad[n - 1]);
        f.A[j + (n + j) * d] = f.scale[j];
        f.A[(n + j) + j * d] = -s->omega_rad[j] * s->omega_rad[j] / f.scale[j];
        for (size_t i = 0; i < n; i++)
            f.A[(n + i) + (n + j) * d] = -B[i + j * n];
    }
    size_t first = 2 * n;
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        size_t states = memory_states(s, b);
        if (states == 0)
            continue;
        const struct block_use *use = &s->work->use[b];
        if (s->reduced->blocks[b].kind == BLOCK_PLACE) {
            to_modal(s, use->B, work, B);
            add_memory_place(&f, B, use->value[OF_MEMORY], use->value[OF_RELAXATION], first);
        } else {
            memory_matrix(s, b, work, B);
            add_memory_form(&f, B, use->value[OF_RELAXATION], first);
        }
        first += states;
    }
    free(work);
    return f;
}

/* ---- Normalisation ---- */

/* φᵀ A(s) φ and φᵀ A'(s) φ from φᵀBφ of every block. */
static void quadratic_forms(const struct system *s, const double complex phi[], double complex at, double complex *A,
                            double complex *A_s)
{
    size_t n = s->n;
    *A = *A_s = 0.0;
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        const struct block_use *use = &s->work->use[b];
        double complex q = 0.0;
        for (size_t j = 0; j < n; j++) {
            double complex column = 0.0;
            for (size_t i = 0; i < n; i++)
                column += use->B[i + j * n] * phi[i];
            q += column * phi[j];
        }
        double complex t = 1.0 + at * use->value[OF_RELAXATION];
        *A += q * block_coefficient(use->value, at);
        *A_s += q * (2.0 * at * use->value[OF_MASS] + use->value[OF_DAMPING] +
                     use->value[OF_MEMORY] * use->value[OF_RELAXATION] / (t * t));
    }
}

/* φ from an eigenvector of the first-order form; one Newton step on p; scaled to φᵀA'(p)φ = 1. */
static enum bf_status finish_pole(struct system *s, const struct first_order *f, const double complex vector[],
                                  double complex value, size_t k, struct bf_error *err)
{
    size_t n = s->n;
    double complex *phi = s->phi + k * n, A, A_s;
    memset(phi, 0, n * sizeof *phi);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            phi[i] += s->modes[i + j * n] * (vector[j] / f->scale[j]);
    quadratic_forms(s, phi, value, &A, &A_s);
    if (!(cabs(A_s) > 0.0) || !isfinite(cabs(A_s)))
        return bf_fail(err, BF_NUMERIC, "two poles of the model coincide at %.4g%+.4gi 1/s", creal(value), cimag(value));
    double complex step = A / A_s;
    if (cabs(step) < 1e-6 * cabs(value))
        value -= step;
    s->p[k] = value;
    double complex scale = 1.0 / csqrt(A_s);
    for (size_t i = 0; i < n; i++)
        phi[i] *= scale;
    return BF_OK;
}

static bool is_real(double complex p)
{
    return fabs(cimag(p)) <= real_pole * cabs(p);
}

static enum bf_status collect(struct system *s, const struct first_order *f, const double complex values[],
                              const double complex vectors[], struct bf_error *err)
{
    size_t d = f->dimension, k = 0;
    s->p = bf_grow(s->p, d, sizeof *s->p);
    s->phi = bf_grow(s->phi, d * s->n, sizeof *s->phi);
    enum bf_status status = BF_OK;
    for (int reals = 0; reals < 2; reals++) {
        for (size_t i = 0; status == BF_OK && i < d; i++) {
            bool real = is_real(values[i]);
            if (real == (reals == 1) && (real || cimag(values[i]) > 0.0))
                status = finish_pole(s, f, vectors + i * d, values[i], k++, err);
        }
        if (reals == 0)
            s->n_pairs = k;
    }
    s->n_poles = k;
    s->n_all = s->n_pairs + k;
    return status;
}

enum bf_status poles_compute(struct system *s, struct bf_error *err)
{
    struct first_order f = first_order_new(s);
    size_t d = f.dimension;
    double complex *values = bf_alloc(d, sizeof *values), *vectors = bf_alloc(d * d, sizeof *vectors);
    enum bf_status status = dense_general_eigen(d, f.A, values, NULL, vectors, err);
    if (status == BF_OK)
        status = collect(s, &f, values, vectors, err);
    free(values);
    free(vectors);
    free(f.A);
    free(f.scale);
    return status;
}

/* ---- Derivatives ---- */

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
    double complex *W_s; /* [n_poles] W'_kk */
};

static void add_change(const struct system *s, const struct block_use *use, const double d[COEFFICIENTS],
                       const double complex Q[], struct pole_change *change)
{
    for (size_t k = 0; k < s->n_poles; k++) {
        double complex a, a_s;
        coefficient_change(use->value, d, s->p[k], &a, &a_s);
        change->W_s[k] += a_s * Q[k + k * s->n_all];
        for (size_t j = 0; j < s->n_all; j++)
            change->W[j + k * s->n_all] += a * Q[j + k * s->n_all];
    }
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
    double *dK = bf_alloc(4 * n * n, sizeof *dK), *dM = dK + n * n, *work = dM + n * n, *X = work + n * n;
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        const struct block_use *use = &s->work->use[b];
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
    }
    to_modal(s, dK, work, X);
    to_modal(s, dM, work, dK);
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

/* Z and δp of one parameter from its W. */
static void finish_derivative(const struct system *s, const struct pole_change *change, struct pole_derivative *out)
{
    size_t J = s->n_all, P = s->n_poles;
    out->p = bf_grow(out->p, P, sizeof *out->p);
    out->Z = bf_grow(out->Z, J * P, sizeof *out->Z);
    for (size_t k = 0; k < P; k++) {
        out->p[k] = -change->W[k + k * J];
        for (size_t j = 0; j < J; j++) {
            double complex pj = j < P ? s->p[j] : conj(s->p[j - P]);
            double complex gap = s->p[k] - pj;
            double complex z = 0.5 * change->W_s[k];
            if (j != k)
                z = cabs(gap) > same_pole * cabs(pj) ? change->W[j + k * J] / gap : 0.0;
            out->Z[j + k * J] = z;
        }
    }
}

static bool depends_on(const struct system *s, size_t parameter)
{
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        const struct block_use *use = &s->work->use[b];
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
    const struct block_use *use = &s->work->use[b];
    for (size_t d = 0; d < use->n_dependencies; d++)
        if (use->dependency[d].parameter == parameter)
            add_change(s, use, use->dependency[d].d, Q, change);
    if (use->position == parameter)
        add_move(s, use, Q_at, change);
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
        add_change(s, &s->work->use[b], s->work->use[b].value, Q, change);
        free(X);
    }
}

enum bf_status poles_differentiate(struct system *s, const bool want[], struct bf_error *err)
{
    (void)err;
    size_t J = s->n_all, P = s->n_poles, n_blocks = s->reduced->n_blocks, size = J * P;
    double *work = bf_alloc(4 * s->n * P + 4 * P * P, sizeof *work);
    double complex *Q = bf_alloc((2 * n_blocks + 1) * size, sizeof *Q), *Q_at = Q + n_blocks * size;
    struct pole_change change = {.W = bf_alloc(size, sizeof *Q), .W_s = bf_alloc(P, sizeof *Q)};
    for (size_t b = 0; b < n_blocks; b++) {
        pole_products(s, s->work->use[b].B, work, Q + b * size);
        if (s->work->use[b].position != SIZE_MAX)
            pole_products(s, s->work->use[b].B_at, work, Q_at + b * size);
    }
    for (size_t i = 0; i < s->map->n; i++) {
        if (!want[i] || !depends_on(s, i))
            continue;
        memset(change.W, 0, size * sizeof *change.W);
        memset(change.W_s, 0, P * sizeof *change.W_s);
        for (size_t b = 0; b < n_blocks; b++)
            add_block_changes(s, i, b, Q + b * size, Q_at + b * size, &change);
        add_modal_changes(s, i, work, Q_at + n_blocks * size, &change);
        finish_derivative(s, &change, &s->derivative[i]);
    }
    free(change.W);
    free(change.W_s);
    free(Q);
    free(work);
    return BF_OK;
}

void system_functional(const struct system *s, const double g[], double complex alpha[])
{
    for (size_t k = 0; k < s->n_poles; k++) {
        double re = 0.0, im = 0.0;
        for (size_t i = 0; i < s->n; i++) {
            re += g[i] * creal(s->phi[i + k * s->n]);
            im += g[i] * cimag(s->phi[i + k * s->n]);
        }
        alpha[k] = CMPLX(re, im);
    }
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
