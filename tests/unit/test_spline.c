/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Splines: what makes a basis one, smoothness at knots and edges, and what is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "maths/maths.h"

static const double length_m = 0.4573, edges[] = {0.02535, 0.08905};
enum { EDGES = 2, POINTS = 997 };

static struct spline open_spline(size_t n_edges, size_t n)
{
    struct spline s;
    struct bf_error err;
    assert_int_equal(spline_new(length_m, edges, n_edges, n, &s, &err), BF_OK);
    return s;
}

static double point(size_t k)
{
    return length_m * (double)k / (double)(POINTS - 1);
}

/* k-th derivative of Σ c_i φ_i at x. */
static double combine(const struct spline *s, const double c[], int k, double x)
{
    struct spline_values v;
    double sum = 0.0;
    spline_evaluate(s, x, &v);
    for (size_t j = 0; j < SPLINE_ORDER; j++)
        sum += c[v.first + j] * v.d[k][j];
    return sum;
}

static double coefficient(size_t i)
{
    return sin(1.7 * (double)i * (double)i + 0.3);
}

static void fill(const struct spline *s, double c[])
{
    for (size_t i = 0; i < s->n; i++)
        c[i] = coefficient(i);
}

static void functions_sum_to_one(void **state)
{
    (void)state;
    for (size_t n_edges = 0; n_edges <= EDGES; n_edges++) {
        struct spline s = open_spline(n_edges, 17);
        for (size_t i = 0; i < POINTS; i++) {
            struct spline_values v;
            spline_evaluate(&s, point(i), &v);
            assert_true(v.first + SPLINE_ORDER <= s.n);
            for (int k = 0; k < 4; k++) {
                double sum = 0.0, size = 0.0;
                for (size_t j = 0; j < SPLINE_ORDER; j++) {
                    sum += v.d[k][j];
                    size += fabs(v.d[k][j]);
                    assert_true(k > 0 || v.d[0][j] >= 0.0);
                }
                assert_true(fabs(sum - (k == 0 ? 1.0 : 0.0)) <= 1e-13 * size);
            }
        }
        spline_free(&s);
    }
}

static void number_of_functions_is_what_was_asked(void **state)
{
    (void)state;
    struct spline s = open_spline(0, 9);
    assert_int_equal(s.n, 12); /* nine elements */
    assert_int_equal(s.n_knots, 16);
    spline_free(&s);
    s = open_spline(EDGES, 60);
    assert_true(s.n >= 60 && s.n <= 72); /* one more function for each edge, and rounding of the pieces */
    spline_free(&s);
}

static void derivatives_match_differences(void **state)
{
    (void)state;
    struct spline s = open_spline(EDGES, 12);
    double *c = bf_alloc(s.n, sizeof *c);
    fill(&s, c);
    for (size_t i = 3; i + 1 < s.n; i++) {
        double from = s.knots[i], to = s.knots[i + 1], x = 0.6 * from + 0.4 * to, h = 0.1 * (to - from);
        for (int k = 0; k < 3 && to > from; k++) {
            double wide = (combine(&s, c, k, x + h) - combine(&s, c, k, x - h)) / (2.0 * h);
            double near = (combine(&s, c, k, x + 0.5 * h) - combine(&s, c, k, x - 0.5 * h)) / h;
            double exact = (4.0 * near - wide) / 3.0; /* no fifth derivative: extrapolation is exact */
            double size = fabs(combine(&s, c, k, x)) / h;
            assert_true(fabs(combine(&s, c, k + 1, x) - exact) <= 1e-12 * (size + fabs(exact)));
        }
    }
    free(c);
    spline_free(&s);
}

/* Jump of the k-th derivative over x, k = 0 … 2, and its size beside it. */
static double jump(const struct spline *s, const double c[], int k, double x, double *size)
{
    double h = 1e-9 * length_m;
    double left = combine(s, c, k, x - h) + h * combine(s, c, k + 1, x - h);
    double right = combine(s, c, k, x);
    *size = fabs(left) + fabs(right);
    return fabs(right - left);
}

static void smooth_at_knots_and_kinked_at_edges(void **state)
{
    (void)state;
    struct spline s = open_spline(EDGES, 20);
    double *c = bf_alloc(s.n, sizeof *c);
    size_t doubles = 0, singles = 0;
    fill(&s, c);
    for (size_t i = 4; i + 4 < s.n_knots; i++) {
        double x = s.knots[i], size;
        if (!(x > s.knots[i - 1]))
            continue;
        bool edge = !(s.knots[i + 1] > x);
        for (int k = 0; k < 3; k++) {
            double difference = jump(&s, c, k, x, &size), allowed = 1e-7 * size;
            if (k < 2 || !edge)
                assert_true(difference <= allowed);
            else
                assert_true(difference > 1e-2 * size); /* y″ may jump, and with these coefficients does */
        }
        doubles += edge;
        singles += !edge;
    }
    assert_int_equal(doubles, EDGES);
    assert_true(singles > 15);
    free(c);
    spline_free(&s);
}

