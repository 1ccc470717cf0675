/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_poles.c — better poles: the derivative of what is left by them, and one step of vector fitting. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Derivative by the poles: Gauss–Newton ---- */

/*
 * With φ₁ = ω²/q, φ₂ = ωs/q, d₁ = ω⁴/q², d₂ = ω³s/q² and y = αφ₁ + βφ₂:
 *     ∂y/∂ln ω = α(2φ₁ − 2d₁) + β(φ₂ − 2d₂)
 *     ∂y/∂ln a = −2ζα d₂ + β(4ζ² d₂ + 2ζ d₁ − 2ζ φ₁),   2ζ = 2a/ω.
 */
static void add_pair(const struct attainable_part *part, const double x[2], const double c[2], size_t phi, size_t d,
                     size_t stride, double V[], size_t k)
{
    const double w = part->weight, alpha = w * c[0], beta = w * c[1], zeta2 = 2.0 * exp(x[1] - x[0]);
    attainable_add_rows(part, 2.0 * alpha, phi, stride, V, 2 * k);
    attainable_add_rows(part, beta, phi + 1, stride, V, 2 * k);
    attainable_add_rows(part, -2.0 * alpha, d, stride, V, 2 * k);
    attainable_add_rows(part, -2.0 * beta, d + 1, stride, V, 2 * k);
    attainable_add_rows(part, -zeta2 * beta, phi, stride, V, 2 * k + 1);
    attainable_add_rows(part, zeta2 * beta, d, stride, V, 2 * k + 1);
    attainable_add_rows(part, zeta2 * (zeta2 * beta - alpha), d + 1, stride, V, 2 * k + 1);
}

/* c[n_states] of the rows above those of the stack: R₁₁ c = z₁ − R₁₂ c₂. */
static enum bf_status find_states(const struct attainable_problem *p, const struct attainable_stack *s,
                                  const struct attainable_part *part, double c[], struct bf_error *err)
{
    const struct attainable_rows *rows = part->rows;
    const size_t n = rows->n_states, block = attainable_block(p);
    double *R = bf_alloc(n * n + 1, sizeof *R), *b = bf_alloc(n + 1, sizeof *b);
    for (size_t j = 0; j < n; j++)
        memcpy(R + j * n, rows->R + j * rows->n, n * sizeof *R);
    memcpy(b, rows->R + attainable_measured_column(part) * rows->n, n * sizeof *b);
    for (size_t i = 0; i < part->record->n_sources; i++)
        for (size_t j = 0; j < block; j++)
            for (size_t k = 0; k < n; k++)
                b[k] -= rows->R[k + (n + i * block + j) * rows->n] * s->c[s->column[part->record->sources[i].slot] + j];
    const enum bf_status status = n > 0 ? dense_least_squares(n, n, R, b, attainable_dependent, c, NULL, err) : BF_OK;
    free(R), free(b);
    return status;
}

/* V[n × 2m] = ∂(A c)/∂x at held residues. */
static enum bf_status fill_derivative(const struct attainable_problem *p, const struct attainable_stack *s,
                                      const double x[], double V[], struct bf_error *err)
{
    const size_t m = p->m, block = attainable_block(p);
    enum bf_status status = BF_OK;
    for (size_t q = 0; q < s->n_parts && status == BF_OK; q++) {
        const struct attainable_part *part = &s->parts[q];
        const size_t states = part->rows->n_states, extra = states + part->rows->n_residues;
        double *c = bf_alloc(states + 1, sizeof *c);
        const size_t n_sources = part->record->n_sources;
        for (size_t i = 0; i < n_sources; i++)
            for (size_t k = 0; k < m; k++)
                add_pair(part, x + 2 * k, s->c + s->column[part->record->sources[i].slot] + 2 * k,
                         states + i * block + 2 * k, extra + 2 * (i * m + k), s->n, V, k);
        status = find_states(p, s, part, c, err);
        for (size_t k = 0; k < m && states > 0; k++)
            add_pair(part, x + 2 * k, c + 2 * k, 2 * k, extra + 2 * (n_sources * m + k), s->n, V, k);
        free(c);
    }
    return status;
}

/* Kaufman's Jacobian J = −(I − UUᵀ)V: gradient += Jᵀr, gram += JᵀJ. */
static void add_normal(const struct attainable_stack *s, size_t n, const double V[], double gradient[], double gram[])
{
    double *J = bf_alloc(s->n * n + 1, sizeof *J), *P = bf_alloc(s->rank * n + 1, sizeof *P);
    memcpy(J, V, s->n * n * sizeof *J);
    if (s->rank > 0) {
        dense_gemm(true, false, s->rank, n, s->n, 1.0, s->U, V, 0.0, P);
        dense_gemm(false, false, s->n, n, s->rank, -1.0, s->U, P, 1.0, J);
    }
    dense_gemm(true, false, n, n, s->n, 1.0, J, J, 1.0, gram);
    dense_gemv(true, s->n, n, -1.0, J, s->r, 1.0, gradient);
    free(J), free(P);
}

