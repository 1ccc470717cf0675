/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Curves thinned to a number of points: nothing that an eye sees is lost. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "show/curve_grid.h"

/* The tree's own text; caller frees. */
static char *printed(struct json *tree)
{
    char *text = NULL;
    size_t n = 0;
    struct bf_error err;
    FILE *f = open_memstream(&text, &n);
    assert_non_null(f);
    assert_int_equal(json_print_line_and_free(tree, f, &err), BF_OK);
    assert_int_equal(fclose(f), 0);
    return text;
}

static void a_short_curve_is_whole(void **state)
{
    (void)state;
    struct curve_grid grid;
    curve_grid_choose(100, 100, 40, &grid);
    assert_int_equal(grid.n_segments, 1);
    assert_int_equal(grid.segments[0].step, 1);
    assert_int_equal(curve_grid_points(&grid), 100);
}

/* Every sample lies in exactly one segment, and about `most` points are kept. */
static void check_grid(size_t n, size_t most, size_t whole_from)
{
    struct curve_grid grid;
    size_t at = 0, whole = 0;
    curve_grid_choose(n, most, whole_from, &grid);
    for (size_t s = 0; s < grid.n_segments; s++) {
        const struct curve_segment *one = &grid.segments[s];
        assert_int_equal(one->first, at);
        if (one->step == 1) {
            whole = one->points;
            assert_true(one->first <= whole_from);
            at += one->points;
        } else {
            assert_int_equal(one->points % 2, 0);
            assert_true(at + (one->points - 2) * one->step < n); /* the last bucket has a sample */
            at = at + one->points * one->step < n ? at + one->points * one->step : n;
        }
    }
    assert_int_equal(at, n);
    assert_true(whole >= most / 2);
    assert_true(curve_grid_points(&grid) <= most + 6);
}

static void a_long_curve_is_thinned_on_either_side(void **state)
{
    (void)state;
    check_grid(100000, 1000, 0);
    check_grid(100000, 1000, 50000);
    check_grid(100000, 1000, 99999);
    check_grid(1001, 1000, 300);
    check_grid(123457, 601, 77777);
}

static void a_lone_peak_survives(void **state)
{
    (void)state;
    enum { N = 50000, PEAK = 31234 };
    double *y = calloc(N, sizeof *y);
    assert_non_null(y);
    struct curve_grid grid;
    curve_grid_choose(N, 500, 0, &grid);
    char *flat = printed(curve_json(&grid, y, false));
    y[PEAK] = 1.0;
    char *peak = printed(curve_json(&grid, y, false));
    assert_string_not_equal(flat, peak);
    assert_non_null(strstr(peak, "3.125"));
    free(flat), free(peak), free(y);
}

static void values_are_those_of_the_header(void **state)
{
    (void)state;
    static const double y[] = {1.0, -0.5, 0.0, NAN};
    struct curve_grid grid;
    curve_grid_choose(4, 64, 0, &grid);
    char *text = printed(curve_json(&grid, y, false)); /* 32000, -16000, 0, -32768 */
    assert_non_null(strstr(text, "\"AH2AwQAAAIA=\""));
    free(text);
    static const double amplitude[] = {10.0, 1.0, 0.1, 0.0};
    text = printed(curve_json(&grid, amplitude, true)); /* 2000, 0, -2000 hundredths of a dB, and no value */
    assert_non_null(strstr(text, "\"0AcAADD4AIA=\""));
    assert_non_null(strstr(text, "0.01"));
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_short_curve_is_whole),
        cmocka_unit_test(a_long_curve_is_thinned_on_either_side),
        cmocka_unit_test(a_lone_peak_survives),
        cmocka_unit_test(values_are_those_of_the_header),
    };
    return cmocka_run_group_tests_name("curve_grid", tests, NULL, NULL);
}
