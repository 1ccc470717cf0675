/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "beam.h"
#include "poles.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* A pole whose imaginary part is smaller than this part of its size is real. */
static const double real_pole = 1e-9;
/* Modes slower than this part of the fastest are scaled as if they had it: rigid modes have no ω of their own. */
static const double rigid_scale = 1e-6;

/* Real poles that are nearer to each other than this part of the fastest ω have computed vectors that may be any of their span. */
static const double nearly_coincide = 1e-8;
/* The poles are put this part of it apart, once their vectors are scaled: a change of the model may part them in other directions. */
static const double least_gap = 1e-11;

/* A direction whose part in a memory term is smaller than this part of the largest has no memory. */
static const double no_memory = 1e-7;

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

/* Σ E B of all blocks with one τ as Σ_r λ_r (Ωq_r)(Ωq_r)ᵀ in undamped modes: one memory state for each r. */
struct memory {
    size_t rank;
    double tau;
    double *lambda, *q; /* [rank], [rank][n] */
};

/* Both have memory, and the same: apart, two effects with one τ would be poles that coincide. */
static bool same_memory(const struct block_use *a, const struct block_use *b)
{
    return has_memory(a) && has_memory(b) && !(a->value[OF_RELAXATION] < b->value[OF_RELAXATION]) &&
           !(a->value[OF_RELAXATION] > b->value[OF_RELAXATION]);
}

/* The first block with its τ leads: the materials of one form, and effects that happen to have one τ. */
static bool leads_memory(const struct system *s, size_t block)
{
    for (size_t b = 0; b < block; b++)
        if (same_memory(&s->use[b], &s->use[block]))
            return false;
    return has_memory(&s->use[block]);
}

/* Ω⁻¹ Φᵀ(Σ E B)Φ Ω⁻¹ over the blocks with one τ. */
static void memory_matrix(const struct system *s, size_t block, const double scale[], double out[])
{
    size_t n = s->n, size = n * n;
    double *sum = bf_alloc(2 * size, sizeof *sum);
    for (size_t b = block; b < s->reduced->n_blocks; b++) {
        const struct block_use *use = &s->use[b];
        if (same_memory(use, &s->use[block]))
            for (size_t i = 0; i < size; i++)
                sum[i] += use->value[OF_MEMORY] * use->B[i];
    }
    system_to_modal(s, sum, sum + size, out);
    for (size_t i = 0; i < size; i++)
        out[i] /= scale[i % n] * scale[i / n];
    free(sum);
}

/* Directions without memory get no state: it would be a pole at exactly −1/τ that nothing sees. */
static enum bf_status memory_new(const struct system *s, size_t block, const double scale[], struct memory *out,
                                 struct bf_error *err)
{
    size_t n = s->n;
    double *B = bf_alloc(2 * n * n, sizeof *B), *vectors = B + n * n;
    *out = (struct memory){.tau = s->use[block].value[OF_RELAXATION]};
    out->lambda = bf_alloc(n, sizeof(double));
    out->q = bf_alloc(n * n, sizeof(double));
    double *values = bf_alloc(n, sizeof *values);
    memory_matrix(s, block, scale, B);
    enum bf_status status = dense_symmetric_eigen(n, B, NULL, values, vectors, err);
    double largest = fmax(fabs(values[0]), fabs(values[n - 1]));
    for (size_t k = 0; status == BF_OK && k < n; k++) {
        if (fabs(values[k]) <= no_memory * largest)
            continue;
        memcpy(out->q + out->rank * n, vectors + k * n, n * sizeof *out->q);
        out->lambda[out->rank++] = values[k];
    }
    free(B);
    free(values);
    return status;
}

/* ξ' = (Ωq)ᵀv − ξ/τ, force −λ Ωq ξ. */
static void add_memory(struct first_order *f, const struct memory *memory, size_t first)
{
    size_t n = f->n, d = f->dimension;
    for (size_t r = 0; r < memory->rank; r++) {
        size_t state = first + r;
        f->A[state + state * d] = -1.0 / memory->tau;
        for (size_t i = 0; i < n; i++) {
            double g = f->scale[i] * memory->q[r * n + i];
            f->A[state + (n + i) * d] = g;
            f->A[(n + i) + state * d] = -memory->lambda[r] * g;
        }
    }
}

static void fill_motion(const struct system *s, struct first_order *f)
{
    size_t n = f->n, d = f->dimension;
    double *work = bf_alloc(2 * n * n, sizeof *work), *C = work + n * n;
    system_to_modal(s, s->C, work, C);
    for (size_t j = 0; j < n; j++) {
        f->A[j + (n + j) * d] = f->scale[j];
        f->A[(n + j) + j * d] = -s->omega_rad[j] * s->omega_rad[j] / f->scale[j];
        for (size_t i = 0; i < n; i++)
            f->A[(n + i) + (n + j) * d] = -C[i + j * n];
    }
    free(work);
}

