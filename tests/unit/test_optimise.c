/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The optimiser on problems whose answers are known. */
#include "optimise_problem.h"

static bool rosenbrock(const double x[], double r[], double J[])
{
    r[0] = 10.0 * (x[1] - x[0] * x[0]), r[1] = 1.0 - x[0];
    J[0] = -20.0 * x[0], J[1] = -1.0, J[2] = 10.0, J[3] = 0.0;
    return true;
}

static void rosenbrock_is_solved(void **state)
{
    (void)state;
    struct bf_error err;
    struct problem p = {.m = 2, .n = 2, .residual = rosenbrock};
    const struct least_squares problem = view(&p, NULL, NULL);
    struct optimise_result result;
    double x[2] = {-1.2, 1.0};
    assert_int_equal(optimise_local(&problem, NULL, x, &result, &err), BF_OK);
    assert_int_equal(result.end, OPTIMISE_CONVERGED);
    assert_near(x[0], 1.0, 1e-3);
    assert_near(x[1], 1.0, 2e-3);
    assert_true(result.half_square <= 1e-6);
}

/* A misfit that no values explain, and large residuals: Gauss–Newton goes on for long. */
static bool unexplained(const double x[], double r[], double J[])
{
    r[0] = 10.0 + x[0] * x[0] - x[1], r[1] = 8.0 - x[0] + 0.3 * x[1] * x[1], r[2] = x[0] + x[1];
    J[0] = 2.0 * x[0], J[1] = -1.0, J[2] = 1.0, J[3] = -1.0, J[4] = 0.6 * x[1], J[5] = 1.0;
    return true;
}

/* Far above the noise a share of what is above it ends the descent, sooner and where nothing that counts is left; below the noise it ends nothing. */
static void what_is_above_the_noise_ends_a_descent(void **state)
{
    (void)state;
    struct bf_error err;
    struct problem p = {.m = 3, .n = 2, .residual = unexplained};
    const struct least_squares problem = view(&p, NULL, NULL);
    const struct optimise_options to_the_end = {.tolerance = 1e-12}, above = {.tolerance = 1e-12, .form = 1e-3},
                                  below = {.tolerance = 1e-12, .form = 1e-3, .noise = 1e6};
    struct optimise_result end, sooner, other;
    double x[2] = {3.0, -2.0}, x_sooner[2] = {3.0, -2.0}, x_other[2] = {3.0, -2.0};
    assert_int_equal(optimise_local(&problem, &to_the_end, x, &end, &err), BF_OK);
    assert_int_equal(optimise_local(&problem, &above, x_sooner, &sooner, &err), BF_OK);
    assert_int_equal(optimise_local(&problem, &below, x_other, &other, &err), BF_OK);
    assert_true(sooner.derivatives < end.derivatives);
    assert_int_equal(sooner.end, OPTIMISE_CONVERGED);
    assert_true(sooner.half_square <= 1.01 * end.half_square);
    assert_int_equal(other.derivatives, end.derivatives);
}

/* What is enough is not looked at closer: one derivative less, and none where the start is enough already. */
static void enough_ends_a_descent_without_another_derivative(void **state)
{
    (void)state;
    struct bf_error err;
    struct problem p = {.m = 3, .n = 2, .residual = unexplained};
    const struct least_squares problem = view(&p, NULL, NULL);
    struct optimise_result end, enough;
    double x[2] = {3.0, -2.0}, there[2] = {3.0, -2.0};
    assert_int_equal(optimise_local(&problem, NULL, x, &end, &err), BF_OK);
    const struct optimise_options options = {.enough = 1.001 * end.half_square};
    assert_int_equal(optimise_local(&problem, &options, there, &enough, &err), BF_OK);
    assert_int_equal(enough.end, OPTIMISE_CONVERGED);
    assert_true(enough.half_square <= options.enough && enough.derivatives < end.derivatives);
    assert_int_equal(optimise_local(&problem, &options, there, &enough, &err), BF_OK);
    assert_int_equal(enough.derivatives, 0);
    assert_int_equal(enough.values, 1);
}