/* Every cubic is in the space: interpolate it at points and look between them. */
static void cubics_are_reproduced(void **state)
{
    (void)state;
    struct spline s = open_spline(EDGES, 14);
    size_t rows = 4 * s.n;
    double *A = bf_alloc(rows * s.n, sizeof *A), *b = bf_alloc(rows, sizeof *b), *c = bf_alloc(s.n, sizeof *c);
    struct bf_error err;
    const double a[4] = {0.3, -2.0, 5.0, 7.0};
    for (size_t r = 0; r < rows; r++) {
        double x = length_m * (double)r / (double)(rows - 1);
        struct spline_values v;
        spline_evaluate(&s, x, &v);
        for (size_t j = 0; j < SPLINE_ORDER; j++)
            A[r + (v.first + j) * rows] = v.d[0][j];
        b[r] = ((a[3] * x + a[2]) * x + a[1]) * x + a[0];
    }
    size_t rank;
    assert_int_equal(dense_least_squares(rows, s.n, A, b, 1e-13, c, &rank, &err), BF_OK);
    assert_int_equal(rank, s.n); /* the functions are independent */
    for (size_t i = 0; i < POINTS; i++) {
        double x = point(i);
        assert_true(fabs(combine(&s, c, 0, x) - (((a[3] * x + a[2]) * x + a[1]) * x + a[0])) < 1e-12);
        assert_true(fabs(combine(&s, c, 1, x) - ((3.0 * a[3] * x + 2.0 * a[2]) * x + a[1])) < 1e-10);
        assert_true(fabs(combine(&s, c, 2, x) - (6.0 * a[3] * x + 2.0 * a[2])) < 1e-7);
    }
    free(A);
    free(b);
    free(c);
    spline_free(&s);
}

static void ends_belong_to_one_function(void **state)
{
    (void)state;
    struct spline s = open_spline(EDGES, 11);
    struct spline_values v;
    spline_evaluate(&s, 0.0, &v);
    assert_int_equal(v.first, 0);
    assert_true(fabs(v.d[0][0] - 1.0) < 1e-15 && fabs(v.d[0][1]) < 1e-15);
    assert_true(v.d[1][1] > 0.0 && fabs(v.d[1][2]) < 1e-12); /* only the first two have a slope there */
    spline_evaluate(&s, length_m, &v);
    assert_int_equal(v.first, s.n - SPLINE_ORDER);
    assert_true(fabs(v.d[0][3] - 1.0) < 1e-15 && fabs(v.d[0][2]) < 1e-15);
    assert_true(v.d[1][2] < 0.0 && fabs(v.d[1][1]) < 1e-12);
    spline_free(&s);
}

static void bad_edges_are_refused(void **state)
{
    (void)state;
    struct spline s;
    struct bf_error err;
    const double same[] = {0.1, 0.1}, falling[] = {0.2, 0.1}, outside[] = {0.6}, at_zero[] = {0.0}, none[] = {NAN};
    assert_int_equal(spline_new(length_m, same, 2, 10, &s, &err), BF_NUMERIC);
    assert_int_equal(spline_new(length_m, falling, 2, 10, &s, &err), BF_NUMERIC);
    assert_int_equal(spline_new(length_m, outside, 1, 10, &s, &err), BF_NUMERIC);
    assert_int_equal(spline_new(length_m, at_zero, 1, 10, &s, &err), BF_NUMERIC);
    assert_int_equal(spline_new(length_m, none, 1, 10, &s, &err), BF_NUMERIC);
    assert_int_equal(spline_new(0.0, NULL, 0, 10, &s, &err), BF_NUMERIC);
    assert_int_equal(spline_new(NAN, NULL, 0, 10, &s, &err), BF_NUMERIC);
    assert_true(err.text[0] != '\0');
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(functions_sum_to_one),          cmocka_unit_test(number_of_functions_is_what_was_asked),
        cmocka_unit_test(derivatives_match_differences), cmocka_unit_test(smooth_at_knots_and_kinked_at_edges),
        cmocka_unit_test(cubics_are_reproduced),         cmocka_unit_test(ends_belong_to_one_function),
        cmocka_unit_test(bad_edges_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
