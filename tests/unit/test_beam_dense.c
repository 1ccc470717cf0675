/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"
#include "beam_dense.h"

enum { MANY = BEAM_STATES };

/* A = B Bᵀ + shift, from random B. */
static void definite(int n, unsigned seed, double shift, beam_matrix a)
{
    static double b[MANY][MANY];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            b[i][j] = case_random(&seed);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            a[i][j] = i == j ? shift : 0.0;
            for (int k = 0; k < n; k++)
                a[i][j] += b[i][k] * b[j][k];
        }
}

static void cholesky_gives_the_matrix_back_and_solves(void **state)
{
    static beam_matrix a, l;
    (void)state;
    definite(MANY, 7, 0.1, a);
    memcpy(l, a, sizeof a);
    assert_int_equal(beam_cholesky(MANY, MANY, l[0]), 0);
    double x[MANY], b[MANY];
    for (int i = 0; i < MANY; i++) {
        b[i] = x[i] = i + 1;
        for (int j = 0; j < MANY; j++) {
            double sum = 0;
            for (int k = 0; k <= (i < j ? i : j); k++)
                sum += l[i][k] * l[j][k];
            assert_close(sum, a[i][j], 1e-12);
        }
    }
    beam_lower_solve(MANY, MANY, l[0], x);
    beam_lower_transposed_solve(MANY, MANY, l[0], x);
    for (int i = 0; i < MANY; i++) {
        double sum = 0;
        for (int j = 0; j < MANY; j++)
            sum += a[i][j] * x[j];
        assert_close(sum, b[i], 1e-9);
    }
}

static void cholesky_refuses_singular_indefinite_and_nan(void **state)
{
    (void)state;
    double singular[2][2] = {{1, 1}, {1, 1}}, indefinite[2][2] = {{1, 2}, {2, 1}}, nan[2][2] = {{NAN, 0}, {0, 1}};
    assert_int_equal(beam_cholesky(2, 2, singular[0]), -1);
    assert_int_equal(beam_cholesky(2, 2, indefinite[0]), -1);
    assert_int_equal(beam_cholesky(2, 2, nan[0]), -1);
}

static void jacobi_diagonalises_and_keeps_small_eigenvalues(void **state)
{
    static beam_matrix a, b, v;
    double d[MANY];
    (void)state;
    /* graded: D B D with D = 10^0 .. 10^-7; relative accuracy of the smallest is what the low modes need */
    definite(8, 11, 0.5, a);
    for (int i = 0; i < 8; i++)
        for (int j = 0; j < 8; j++)
            a[i][j] *= pow(10.0, -i) * pow(10.0, -j);
    memcpy(b, a, sizeof a);
    assert_int_equal(beam_symmetric_eigen(8, MANY, b[0], v[0], d), 0);
    double product = 1, determinant = 1;
    memcpy(b, a, sizeof a);
    assert_int_equal(beam_cholesky(8, MANY, b[0]), 0);
    for (int i = 0; i < 8; i++) {
        assert_true(i == 0 || d[i] >= d[i - 1]);
        product *= d[i];
        determinant *= b[i][i] * b[i][i];
        for (int j = 0; j < 8; j++) {
            double orthogonal = 0, image = 0;
            for (int k = 0; k < 8; k++) {
                orthogonal += v[k][i] * v[k][j];
                image += a[i][k] * v[k][j];
            }
            assert_close(orthogonal, i == j ? 1.0 : 0.0, 1e-13);
            assert_close(image, d[j] * v[i][j], 1e-13);
        }
    }
    assert_close(product / determinant, 1.0, 1e-12);
}

static void qr_finds_the_roots_of_a_companion_matrix(void **state)
{
    /* (s² + 2s + 26)(s² − 6s + 10)(s + 3)(s − 0.001): pairs −1 ± 5i, 3 ± i, and −3, 0.001 */
    static beam_matrix a;
    const double roots_re[6] = {-1, -1, 3, 3, -3, 0.001}, roots_im[6] = {5, -5, 1, -1, 0, 0};
    double poly[7] = {1}, re[MANY], im[MANY];
    const double factors[4][3] = {{26, 2, 1}, {10, -6, 1}, {3, 1, 0}, {-0.001, 1, 0}};
    int degree = 0;
    (void)state;
    for (int f = 0; f < 4; f++) {
        double next[7] = {0};
        const int order = factors[f][2] > 0 ? 2 : 1;
        for (int i = 0; i <= degree; i++)
            for (int j = 0; j <= order; j++)
                next[i + j] += poly[i] * factors[f][j];
        degree += order;
        memcpy(poly, next, sizeof poly);
    }
    memset(a, 0, sizeof a);
    for (int i = 0; i < 6; i++) {
        a[0][i] = -poly[5 - i];
        if (i > 0)
            a[i][i - 1] = 1;
    }
    assert_int_equal(beam_eigenvalues(6, a, re, im), 0);
    for (int r = 0; r < 6; r++) {
        double nearest = 1e9;
        for (int k = 0; k < 6; k++)
            nearest = fmin(nearest, hypot(re[k] - roots_re[r], im[k] - roots_im[r]));
        assert_true(nearest < 1e-11);
    }
}