/* With x₀ ≤ 0.8 the minimum lies on the bound: r₁ = 0.2, x₁ = 0.64. */
static void a_bound_is_kept_and_reached(void **state)
{
    (void)state;
    struct bf_error err;
    const double lower[2] = {-3.0, -3.0}, upper[2] = {0.8, 3.0};
    struct problem p = {.m = 2, .n = 2, .residual = rosenbrock};
    const struct least_squares problem = view(&p, lower, upper);
    struct optimise_result result;
    double x[2] = {-1.2, 1.0};
    assert_int_equal(optimise_local(&problem, NULL, x, &result, &err), BF_OK);
    assert_int_equal(result.end, OPTIMISE_CONVERGED);
    assert_true(x[0] == 0.8);
    assert_near(x[1], 0.64, 1e-3);
    assert_near(result.half_square, 0.02, 1e-6);
}

/* r = x₀ + x₁ − 3: a line of minima; the nearest to the start is the start moved along (1, 1). */
static bool sum_only(const double x[], double r[], double J[])
{
    r[0] = x[0] + x[1] - 3.0;
    J[0] = J[1] = 1.0;
    return true;
}

static void a_null_direction_is_not_moved(void **state)
{
    (void)state;
    struct bf_error err;
    struct problem p = {.m = 1, .n = 2, .residual = sum_only};
    const struct least_squares problem = view(&p, NULL, NULL);
    struct optimise_result result;
    double x[2] = {5.0, -1.0};
    assert_int_equal(optimise_local(&problem, NULL, x, &result, &err), BF_OK);
    assert_near(x[0] + x[1], 3.0, 1e-3);
    assert_near(x[0] - x[1], 6.0, 1e-9);
}

/* The full step is (100, −100). Cut to the bounds it would be (14, −1), far up the steep side of the valley. */
static bool narrow_valley(const double x[], double r[], double J[])
{
    r[0] = 100.0 * (x[0] + x[1]), r[1] = 0.01 * (x[0] - x[1]) - 2.0;
    J[0] = 100.0, J[1] = 0.01, J[2] = 100.0, J[3] = -0.01;
    return true;
}

static void far_bounds_do_not_fake_convergence(void **state)
{
    (void)state;
    struct bf_error err;
    const double lower[2] = {-14.0, -1.0}, upper[2] = {14.0, 1.0};
    struct problem p = {.m = 2, .n = 2, .residual = narrow_valley};
    const struct least_squares problem = view(&p, lower, upper);
    struct optimise_result result;
    double x[2] = {0.0, 0.0};
    assert_int_equal(optimise_local(&problem, NULL, x, &result, &err), BF_OK);
    assert_near(x[0], 1.0, 1e-3);
    assert_near(x[1], -1.0, 1e-3);
}

static void the_decrement_sees_the_distance(void **state)
{
    (void)state;
    struct bf_error err;
    const struct least_squares problem = {.n = 2};
    const double x[2] = {0.0, 0.0}, gradient[2] = {2.0, 0.0}, gram[4] = {4.0, 0.0, 0.0, 1.0};
    double decrement, step[2];
    assert_int_equal(optimise_decrement(&problem, x, gradient, gram, 0.0, &decrement, step, &err), BF_OK);
    assert_near(decrement, 0.5, 1e-14); /* ½ g²/H */
    assert_near(step[0], -0.5, 1e-14);
    const double bound[2] = {0.0, -1.0};
    const struct least_squares held = {.n = 2, .lower = bound};
    assert_int_equal(optimise_decrement(&held, x, gradient, gram, 0.0, &decrement, NULL, &err), BF_OK);
    assert_true(decrement == 0.0); /* pressed against its bound */
}

/* log(x) has no value below 0: the first full step from 20 would land at −40. */
static bool logarithm(const double x[], double r[], double J[])
{
    if (x[0] <= 0.0)
        return false;
    r[0] = log(x[0]);
    J[0] = 1.0 / x[0];
    return true;
}

static void a_step_without_a_value_is_shortened(void **state)
{
    (void)state;
    struct bf_error err;
    struct problem p = {.m = 1, .n = 1, .residual = logarithm};
    const struct least_squares problem = view(&p, NULL, NULL);
    const struct optimise_options options = {.radius = 100.0, .radius_max = 100.0};
    struct optimise_result result;
    double x[1] = {20.0};
    assert_int_equal(optimise_local(&problem, &options, x, &result, &err), BF_OK);
    assert_near(x[0], 1.0, 2e-3);
    x[0] = -1.0;
    assert_int_equal(optimise_local(&problem, &options, x, &result, &err), BF_NUMERIC);
}

/* arctan x, seen between refinements through its tangent at the last one, which promises falls that are not there. */
static enum bf_status tangent_value(void *context, const double x[], double *half_square, struct bf_error *err)
{
    (void)err;
    const double base = *(const double *)context, r = atan(base) + (x[0] - base) / (1.0 + base * base);
    *half_square = 0.5 * r * r;
    return BF_OK;
}

