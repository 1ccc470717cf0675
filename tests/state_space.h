/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * state_space.h — a dense simulation of M x″ + C x' + K x = b(t) − f(t, x, x'), to judge predictions by.
 * In undamped modes, by the matrix exponential of the system augmented with the input's Taylor series over a step: lines
 * between fine steps would excite the fastest modes by their corners, and an acceleration shows it.
 */
#ifndef STATE_SPACE_H
#define STATE_SPACE_H

#include <math.h>
#include <string.h>

#include "maths/maths.h"
#include "ground/ground.h"

struct state_space {
    size_t n;        /* degrees of freedom */
    double *omega;   /* [n] */
    double *modes;   /* [n × n] columns */
    double *damping; /* [n × n] ΦᵀCΦ */
};

static inline struct state_space state_space_new(size_t n, const double M[], const double C[], const double K[])
{
    struct state_space s = {.n = n};
    struct bf_error err;
    s.omega = bf_alloc(n, sizeof(double));
    s.modes = bf_alloc(2 * n * n, sizeof(double));
    s.damping = s.modes + n * n;
    double *work = bf_alloc(n * n, sizeof *work);
    assert_int_equal(dense_symmetric_eigen(n, K, M, s.omega, s.modes, &err), BF_OK);
    for (size_t k = 0; k < n; k++)
        s.omega[k] = sqrt(s.omega[k]);
    dense_gemm(false, false, n, n, n, 1.0, C, s.modes, 0.0, work);
    dense_gemm(true, false, n, n, n, 1.0, s.modes, work, 0.0, s.damping);
    free(work);
    return s;
}

static inline void state_space_free(struct state_space *s)
{
    free(s->omega);
    free(s->modes);
}

/* g in modes: out = Φᵀg. */
static inline void state_space_functional(const struct state_space *s, const double g[], double out[])
{
    dense_gemv(true, s->n, s->n, 1.0, s->modes, g, 0.0, out);
}

/* E = exp(A) by Taylor series and squaring; A [n × n] is used up. */
static inline void matrix_exponential(size_t n, double A[], double E[])
{
    double norm = 0.0;
    int halvings = 0;
    for (size_t j = 0; j < n; j++) {
        double column = 0.0;
        for (size_t i = 0; i < n; i++)
            column += fabs(A[i + j * n]);
        norm = fmax(norm, column);
    }
    for (; norm > 0.25; norm *= 0.5)
        halvings++;
    double *term = bf_alloc(2 * n * n, sizeof *term), *next = term + n * n;
    for (size_t i = 0; i < n * n; i++) {
        A[i] = ldexp(A[i], -halvings);
        E[i] = term[i] = i % (n + 1) == 0 ? 1.0 : 0.0;
    }
    for (int k = 1; k < 14; k++) {
        dense_gemm(false, false, n, n, n, 1.0 / k, term, A, 0.0, next);
        memcpy(term, next, n * n * sizeof *term);
        for (size_t i = 0; i < n * n; i++)
            E[i] += term[i];
    }
    for (int k = 0; k < halvings; k++) {
        dense_gemm(false, false, n, n, n, 1.0, E, E, 0.0, next);
        memcpy(E, next, n * n * sizeof *E);
    }
    free(term);
}

enum { STATE_SPACE_INPUT = 5 }; /* u, h u', h² u″, … at the beginning of a step */

/* E [(2n + 5)²] of the augmented state (Ωq, q', u, h u', …) over a step h; b[n] in modes. */
static inline void state_space_step(const struct state_space *s, const double b[], double h, double E[])
{
    size_t n = s->n, d = 2 * n + STATE_SPACE_INPUT;
    double *A = bf_alloc(d * d, sizeof *A);
    for (size_t k = 0; k < n; k++) {
        A[k + (n + k) * d] = h * s->omega[k];
        A[(n + k) + k * d] = -h * s->omega[k];
        A[(n + k) + 2 * n * d] = h * b[k];
        for (size_t j = 0; j < n; j++)
            A[(n + j) + (n + k) * d] = -h * s->damping[j + k * n];
    }
    for (size_t k = 2 * n; k + 1 < d; k++)
        A[k + (k + 1) * d] = 1.0;
    matrix_exponential(d, A, E);
    free(A);
}

/* The input's entries of the augmented state from its values at t − 2h … t + 2h. */
static inline void state_space_input(const double f[5], double out[STATE_SPACE_INPUT])
{
    out[0] = f[2];
    out[1] = (f[0] - 8.0 * f[1] + 8.0 * f[3] - f[4]) / 12.0;
    out[2] = (-f[0] + 16.0 * f[1] - 30.0 * f[2] + 16.0 * f[3] - f[4]) / 12.0;
    out[3] = (-f[0] + 2.0 * f[1] - 2.0 * f[3] + f[4]) / 2.0;
    out[4] = f[0] - 4.0 * f[1] + 6.0 * f[2] - 4.0 * f[3] + f[4];
}

/* Output of order 0, 1, 2 (deflection, velocity, acceleration) of a functional c in modes; force: b·u. */
static inline double state_space_output(const struct state_space *s, const double c[], int order, const double b[],
                                        const double z[])
{
    size_t n = s->n;
    double sum = 0.0;
    for (size_t k = 0; k < n; k++) {
        if (order == 0) {
            sum += c[k] / s->omega[k] * z[k];
        } else if (order == 1) {
            sum += c[k] * z[n + k];
        } else {
            double a = b[k] * z[2 * n] - s->omega[k] * z[k];
            for (size_t j = 0; j < n; j++)
                a -= s->damping[k + j * n] * z[n + j];
            sum += c[k] * a;
        }
    }
    return sum;
}

#endif
