/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Least squares along the floor of a valley that bends: parameters that stand in for one another over a long record leave one. */
#include "optimise_problem.h"

/* Rosenbrock's valley, ten times as narrow, with so much that nothing takes: each full step promises more than a hundredth, and the valley bends. */
static bool bent_valley(const double x[], double r[], double J[])
{
    r[0] = 1000.0 * (x[1] - x[0] * x[0]), r[1] = 1.0 - x[0], r[2] = 4.0;
    J[0] = -2000.0 * x[0], J[1] = -1.0, J[2] = 0.0, J[3] = 1000.0, J[4] = J[5] = 0.0;
    return true;
}

/* What creeps along a valley ends where its steps together bring as little as is asked of one; to the minimum, where no share is asked for. */
static void a_descent_that_creeps_ends(void **state)
{
    (void)state;
    struct problem p = {.m = 3, .n = 2, .residual = bent_valley};
    const struct least_squares problem = view(&p, NULL, NULL);
    struct optimise_options options = {.iterations = 500, .radius = 0.02, .radius_max = 0.02};
    struct optimise_result out, all;
    struct bf_error err;
    double x[] = {-1.2, 1.44}, to_the_end[] = {-1.2, 1.44};
    assert_int_equal(optimise_local(&problem, &options, to_the_end, &all, &err), BF_OK);
    assert_near(all.half_square, 8.0, 1e-6);
    options.relative = 0.05;
    assert_int_equal(optimise_local(&problem, &options, x, &out, &err), BF_OK);
    assert_int_equal(out.end, OPTIMISE_CONVERGED);
    assert_true(out.decrement >
                options.relative * out.half_square); /* it is not what one more step promises that ends it */
    assert_true(out.derivatives < all.derivatives / 2);
}

/* The floor y = x² ends at (2, 4). */
static bool steep_valley(const double x[], double r[], double J[])
{
    r[0] = 1000.0 * (x[1] - x[0] * x[0]), r[1] = x[0] - 2.0;
    J[0] = -2000.0 * x[0], J[1] = 1.0, J[2] = 1000.0, J[3] = 0.0;
    return true;
}

/*
 * Of steepness s, a step l along the floor leaves it by l²: it goes down where (s l²)² is less than what l brings, so that the way of 4 takes some 4 s^(2/3) steps. With
 * a step back from the wall l may be longer: less than half as many are enough.
 */
static void the_walls_lead_along_the_bend(void **state)
{
    (void)state;
    struct problem p = {.m = 2, .n = 2, .residual = steep_valley};
    const struct least_squares problem = view(&p, NULL, NULL);
    const struct optimise_options options = {.iterations = 2000, .tolerance = 1e-12};
    struct optimise_result out;
    struct bf_error err;
    double x[] = {-2.0, 4.0};
    assert_int_equal(optimise_local(&problem, &options, x, &out, &err), BF_OK);
    assert_int_equal(out.end, OPTIMISE_CONVERGED);
    assert_near(x[0], 2.0, 1e-5);
    assert_near(x[1], 4.0, 4e-5);
    assert_true(out.derivatives < 200 && out.values < 250);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_descent_that_creeps_ends),
        cmocka_unit_test(the_walls_lead_along_the_bend),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
