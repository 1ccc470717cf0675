/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"

enum { N = 2048, OUT = BEAM_OUTPUTS };
static struct beam_case c;
static struct beam_plan narrowed;
static double u[2 * N], before[OUT * N], after[OUT * N];

static void build(double damping, double dt_s, enum beam_hold hold)
{
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.parameters.cDI_beam_sNm2 *= damping;
    c.description.parameters.cDI_patch_sNm2 *= damping;
    c.description.parameters.gamma_sNpm2 *= damping;
    case_build(&c, dt_s, hold);
    narrowed = c.plan;
    assert_int_equal(beam_narrow(&narrowed), BEAM_OK);
}

static void every_number_is_a_float(void **state)
{
    (void)state;
    for (int hold = 0; hold < 3; hold++) {
        build(1.0, 1.0 / 1024.0, (enum beam_hold)hold);
        const double *x = (const double *)&narrowed.x;
        for (int i = 0; i < BEAM_PLAN_NUMBERS; i++)
            assert_true((double)(float)x[i] == x[i]);
    }
}

/* Size and angle of each pair to 1e-10, where plain rounding leaves 1e-8; angles near whole half turns excepted. */
static void eigenvalues_survive(void **state)
{
    (void)state;
    for (int damped = 0; damped < 2; damped++)
        for (int power = 0; power < 9; power++) {
            const double rate_Hz = 256.0 * pow(1.7, power);
            build(damped, 1.0 / rate_Hz, BEAM_HOLD_FIRST_ORDER);
            for (int b = 0; b < BEAM_N; b++) {
                const double *p = narrowed.x.phi[b], angle = c.work.poles.im[b] / rate_Hz;
                const double determinant = p[0] + p[3] + p[0] * p[3] - p[1] * p[2]; /* − 1 */
                const double exact = expm1(2.0 * c.work.poles.re[b] / rate_Hz);
                assert_close(determinant, exact, 2e-10);
                assert_true(determinant <= exact + 1e-15);
                const double size = exp(c.work.poles.re[b] / rate_Hz);
                if (size * fabs(sin(angle)) > 0.5 * fabs(size * cos(angle) - 1.0)) {
                    const double trace = 2.0 * size * cos(angle) - 2.0;
                    assert_close(p[0] + p[3], trace, 2e-10);
                }
            }
            assert_int_equal(beam_plan_check(&narrowed), BEAM_OK);
        }
}

static void the_outputs_stay(void **state)
{
    unsigned seed = 2;
    (void)state;
    for (int k = 0; k < 2 * N; k++)
        u[k] = case_random(&seed);
    for (int hold = 0; hold < 3; hold++) {
        build(1.0, 1.0 / 1024.0, (enum beam_hold)hold);
        case_run(&c, N, u, before);
        c.plan = narrowed;
        beam_reset(&c.plan, &c.state);
        case_run(&c, N, u, after);
        for (int o = 0; o < OUT; o++)
            assert_true(case_rms_difference(N, before + o * N, after + o * N) < 5e-6 * case_rms(N, before + o * N));
    }
}

static void narrowing_twice_changes_little_and_a_bad_plan_is_refused(void **state)
{
    (void)state;
    build(1.0, 1.0 / 1024.0, BEAM_HOLD_FIRST_ORDER);
    const struct beam_plan once = narrowed;
    assert_int_equal(beam_narrow(&narrowed), BEAM_OK);
    for (int b = 0; b < BEAM_N; b++)
        for (int i = 0; i < 4; i++)
            assert_close(narrowed.x.phi[b][i], once.x.phi[b][i], 1e-9);
    narrowed.x.phi[0][0] = 1.0;
    assert_int_equal(beam_narrow(&narrowed), BEAM_ERROR_PLAN);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_number_is_a_float),
        cmocka_unit_test(eigenvalues_survive),
        cmocka_unit_test(the_outputs_stay),
        cmocka_unit_test(narrowing_twice_changes_little_and_a_bad_plan_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
