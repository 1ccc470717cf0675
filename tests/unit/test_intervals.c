/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Standard errors against closed forms and against the scatter of simulated estimates. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>
#include "estimate/intervals.h"

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

enum { ROWS = 400, N = 2 };

static uint64_t seed = 7;

static double uniform(void)
{
    uint64_t z = (seed += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return ((double)((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
}

static double gauss(void)
{
    return sqrt(-2.0 * log(uniform())) * cos(2.0 * M_PI * uniform());
}

static void columns(double J[ROWS * N])
{
    for (size_t i = 0; i < ROWS; i++) {
        J[i] = 1.0;
        J[i + ROWS] = sin(0.05 * (double)i);
    }
}

static void white_residuals_give_the_textbook_covariance(void **state)
{
    (void)state;
    struct bf_error err;
    static double J[ROWS * N], weight[ROWS];
    const double sigma = 0.3, none[N] = {0.0, 0.0};
    double raw[ROWS * N], cov[N * N], G[3] = {0.0, 0.0, 0.0};
    columns(raw);
    for (size_t i = 0; i < ROWS; i++) {
        weight[i] = 1.0 / sigma;
        J[i] = raw[i] / sigma, J[i + ROWS] = raw[i + ROWS] / sigma;
        G[0] += J[i] * J[i], G[1] += J[i] * J[i + ROWS], G[2] += J[i + ROWS] * J[i + ROWS];
    }
    const struct interval_channel channel = {.n = ROWS, .noise = {.order = 0, .sigma = sigma}};
    assert_int_equal(intervals_covariance(ROWS, N, J, weight, none, 1.0, 1, &channel, NULL, 0, cov, &err), BF_OK);
    const double det = G[0] * G[2] - G[1] * G[1];
    assert_near(cov[0], G[2] / det, 1e-15);
    assert_near(cov[1], -G[1] / det, 1e-15);
    assert_near(cov[3], G[0] / det, 1e-15);
}

/* One unknown, data precision a, prior precision p: variance 1/(a + p). */
static void a_prior_adds_its_precision(void **state)
{
    (void)state;
    struct bf_error err;
    double J[4] = {2.0, 2.0, 2.0, 2.0}, weight[4] = {1.0, 1.0, 1.0, 1.0}, cov[1];
    const double prior[1] = {9.0};
    const struct interval_channel channel = {.n = 4, .noise = {.sigma = 1.0}};
    assert_int_equal(intervals_covariance(4, 1, J, weight, prior, 1.0, 1, &channel, NULL, 0, cov, &err), BF_OK);
    assert_near(cov[0], 1.0 / 25.0, 1e-15);
}

/* A singular problem has a covariance in the space that is determined. */
static void a_basis_leaves_the_null_direction_out(void **state)
{
    (void)state;
    struct bf_error err;
    const double none[2] = {0.0, 0.0}, h = sqrt(0.5), basis[4] = {h, h, h, -h};
    double J[8] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0}, weight[4] = {1.0, 1.0, 1.0, 1.0}, cov[4];
    const struct interval_channel channel = {.n = 4, .noise = {.sigma = 1.0}};
    assert_int_equal(intervals_covariance(4, 2, J, weight, none, 1.0, 1, &channel, NULL, 0, cov, &err), BF_NUMERIC);
    assert_int_equal(intervals_covariance(4, 2, J, weight, none, 1.0, 1, &channel, basis, 1, cov, &err), BF_OK);
    for (size_t i = 0; i < 4; i++) /* (1,1)/√2 has JᵀJ = 8, and the other direction none */
        assert_near(cov[i], 0.5 / 8.0, 1e-15);
}

/* First-order noise e_t = a e_{t−1} + w_t; estimates by ordinary least squares. */
static void coloured_scatter(double a, size_t sets, double variance[N])
{
    double J[ROWS * N], mean[N] = {0.0, 0.0}, square[N] = {0.0, 0.0};
    columns(J);
    double G[3] = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < ROWS; i++)
        G[0] += J[i] * J[i], G[1] += J[i] * J[i + ROWS], G[2] += J[i + ROWS] * J[i + ROWS];
    const double det = G[0] * G[2] - G[1] * G[1];
    for (size_t set = 0; set < sets; set++) {
        double e = gauss() / sqrt(1.0 - a * a), b[N] = {0.0, 0.0};
        for (size_t i = 0; i < ROWS; i++) {
            b[0] += J[i] * e, b[1] += J[i + ROWS] * e;
            e = a * e + gauss();
        }
        const double x[N] = {(G[2] * b[0] - G[1] * b[1]) / det, (G[0] * b[1] - G[1] * b[0]) / det};
        for (size_t j = 0; j < N; j++)
            mean[j] += x[j] / (double)sets, square[j] += x[j] * x[j] / (double)sets;
    }
    for (size_t j = 0; j < N; j++)
        variance[j] = square[j] - mean[j] * mean[j];
}

/* 4000 sets: the scatter's own standard error is 2.2 %; the white formula would be wrong by a factor of 9 or more. */
static void coloured_residuals_give_the_scatter(void **state)
{
    (void)state;
    struct bf_error err;
    const double none[N] = {0.0, 0.0}, coefficients[] = {0.8, -0.6};
    double J[ROWS * N], weight[ROWS], cov[N * N], scatter[N];
    columns(J);
    for (size_t i = 0; i < ROWS; i++)
        weight[i] = 1.0;
    for (size_t k = 0; k < 2; k++) {
        const struct interval_channel channel = {.n = ROWS,
                                                 .noise = {.order = 1, .a = {coefficients[k]}, .sigma = 1.0}};
        assert_int_equal(intervals_covariance(ROWS, N, J, weight, none, 1.0, 1, &channel, NULL, 0, cov, &err), BF_OK);
        coloured_scatter(coefficients[k], 4000, scatter);
        for (size_t j = 0; j < N; j++)
            assert_near(cov[j + j * N] / scatter[j], 1.0, 0.09);
    }
}

/* Two channels with their own noise: the sum of both informations. */
static void channels_add(void **state)
{
    (void)state;
    struct bf_error err;
    const double none[1] = {0.0};
    double J[4] = {1.0, 1.0, 0.5, 0.5}, weight[4] = {1.0, 1.0, 0.5, 0.5}, cov[1];
    const struct interval_channel channels[2] = {{.row = 0, .n = 2, .noise = {.sigma = 1.0}},
                                                 {.row = 2, .n = 2, .noise = {.sigma = 2.0}}};
    assert_int_equal(intervals_covariance(4, 1, J, weight, none, 1.0, 2, channels, NULL, 0, cov, &err), BF_OK);
    assert_near(cov[0], 1.0 / 2.5, 1e-15);
}

/* Abramowitz & Stegun, table 26.10, two-sided 0.05. */
static void student_quantiles_agree_with_the_table(void **state)
{
    (void)state;
    static const double table[][2] = {{1.0, 12.7062}, {2.0, 4.30265},   {3.0, 3.18245},  {4.0, 2.77645},
                                      {5.0, 2.57058}, {7.0, 2.36462},   {10.0, 2.22814}, {20.0, 2.08596},
                                      {60.0, 2.0003}, {120.0, 1.97993}, {1e6, 1.95996}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        assert_near(intervals_student95(table[i][0]) / table[i][1], 1.0, 2e-5);
}

static void intervals_of_logarithms_are_asymmetric_and_stay_in_bounds(void **state)
{
    (void)state;
    double ci[2];
    intervals_95(2.0, 0.1, true, 1e6, 0.0, HUGE_VAL, ci);
    assert_near(ci[0] * ci[1], 4.0, 1e-12);
    assert_near(log(ci[1] / 2.0), 0.195996, 1e-5);
    intervals_95(2.0, 0.1, false, 1e6, 0.0, HUGE_VAL, ci);
    assert_near(ci[0] + ci[1], 4.0, 1e-12);
    intervals_95(0.05, 0.1, false, 1e6, 0.0, 0.2, ci);
    assert_true(ci[0] == 0.0 && ci[1] == 0.2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white_residuals_give_the_textbook_covariance),
        cmocka_unit_test(a_prior_adds_its_precision),
        cmocka_unit_test(a_basis_leaves_the_null_direction_out),
        cmocka_unit_test(coloured_residuals_give_the_scatter),
        cmocka_unit_test(channels_add),
        cmocka_unit_test(student_quantiles_agree_with_the_table),
        cmocka_unit_test(intervals_of_logarithms_are_asymmetric_and_stay_in_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