enum bf_status attainable_derivative(const struct attainable_problem *p, const double x[],
                                     const struct attainable_rows rows[], double *half_square, double gradient[],
                                     double gram[], struct bf_error *err)
{
    const size_t n = 2 * p->m;
    enum bf_status status = BF_OK;
    *half_square = 0.0;
    memset(gradient, 0, n * sizeof *gradient);
    memset(gram, 0, n * n * sizeof *gram);
    for (size_t o = 0; o < p->n_outputs && status == BF_OK; o++) {
        struct attainable_stack s;
        attainable_stack_new(p, rows, o, &s);
        status = attainable_stack_solve(&s, err);
        double *V = bf_alloc(s.n * n + 1, sizeof *V);
        if (status == BF_OK)
            status = fill_derivative(p, &s, x, V, err);
        if (status == BF_OK)
            add_normal(&s, n, V, gradient, gram);
        *half_square += attainable_squares(&s, NULL);
        free(V);
        attainable_stack_free(&s);
    }
    return status;
}

/* ---- Vector fitting ---- */

/* R₂₂[(2m + 1)²]: of one output's equations z + W c = A r what is left when the residues r are eliminated. */
static enum bf_status eliminate(const struct attainable_problem *p, const struct attainable_rows rows[], size_t output,
                                double R22[], struct bf_error *err)
{
    const size_t pairs = 2 * p->m;
    struct attainable_stack s;
    attainable_stack_new(p, rows, output, &s);
    const size_t n = s.columns + pairs + 1, height = s.n > n ? s.n : n;
    double *X = bf_alloc(height * n, sizeof *X), *R = bf_alloc(n * n, sizeof *R);
    for (size_t j = 0; j < s.columns; j++)
        memcpy(X + j * height, s.A + j * s.n, s.n * sizeof *X);
    memcpy(X + (n - 1) * height, s.z, s.n * sizeof *X);
    for (size_t k = 0; k < s.n_parts; k++) {
        const struct attainable_part *part = &s.parts[k];
        const size_t first = part->rows->n_states + part->rows->n_residues + part->data * pairs;
        for (size_t j = 0; j < pairs; j++)
            attainable_add_rows(part, part->weight, first + j, height, X, s.columns + j);
    }
    const enum bf_status status = dense_qr_triangle(height, n, X, R, err);
    for (size_t j = 0; j <= pairs; j++)
        memcpy(R22 + j * (pairs + 1), R + s.columns + (s.columns + j) * n, (pairs + 1) * sizeof *R22);
    free(X), free(R);
    attainable_stack_free(&s);
    return status;
}

/* Zeros of 1 + Σ (c₁ω² + c₂ωs)/q as pairs: eigenvalues of the pairs' chain with the sum fed back. */
static enum bf_status zeros(size_t m, const double x[], const double c[], double x_new[], struct bf_error *err)
{
    const size_t n = 2 * m;
    double *M = bf_alloc(n * n, sizeof *M);
    double complex *p = bf_alloc(n, sizeof *p), *left = bf_alloc(2 * n * n, sizeof *left);
    for (size_t k = 0; k < m; k++) {
        const double omega = exp(x[2 * k]);
        M[2 * k + (2 * k + 1) * n] = omega;
        for (size_t row = 1; row < n; row += 2) {
            M[row + 2 * k * n] = -omega * c[2 * k] - (row == 2 * k + 1 ? omega : 0.0);
            M[row + (2 * k + 1) * n] = -omega * c[2 * k + 1] - (row == 2 * k + 1 ? 2.0 * exp(x[2 * k + 1]) : 0.0);
        }
    }
    const enum bf_status status = dense_general_eigen(n, M, p, left, left + n * n, err);
    size_t found = 0;
    double alone = 0.0; /* a real pole that waits for another */
    for (size_t k = 0; k < n && status == BF_OK; k++) {
        const double size = fmax(cabs(p[k]), 1e-300), a = fmax(fabs(creal(p[k])), 1e-300);
        if (cimag(p[k]) > 0.0) {
            x_new[2 * found] = log(size);
            x_new[2 * found++ + 1] = log(a);
        } else if (!(cimag(p[k]) < 0.0) && !(alone > 0.0)) {
            alone = size;
        } else if (!(cimag(p[k]) < 0.0)) {
            x_new[2 * found] = 0.5 * log(alone * size);
            x_new[2 * found++ + 1] = log(0.5 * (alone + size));
            alone = 0.0;
        }
    }
    free(M), free(p), free(left);
    return status != BF_OK ? status : found == m ? BF_OK : bf_fail(err, BF_NUMERIC, "poles: they are not in pairs");
}

enum bf_status attainable_relocate(const struct attainable_problem *p, const double x[],
                                   const struct attainable_rows rows[], double x_new[], struct bf_error *err)
{
    const size_t pairs = 2 * p->m, block = pairs + 1, height = block * p->n_outputs;
    double *part = bf_alloc(block * block, sizeof *part), *A = bf_alloc(height * block, sizeof *A);
    double *c = bf_alloc(pairs, sizeof *c);
    enum bf_status status = BF_OK;
    for (size_t o = 0; o < p->n_outputs && status == BF_OK; o++) {
        status = eliminate(p, rows, o, part, err);
        for (size_t j = 0; j < block; j++) /* the last column is −z: W c = −z */
            for (size_t i = 0; i < block; i++)
                A[o * block + i + j * height] = (j == pairs ? -1.0 : 1.0) * part[i + j * block];
    }
    if (status == BF_OK)
        status = dense_least_squares(height, pairs, A, A + pairs * height, 1e-12, c, NULL, err);
    if (status == BF_OK)
        status = zeros(p->m, x, c, x_new, err);
    free(part), free(A), free(c);
    return status;
}
