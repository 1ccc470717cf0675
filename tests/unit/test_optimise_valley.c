/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Least squares along the floor of a valley that bends: parameters that stand in for one another over a long record leave one. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "maths/maths.h"

/* r = (s (y − x²), x − 2): the floor y = x² ends at (2, 4); *context is s. */
static enum bf_status value(void *context, const double x[], double *half_square, struct bf_error *err)
{
    const double steep = *(const double *)context, wall = steep * (x[1] - x[0] * x[0]), along = x[0] - 2.0;
    (void)err;
    *half_square = 0.5 * (wall * wall + along * along);
    return BF_OK;
}

static enum bf_status derivative(void *context, const double x[], double *half_square, double gradient[], double gram[],
                                 struct bf_error *err)
{
    const double steep = *(const double *)context, wall = steep * (x[1] - x[0] * x[0]), along = x[0] - 2.0;
    const double J[2][2] = {{-2.0 * steep * x[0], steep}, {1.0, 0.0}};
    for (int i = 0; i < 2; i++) {
        gradient[i] = J[0][i] * wall + J[1][i] * along;
        for (int j = 0; j < 2; j++)
            gram[i + 2 * j] = J[0][i] * J[0][j] + J[1][i] * J[1][j];
    }
    return value(context, x, half_square, err);
}

static struct optimise_result descend(double steep, double x[2])
{
    const struct least_squares problem = {.n = 2, .context = &steep, .value = value, .derivative = derivative};
    const struct optimise_options options = {.iterations = 2000, .tolerance = 1e-12};
    struct optimise_result out;
    struct bf_error err;
    x[0] = -2.0, x[1] = 4.0;
    assert_int_equal(optimise_local(&problem, &options, x, &out, &err), BF_OK);
    return out;
}

/*
 * A step l along the floor leaves it by l²: it goes down where (s l²)² is less than what l brings, so that the way of 4 takes some s^(2/3) steps, 470 here. With a
 * step back from the wall l may be longer: a third of the derivatives are enough.
 */
static void the_walls_lead_along_the_bend(void **state)
{
    const double steep = 1e3;
    (void)state;
    double x[2];
    const struct optimise_result out = descend(steep, x);
    assert_int_equal(out.end, OPTIMISE_CONVERGED);
    assert_true(fabs(x[0] - 2.0) < 1e-5 && fabs(x[1] - 4.0) < 4e-5);
    assert_true(out.derivatives < 200 && out.values < 250);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_walls_lead_along_the_bend)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