static enum bf_status tangent_derivative(void *context, const double x[], double *half_square, double gradient[],
                                         double gram[], struct bf_error *err)
{
    double *base = context;
    if (fabs(x[0] - *base) > 0.03)
        *base = x[0];
    const double slope = 1.0 / (1.0 + *base * *base);
    gram[0] = slope * slope;
    gradient[0] = slope * (atan(*base) + (x[0] - *base) * slope);
    return tangent_value(context, x, half_square, err);
}

static void a_fall_that_a_refinement_denies_is_taken_back(void **state)
{
    (void)state;
    struct bf_error err;
    double base = 1e3, x[1] = {3.0}; /* from 3 a Gauss-Newton step goes to -9.5, and on for ever */
    const struct least_squares problem = {
        .n = 1, .context = &base, .value = tangent_value, .derivative = tangent_derivative};
    const struct optimise_options options = {.radius = 1e9, .radius_max = 1e9};
    struct optimise_result result;
    assert_int_equal(optimise_local(&problem, &options, x, &result, &err), BF_OK);
    assert_int_equal(result.end, OPTIMISE_CONVERGED);
    assert_near(x[0], 0.0, 2e-3);
}

/* From far out seven falls in a row are denied: a search that was stopped on the way has not come to its end. */
static void what_is_taken_back_does_not_creep(void **state)
{
    (void)state;
    struct bf_error err;
    double base = 1e5, x[1] = {3e4};
    const struct least_squares problem = {
        .n = 1, .context = &base, .value = tangent_value, .derivative = tangent_derivative};
    const struct optimise_options options = {
        .iterations = 500, .radius = 1e12, .radius_max = 1e12, .tolerance = 1e-12, .relative = 1e-4};
    struct optimise_result result;
    assert_int_equal(optimise_local(&problem, &options, x, &result, &err), BF_OK);
    assert_int_equal(result.end, OPTIMISE_CONVERGED);
    assert_near(x[0], 0.0, 2e-3);
}

/* ln x through its tangent, as above; there is nothing at x <= 0, which the tangent does not know. */
static enum bf_status strut_value(void *context, const double x[], double *half_square, struct bf_error *err)
{
    (void)err;
    const double base = *(const double *)context, r = log(base) + (x[0] - base) / base;
    *half_square = 0.5 * r * r;
    return BF_OK;
}

static enum bf_status strut_derivative(void *context, const double x[], double *half_square, double gradient[],
                                       double gram[], struct bf_error *err)
{
    double *base = context;
    if (!(x[0] > 0.0))
        return bf_fail(err, BF_NUMERIC, "the strut has buckled");
    if (fabs(x[0] - *base) > 0.03)
        *base = x[0];
    const double slope = 1.0 / *base;
    gram[0] = slope * slope;
    gradient[0] = slope * (log(*base) + (x[0] - *base) * slope);
    return strut_value(context, x, half_square, err);
}

static void a_step_to_where_a_refinement_has_no_value_is_taken_back(void **state)
{
    (void)state;
    struct bf_error err;
    double base = 1e3, x[1] = {4.0}; /* from 4 a Gauss-Newton step goes to -1.5 */
    const struct least_squares problem = {
        .n = 1, .context = &base, .value = strut_value, .derivative = strut_derivative};
    const struct optimise_options options = {.radius = 1e9, .radius_max = 1e9};
    struct optimise_result result;
    assert_int_equal(optimise_local(&problem, &options, x, &result, &err), BF_OK);
    assert_int_equal(result.end, OPTIMISE_CONVERGED);
    assert_near(x[0], 1.0, 2e-3);
}

static void an_interruption_keeps_the_best(void **state)
{
    (void)state;
    struct bf_error err;
    struct problem p = {.m = 2, .n = 2, .residual = rosenbrock, .stop_after = 6};
    const struct least_squares problem = view(&p, NULL, NULL);
    struct optimise_result result;
    double x[2] = {-1.2, 1.0}, start, now;
    assert_int_equal(value(&p, x, &start, &err), BF_OK);
    p.calls = 0;
    assert_int_equal(optimise_local(&problem, NULL, x, &result, &err), BF_OK);
    assert_int_equal(result.end, OPTIMISE_INTERRUPTED);
    assert_int_equal(value(&p, x, &now, &err), BF_OK);
    assert_true(now < start);
    assert_true(now == result.half_square);
}