static enum bf_status first_order_new(const struct system *s, struct first_order *f, struct bf_error *err)
{
    size_t n = s->n, n_blocks = s->reduced->n_blocks;
    *f = (struct first_order){.n = n, .dimension = 2 * n};
    f->scale = bf_alloc(n, sizeof(double));
    for (size_t j = 0; j < n; j++)
        f->scale[j] = fmax(s->omega_rad[j], rigid_scale * s->omega_rad[n - 1]);
    struct memory *memory = bf_alloc(n_blocks, sizeof *memory);
    enum bf_status status = BF_OK;
    for (size_t b = 0; status == BF_OK && b < n_blocks; b++) {
        if (leads_memory(s, b))
            status = memory_new(s, b, f->scale, &memory[b], err);
        f->dimension += memory[b].rank;
    }
    f->A = bf_alloc(f->dimension * f->dimension, sizeof(double));
    fill_motion(s, f);
    for (size_t b = 0, first = 2 * n; b < n_blocks; first += memory[b++].rank) {
        add_memory(f, &memory[b], first);
        free(memory[b].lambda);
        free(memory[b].q);
    }
    free(memory);
    return status;
}

/* ---- Normalisation ---- */

/* ψᵀ A(s) φ and ψᵀ A'(s) φ from ψᵀBφ of every block. */
static void bilinear_forms(const struct system *s, const double complex psi[], const double complex phi[],
                           double complex at, double complex *A, double complex *A_s)
{
    size_t n = s->n;
    *A = *A_s = 0.0;
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        const struct block_use *use = &s->use[b];
        double complex q = 0.0;
        for (size_t j = 0; j < n; j++) {
            double complex column = 0.0;
            for (size_t i = 0; i < n; i++)
                column += use->B[i + j * n] * psi[i];
            q += column * phi[j];
        }
        double complex t = 1.0 + at * use->value[OF_RELAXATION];
        *A += q * block_coefficient(use->value, at);
        *A_s += q * (2.0 * at * use->value[OF_MASS] + use->value[OF_DAMPING] +
                     use->value[OF_MEMORY] * use->value[OF_RELAXATION] / (t * t));
    }
}

/*
 * Of poles that differ, ψᵀ (A(p) − A(q))/(p − q) φ is 0. Where two nearly coincide the eigenvectors are any of their span, and are made so; the
 * divided difference is A' half-way then.
 */
static void separate(struct system *s, double complex value, size_t k)
{
    const double fastest = s->omega_rad[s->n - 1];
    double complex *phi = s->phi + k * s->n;
    for (size_t j = k; j-- > s->n_pairs;) {
        if (cabs(value - s->p[j]) > nearly_coincide * fastest)
            continue;
        double complex A, A_s;
        const double complex *psi = s->phi + j * s->n;
        bilinear_forms(s, psi, phi, 0.5 * (value + s->p[j]), &A, &A_s);
        for (size_t i = 0; i < s->n; i++)
            phi[i] -= A_s * psi[i];
        s->cluster[k] = s->cluster[j];
    }
}

static void keep_apart(struct system *s, size_t k)
{
    const double gap = least_gap * s->omega_rad[s->n - 1];
    for (size_t j = s->cluster[k]; j < k; j++)
        if (s->cluster[j] == s->cluster[k] && cabs(s->p[k] - s->p[j]) < gap)
            s->p[k] = s->p[j] - gap;
}

/* φ from an eigenvector of the first-order form; one Newton step on p; scaled to φᵀA'(p)φ = 1. */
static enum bf_status finish_pole(struct system *s, const struct first_order *f, const double complex vector[],
                                  double complex value, bool real, size_t k, struct bf_error *err)
{
    size_t n = s->n;
    double complex *phi = s->phi + k * n, A, A_s;
    memset(phi, 0, n * sizeof *phi);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            phi[i] += s->modes[i + j * n] * (vector[j] / f->scale[j]);
    s->cluster[k] = k;
    if (real)
        separate(s, value, k);
    bilinear_forms(s, phi, phi, value, &A, &A_s);
    if (!(cabs(A_s) > 0.0) || !isfinite(cabs(A_s)))
        return bf_fail(err, BF_NUMERIC, "two poles of the model coincide at %.4g%+.4gi 1/s", creal(value),
                       cimag(value));
    double complex step = A / A_s;
    if (cabs(step) < 1e-6 * cabs(value))
        value -= step;
    s->p[k] = value;
    keep_apart(s, k);
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
    s->cluster = bf_grow(s->cluster, d, sizeof *s->cluster);
    enum bf_status status = BF_OK;
    for (int reals = 0; reals < 2; reals++) {
        for (size_t i = 0; status == BF_OK && i < d; i++) {
            bool real = is_real(values[i]);
            if (real == (reals == 1) && (real || cimag(values[i]) > 0.0))
                status = finish_pole(s, f, vectors + i * d, values[i], real, k++, err);
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
    struct first_order f;
    enum bf_status status = first_order_new(s, &f, err);
    size_t d = f.dimension;
    double complex *values = bf_alloc(d, sizeof *values), *vectors = bf_alloc(d * d, sizeof *vectors);
    if (status == BF_OK)
        status = dense_general_eigen(d, f.A, values, NULL, vectors, err);
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