static void qr_survives_zero_and_identity(void **state)
{
    static beam_matrix a;
    double re[MANY], im[MANY];
    (void)state;
    memset(a, 0, sizeof a);
    assert_int_equal(beam_eigenvalues(MANY, a, re, im), 0);
    for (int i = 0; i < MANY; i++)
        assert_true(re[i] == 0.0 && im[i] == 0.0);
    for (int i = 0; i < MANY; i++)
        a[i][i] = 2.0;
    assert_int_equal(beam_eigenvalues(MANY, a, re, im), 0);
    for (int i = 0; i < MANY; i++)
        assert_true(re[i] == 2.0 && im[i] == 0.0);
}

static void qr_keeps_trace_and_sum_of_squares(void **state)
{
    static beam_matrix a;
    double re[MANY], im[MANY], trace = 0, squares = 0;
    unsigned seed = 5;
    (void)state;
    for (int i = 0; i < MANY; i++)
        for (int j = 0; j < MANY; j++)
            a[i][j] = case_random(&seed) * (i < 4 ? 1000.0 : 1.0);
    for (int i = 0; i < MANY; i++) {
        trace += a[i][i];
        for (int j = 0; j < MANY; j++)
            squares += a[i][j] * a[j][i]; /* trace of A² */
    }
    assert_int_equal(beam_eigenvalues(MANY, a, re, im), 0);
    double imaginary = 0;
    for (int i = 0; i < MANY; i++) {
        trace -= re[i];
        imaginary += im[i];
        squares -= re[i] * re[i] - im[i] * im[i];
    }
    assert_close(trace, 0.0, 1e-9);
    assert_close(imaginary, 0.0, 1e-9);
    assert_close(squares, 0.0, 1e-6);
}

static void complex_solve_inverts_and_survives_a_singular_matrix(void **state)
{
    double a_re[BEAM_N][BEAM_N], a_im[BEAM_N][BEAM_N], m_re[BEAM_N][BEAM_N], m_im[BEAM_N][BEAM_N];
    double x_re[BEAM_N], x_im[BEAM_N];
    unsigned seed = 3;
    (void)state;
    for (int i = 0; i < BEAM_N; i++) {
        for (int j = 0; j < BEAM_N; j++) {
            a_re[i][j] = case_random(&seed);
            a_im[i][j] = case_random(&seed);
        }
        x_re[i] = i;
        x_im[i] = 1;
    }
    memcpy(m_re, a_re, sizeof a_re);
    memcpy(m_im, a_im, sizeof a_im);
    beam_complex_solve(BEAM_N, a_re, a_im, x_re, x_im);
    for (int i = 0; i < BEAM_N; i++) {
        double re = 0, im = 0;
        for (int j = 0; j < BEAM_N; j++) {
            re += m_re[i][j] * x_re[j] - m_im[i][j] * x_im[j];
            im += m_re[i][j] * x_im[j] + m_im[i][j] * x_re[j];
        }
        assert_close(re, i, 1e-12);
        assert_close(im, 1, 1e-12);
    }
    memset(a_re, 0, sizeof a_re);
    memset(a_im, 0, sizeof a_im);
    a_re[0][0] = 1.0;
    beam_complex_solve(BEAM_N, a_re, a_im, x_re, x_im); /* inverse iteration lives on this */
    assert_true(isfinite(x_re[0]));
}

static void real_solve_pivots_and_reports_singularity(void **state)
{
    double a[BEAM_PORTS][BEAM_PORTS] = {{0, 2}, {3, 1}}, x[BEAM_PORTS] = {4, 5};
    (void)state;
    assert_int_equal(beam_real_solve(2, a, x), 0);
    assert_close(x[0], 1.0, 1e-15);
    assert_close(x[1], 2.0, 1e-15);
    double s[BEAM_PORTS][BEAM_PORTS] = {{1, 1}, {1, 1}};
    assert_int_equal(beam_real_solve(2, s, x), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cholesky_gives_the_matrix_back_and_solves),
        cmocka_unit_test(cholesky_refuses_singular_indefinite_and_nan),
        cmocka_unit_test(jacobi_diagonalises_and_keeps_small_eigenvalues),
        cmocka_unit_test(qr_finds_the_roots_of_a_companion_matrix),
        cmocka_unit_test(qr_survives_zero_and_identity),
        cmocka_unit_test(qr_keeps_trace_and_sum_of_squares),
        cmocka_unit_test(complex_solve_inverts_and_survives_a_singular_matrix),
        cmocka_unit_test(real_solve_pivots_and_reports_singularity),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