static void the_polish_finds_what_is_left_and_nothing_at_the_optimum(void **state)
{
    (void)state;
    struct bf_error err;
    struct problem p = {.m = 2, .n = 2, .residual = rosenbrock};
    const struct least_squares problem = view(&p, NULL, NULL);
    double x[2] = {0.9, 0.8}, gain;
    assert_int_equal(optimise_polish(&problem, 200, x, &gain, &err), BF_OK);
    assert_true(gain > 1e-3);
    assert_near(x[0], 1.0, 1e-2);
    double at[2] = {1.0, 1.0};
    assert_int_equal(optimise_polish(&problem, 200, at, &gain, &err), BF_OK);
    assert_true(gain == 0.0);
    assert_true(at[0] == 1.0 && at[1] == 1.0);
}

/* Local minima near every odd multiple of 1/6; the global one at x = 0.5. */
static bool many_minima(const double x[], double r[], double J[])
{
    r[0] = sin(6.0 * M_PI * (x[0] - 0.5)), r[1] = 2.0 * (x[0] - 0.5);
    J[0] = 6.0 * M_PI * cos(6.0 * M_PI * (x[0] - 0.5)), J[1] = 2.0;
    return true;
}

static void every_global_search_leaves_the_local_minimum(void **state)
{
    (void)state;
    struct bf_error err;
    const double lower[1] = {-4.0}, upper[1] = {4.0};
    struct problem p = {.m = 2, .n = 1, .residual = many_minima};
    const struct least_squares problem = view(&p, lower, upper);
    struct optimise_result result;
    double x[1] = {2.0};
    assert_int_equal(optimise_local(&problem, NULL, x, &result, &err), BF_OK);
    assert_true(fabs(x[0] - 0.5) > 0.5); /* the local search is trapped: the problem is a real one */
    const enum optimise_search searches[] = {OPTIMISE_CRS, OPTIMISE_DIRECT, OPTIMISE_MLSL};
    for (size_t i = 0; i < 3; i++) {
        double y[1] = {2.0}, half_square;
        assert_int_equal(optimise_global(&problem, searches[i], 400, y, &half_square, &err), BF_OK);
        assert_near(y[0], 0.5, 0.05);
    }
}

static void a_search_without_a_box_is_refused(void **state)
{
    (void)state;
    struct bf_error err;
    struct problem p = {.m = 2, .n = 1, .residual = many_minima};
    const struct least_squares problem = view(&p, NULL, NULL);
    double x[1] = {0.0}, half_square;
    assert_int_equal(optimise_global(&problem, OPTIMISE_CRS, 10, x, &half_square, &err), BF_USAGE);
}

static void no_unknowns_is_no_problem(void **state)
{
    (void)state;
    struct bf_error err;
    struct problem p = {.m = 1, .n = 0, .residual = sum_only};
    const struct least_squares problem = view(&p, NULL, NULL);
    struct optimise_result result;
    double x[2] = {1.0, 1.0}, gain;
    assert_int_equal(optimise_local(&problem, NULL, x, &result, &err), BF_OK);
    assert_near(result.half_square, 0.5, 1e-15);
    assert_int_equal(optimise_polish(&problem, 10, x, &gain, &err), BF_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rosenbrock_is_solved),
        cmocka_unit_test(what_is_above_the_noise_ends_a_descent),
        cmocka_unit_test(enough_ends_a_descent_without_another_derivative),
        cmocka_unit_test(a_bound_is_kept_and_reached),
        cmocka_unit_test(a_null_direction_is_not_moved),
        cmocka_unit_test(far_bounds_do_not_fake_convergence),
        cmocka_unit_test(the_decrement_sees_the_distance),
        cmocka_unit_test(a_step_without_a_value_is_shortened),
        cmocka_unit_test(a_fall_that_a_refinement_denies_is_taken_back),
        cmocka_unit_test(what_is_taken_back_does_not_creep),
        cmocka_unit_test(a_step_to_where_a_refinement_has_no_value_is_taken_back),
        cmocka_unit_test(an_interruption_keeps_the_best),
        cmocka_unit_test(the_polish_finds_what_is_left_and_nothing_at_the_optimum),
        cmocka_unit_test(every_global_search_leaves_the_local_minimum),
        cmocka_unit_test(a_search_without_a_box_is_refused),
        cmocka_unit_test(no_unknowns_is_no_problem),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
