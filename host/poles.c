/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "system_work.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "dense.h"

/* A pole whose imaginary part is smaller than this part of its size is real. */
static const double real_pole = 1e-9;
/* Modes slower than this part of the fastest are scaled as if they had it: rigid modes have no ω of their own. */
static const double rigid_scale = 1e-6;

/* ---- First-order form in scaled undamped modal coordinates: x̂ = Ωx, v, and memory states ξ̂ ---- */

struct first_order {
    size_t n, dimension;
    double *A;     /* [dimension × dimension] */
    double *scale; /* [n] Ω, kept away from 0 for rigid modes */
};

static bool has_memory(const struct block_use *use)
{
    return use->value[OF_MEMORY] < 0.0 || use->value[OF_MEMORY] > 0.0;
}

void system_to_modal(const struct system *s, const double B[], double work[], double out[])
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
    system_to_modal(s, sum, work, out);
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
    system_to_modal(s, s->C, work, B);
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
            system_to_modal(s, use->B, work, B);
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
        return bf_fail(err, BF_NUMERIC, "two poles of the model coincide at %.4g%+.4gi 1/s", creal(value),
                       cimag(value));
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
