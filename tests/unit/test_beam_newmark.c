/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"
#include "newmark.h"

enum { OUT = BEAM_OUTPUTS };
static struct beam_case c;
static struct beam_newmark newmark;
static struct beam_newmark_state run;

static void build(double dt_s)
{
    assert_int_equal(beam_assemble(&c.description, &c.model), BEAM_OK);
    assert_int_equal(beam_newmark_factor(&c.model, dt_s, &newmark), BEAM_OK);
    memset(&run, 0, sizeof run);
}

static void undamped(void)
{
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.parameters.cDI_beam_sNm2 = c.description.parameters.cDI_patch_sNm2 = 0.0;
    c.description.parameters.gamma_sNpm2 = 0.0;
}

static double energy(void)
{
    double sum = 0.0;
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            sum += 0.5 * (run.v[i] * c.model.M[i][j] * run.v[j] + run.y[i] * c.model.K[i][j] * run.y[j]);
    return sum;
}

/* Start in undamped mode j with amplitude 1 mm of its shape, at rest. */
static void start_in_mode(int j, struct beam_modes *modes)
{
    assert_int_equal(beam_find_modes(&c.model, modes), BEAM_OK);
    for (int i = 0; i < BEAM_N; i++) {
        run.y[i] = 1e-3 * modes->shape[i][j];
        run.a[i] = -modes->omega_radps[j] * modes->omega_radps[j] * run.y[i];
    }
}

static void energy_is_kept_without_damping_and_falls_with_it(void **state)
{
    const double in[2] = {0};
    double y[OUT];
    struct beam_modes modes;
    (void)state;
    for (int damped = 0; damped < 2; damped++)
        for (int power = 0; power < 4; power++) { /* unconditionally stable: up to 1.25 s */
            const double dt_s = 1e-5 * pow(50.0, power);
            undamped();
            if (damped)
                c.description.parameters.gamma_sNpm2 = 0.05;
            build(dt_s);
            start_in_mode(1, &modes);
            const double first = energy();
            double last = first * (1 + 1e-9);
            for (int k = 0; k < 2000; k++) {
                assert_int_equal(beam_newmark_step(&newmark, &run, in, y), BEAM_OK);
                assert_true(energy() <= last + 1e-9 * first);
                last = damped ? energy() : last;
            }
            if (!damped)
                assert_close(energy() / first, 1.0, 1e-6);
        }
}

static void frequency_is_warped_by_the_textbook_factor(void **state)
{
    const double in[2] = {0}, dt_s = 1.0 / 1024.0;
    double y[OUT];
    struct beam_modes modes;
    (void)state;
    for (int j = 0; j < 5; j++) {
        undamped();
        build(dt_s);
        start_in_mode(j, &modes);
        const double omega = modes.omega_radps[j], warped = 2.0 / dt_s * atan(omega * dt_s / 2.0);
        for (int k = 1; k < 400; k++) {
            assert_int_equal(beam_newmark_step(&newmark, &run, in, y), BEAM_OK);
            double amplitude = 0.0; /* modal coordinate: ψᵀ M y */
            for (int i = 0; i < BEAM_N; i++)
                for (int m = 0; m < BEAM_N; m++)
                    amplitude += modes.shape[i][j] * c.model.M[i][m] * run.y[m];
            assert_close(amplitude / 1e-3, cos(warped * dt_s * k), 1e-5);
        }
    }
}

/* Against the exact step; forced, all outputs; and with a law. */
static void errors_fall_with_the_square_of_the_step(void **state)
{
    enum { SAMPLES = 128 };
    double error[4][OUT];
    (void)state;
    for (int with_law = 0; with_law < 2; with_law++) {
        double expected[OUT][SAMPLES], in[2], y[OUT];
        for (int pass = 0; pass < 4; pass++) { /* pass 0: the exact step at the finest interval */
            const int fold = pass == 0 ? 512 : 128 << (pass - 1);
            const double dt_s = 1.0 / 512.0 / fold;
            double sum[OUT] = {0}, size[OUT] = {0};
            c.description = case_description(BEAM_BASIS_PATCH);
            if (with_law)
                case_add_effect(&c.description, beam_effect_find("cubic_stiffness"), 0, 1e6, beam_length(), 0);
            build(dt_s);
            if (pass == 0)
                case_build(&c, dt_s, BEAM_HOLD_FIRST_ORDER);
            for (int k = 0; k < SAMPLES * fold; k++) {
                in[0] = case_hit(k * dt_s, 0.1, 60.0);
                in[1] = 0.0;
                assert_int_equal(pass == 0 ? beam_step(&c.plan, &c.state, in, y)
                                           : beam_newmark_step(&newmark, &run, in, y),
                                 BEAM_OK);
                for (int o = 0; o < OUT && k % fold == 0; o++) {
                    if (pass == 0)
                        expected[o][k / fold] = y[o];
                    sum[o] += (y[o] - expected[o][k / fold]) * (y[o] - expected[o][k / fold]);
                    size[o] += expected[o][k / fold] * expected[o][k / fold];
                }
            }
            for (int o = 0; o < OUT; o++)
                error[pass][o] = sqrt(sum[o] / size[o]);
        }
        for (int o = 0; o < OUT; o++) {
            assert_true(error[3][o] < 1e-4);
            if (o != 1) /* next to the hammer the reference's linear hold is the larger error of the acceleration */
                assert_close(error[2][o] / error[3][o], 4.0, 0.3);
        }
    }
}

static void memory_and_bad_steps_are_refused(void **state)
{
    (void)state;
    undamped();
    assert_int_equal(beam_assemble(&c.description, &c.model), BEAM_OK);
    assert_int_equal(beam_newmark_factor(&c.model, 0.0, &newmark), BEAM_ERROR_INTERVAL);
    assert_int_equal(beam_newmark_factor(&c.model, INFINITY, &newmark), BEAM_ERROR_INTERVAL);
    c.model.M[0][0] = c.model.K[0][0] = -1.0;
    assert_int_equal(beam_newmark_factor(&c.model, 1e-3, &newmark), BEAM_ERROR_MASS);
    c.model.M[0][0] = NAN;
    assert_int_equal(beam_newmark_factor(&c.model, 1e-3, &newmark), BEAM_ERROR_NOT_FINITE);
    case_add_effect(&c.description, beam_effect_find("viscoelastic"), 0, 0.02, 5e-3, 0);
    assert_int_equal(beam_assemble(&c.description, &c.model), BEAM_OK);
    assert_int_equal(beam_newmark_factor(&c.model, 1e-3, &newmark), BEAM_ERROR_MEMORY);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(energy_is_kept_without_damping_and_falls_with_it),
        cmocka_unit_test(frequency_is_warped_by_the_textbook_factor),
        cmocka_unit_test(errors_fall_with_the_square_of_the_step),
        cmocka_unit_test(memory_and_bad_steps_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
