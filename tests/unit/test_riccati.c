/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The steady Kalman filter: the equation's residual, the recursion step by step, a stable filter, known cases. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"

enum { MOST = 17 };

static double A[MOST * MOST], Q[MOST * MOST], c[MOST], P[MOST * MOST], K[MOST];

/* Resonators of these frequencies (turns a sample) and damping ratios, seen each by its first coordinate, and an integrator. */
static size_t make_system(size_t modes, double lowest, double damping, double shaking)
{
    const size_t n = 2 * modes + 1;
    memset(A, 0, sizeof A);
    memset(Q, 0, sizeof Q);
    memset(c, 0, sizeof c);
    for (size_t m = 0; m < modes; m++) {
        const double angle = 2.0 * acos(-1.0) * lowest * pow(1.9, (double)m);
        const double complex turn = cexp(angle * CMPLX(-damping, 1.0));
        const size_t i = 2 * m, j = i + 1;
        A[i + i * n] = A[j + j * n] = creal(turn);
        A[j + i * n] = cimag(turn);
        A[i + j * n] = -cimag(turn);
        Q[i + i * n] = Q[j + j * n] = shaking * (1.0 + (double)m);
        Q[i + j * n] = Q[j + i * n] = 0.3 * shaking;
        c[i] = 1.0;
    }
    A[n * n - 1] = 1.0;
    Q[n * n - 1] = 0.1 * shaking;
    c[n - 1] = 1.0;
    return n;
}

/* X ← A X Aᵀ − (A X c)(A X c)ᵀ/(cᵀ X c + r) + Q, as the definition has it, without the library's own algebra. */
static void recursion(size_t n, double r, double X[])
{
    static double AX[MOST * MOST], next[MOST * MOST];
    double gain[MOST] = {0}, s = r;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            AX[i + j * n] = 0.0;
            for (size_t k = 0; k < n; k++)
                AX[i + j * n] += A[i + k * n] * X[k + j * n];
            gain[i] += AX[i + j * n] * c[j];
            s += c[i] * X[i + j * n] * c[j];
        }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            next[i + j * n] = Q[i + j * n] - gain[i] * gain[j] / s;
            for (size_t k = 0; k < n; k++)
                next[i + j * n] += AX[i + k * n] * A[j + k * n];
        }
    memcpy(X, next, n * n * sizeof *X);
}

static double largest(size_t count, const double x[], const double y[])
{
    double worst = 0.0;
    for (size_t i = 0; i < count; i++)
        worst = fmax(worst, fabs(x[i] - (y ? y[i] : 0.0)));
    return worst;
}

static void solves_the_equation(void **state)
{
    static const struct {
        size_t modes;
        double lowest, damping, shaking;
        int steps;
    } cases[] = {{1, 0.05, 0.02, 1e-4, 20000},
                 {3, 0.01, 0.005, 1e-5, 20000},
                 {8, 0.004, 0.003, 1e-4, 20000},
                 {8, 0.004, 1e-6, 1e-7, 0}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        static double X[MOST * MOST], filter[MOST * MOST];
        double complex poles[MOST];
        struct bf_error err;
        struct kalman kalman = {.covariance = P, .gain = K};
        const double r = 2.5;
        const size_t n = make_system(cases[i].modes, cases[i].lowest, cases[i].damping, cases[i].shaking);
        assert_int_equal(kalman_steady(n, A, c, Q, r, &kalman, &err), BF_OK);
        memcpy(X, P, sizeof X);
        recursion(n, r, X); /* the equation's residual */
        assert_true(largest(n * n, X, P) < 1e-12 * largest(n * n, P, NULL));
        memset(X, 0, sizeof X);
        for (int k = 0; k < cases[i].steps; k++)
            recursion(n, r, X);
        if (cases[i].steps > 0) /* an independent way to the same */
            assert_true(largest(n * n, X, P) < 1e-8 * largest(n * n, P, NULL));
        for (size_t j = 0; j < n; j++)
            for (size_t k = 0; k < n; k++)
                filter[j + k * n] = A[j + k * n] - K[j] * c[k];
        assert_int_equal(dense_general_eigen(n, filter, poles, NULL, NULL, &err), BF_OK);
        for (size_t j = 0; j < n; j++)
            assert_true(cabs(poles[j]) < 1.0);
        assert_true(kalman.steps < 40 && kalman.innovation_variance > r);
    }
}

/* A random walk: P² − Q P − Q r = 0. */
static void a_random_walk(void **state)
{
    const double one = 1.0, q = 0.04, r = 3.0, wanted = 0.5 * (q + sqrt(q * q + 4.0 * q * r));
    double p = 0.0, gain = 0.0;
    struct kalman kalman = {.covariance = &p, .gain = &gain};
    struct bf_error err;
    (void)state;
    assert_int_equal(kalman_steady(1, &one, &one, &q, r, &kalman, &err), BF_OK);
    assert_true(fabs(p - wanted) < 1e-14 * wanted);
    assert_true(fabs(gain - wanted / (wanted + r)) < 1e-14);
}

/* What grows and is not seen has no filter. */
static void unseen(void **state)
{
    const double grows[4] = {0.9, 0.0, 0.0, 1.1}, sees[2] = {1.0, 0.0}, shaken[4] = {1e-2, 0.0, 0.0, 1e-2};
    struct kalman kalman = {.covariance = P, .gain = K};
    struct bf_error err;
    (void)state;
    assert_int_equal(kalman_steady(2, grows, sees, shaken, 1.0, &kalman, &err), BF_NUMERIC);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(solves_the_equation), cmocka_unit_test(a_random_walk),
                                       cmocka_unit_test(unseen)};
    return cmocka_run_group_tests_name("riccati", tests, NULL, NULL);
}
