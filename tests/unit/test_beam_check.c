/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"

static struct beam_case c;
static struct beam_plan plan;

static void build(void)
{
    c.description = case_description(BEAM_BASIS_PATCH);
    case_add_effect(&c.description, beam_effect_find("cubic_stiffness"), 0, 1e4, beam_length(), 0);
    case_add_effect(&c.description, beam_effect_find("sensor_delay"), 1u, 1.5e-3, 0, 0);
    case_build(&c, 1.0 / 1024.0, BEAM_HOLD_BAND_LIMITED);
    plan = c.plan;
}

static void every_status_has_its_own_text_and_actor(void **state)
{
    const enum beam_status all[] = {BEAM_OK,
                                    BEAM_ERROR_ARGUMENT,
                                    BEAM_ERROR_INTERVAL,
                                    BEAM_ERROR_CAPACITY,
                                    BEAM_ERROR_EFFECT,
                                    BEAM_ERROR_NEEDS_HOST,
                                    BEAM_ERROR_NOT_FINITE,
                                    BEAM_ERROR_PARAMETER,
                                    BEAM_ERROR_EFFECT_RANGE,
                                    BEAM_ERROR_PLACE,
                                    BEAM_ERROR_ASYMMETRIC,
                                    BEAM_ERROR_MASS,
                                    BEAM_ERROR_STIFFNESS,
                                    BEAM_ERROR_MEMORY,
                                    BEAM_ERROR_UNSTABLE,
                                    BEAM_ERROR_DEFECTIVE,
                                    BEAM_ERROR_FILTER,
                                    BEAM_ERROR_PLAN,
                                    BEAM_ERROR_SOLVE,
                                    BEAM_ERROR_STATE};
    const size_t n = sizeof all / sizeof *all;
    (void)state;
    for (size_t i = 0; i < n; i++) {
        assert_non_null(beam_status_text(all[i]));
        for (size_t j = 0; j < i; j++)
            assert_string_not_equal(beam_status_text(all[i]), beam_status_text(all[j]));
        const enum beam_actor actor = i == 0      ? BEAM_ACTOR_NOBODY
                                      : i < 6     ? BEAM_ACTOR_CALLER
                                      : i < n - 2 ? BEAM_ACTOR_MODEL
                                                  : BEAM_ACTOR_DEVICE;
        assert_int_equal(beam_status_actor(all[i]), actor);
    }
    assert_string_equal(beam_status_text((enum beam_status) - 99), "unknown status");
}

static void a_good_model_and_plan_pass(void **state)
{
    (void)state;
    build();
    assert_int_equal(beam_model_check(&c.model), BEAM_OK);
    assert_int_equal(beam_plan_check(&plan), BEAM_OK);
}

static void models_filled_from_outside_are_checked(void **state)
{
    struct beam_model bad;
    (void)state;
    build();
    bad = c.model;
    bad.n_ports = BEAM_PORTS + 1;
    assert_int_equal(beam_model_check(&bad), BEAM_ERROR_CAPACITY);
    bad = c.model;
    bad.n_inputs = -1;
    assert_int_equal(beam_model_check(&bad), BEAM_ERROR_ARGUMENT);
    bad = c.model;
    bad.use[0].effect = NULL;
    assert_int_equal(beam_model_check(&bad), BEAM_ERROR_EFFECT);
    bad = c.model;
    bad.port[0].use = 1; /* a delay has no law */
    assert_int_equal(beam_model_check(&bad), BEAM_ERROR_ARGUMENT);
    bad = c.model;
    bad.port[0].use = 7;
    assert_int_equal(beam_model_check(&bad), BEAM_ERROR_ARGUMENT);
    bad = c.model;
    bad.port[0].coordinate = 1; /* a point begins with 0 */
    assert_int_equal(beam_model_check(&bad), BEAM_ERROR_ARGUMENT);
    bad = c.model;
    bad.M[2][3] += 1.0;
    assert_int_equal(beam_model_check(&bad), BEAM_ERROR_ASYMMETRIC);
    double *const poison[] = {&bad.M[9][9],
                              &bad.C[0][1],
                              &bad.K[1][0],
                              &bad.input[1].vector[3],
                              &bad.output[3].vector[9],
                              &bad.port[0].vector[0],
                              &bad.port[0].weight,
                              &bad.base_load[5],
                              &bad.use[1].p[0]};
    for (size_t i = 0; i < sizeof poison / sizeof *poison; i++)
        for (int kind = 0; kind < 2; kind++) {
            bad = c.model;
            *poison[i] = kind ? NAN : INFINITY;
            assert_int_equal(beam_model_check(&bad), BEAM_ERROR_NOT_FINITE);
        }
}

static void every_number_of_a_plan_must_be_finite(void **state)
{
    (void)state;
    build();
    double *x = (double *)&plan.x;
    for (int i = 0; i < BEAM_PLAN_NUMBERS; i++) {
        const double kept = x[i];
        x[i] = i % 2 ? NAN : -INFINITY;
        assert_int_equal(beam_plan_check(&plan), BEAM_ERROR_PLAN);
        x[i] = kept;
    }
    assert_int_equal(beam_plan_check(&plan), BEAM_OK);
}

/* Every count, set to wild values: either refused, or a plan that runs inside its arrays (sanitizers watch). */
static void no_count_can_lead_outside_the_arrays(void **state)
{
    const int wild[] = {-2147483647 - 1, -100, -1, 0, 1, 2, 3, 7, 13, 64, 513, 4096, 2147483647};
    const double in[2] = {1.0, 1.0};
    double y[BEAM_OUTPUTS];
    int refused = 0, run = 0;
    (void)state;
    build();
    int *n = (int *)&plan.n;
    for (int i = 0; i < BEAM_PLAN_COUNTS; i++)
        for (size_t w = 0; w < sizeof wild / sizeof *wild; w++) {
            const int kept = n[i];
            n[i] = wild[w];
            if (beam_plan_check(&plan) == BEAM_OK) {
                beam_reset(&plan, &c.state);
                for (int k = 0; k < 4; k++)
                    (void)beam_step(&plan, &c.state, in, y);
                run++;
            } else {
                refused++;
            }
            n[i] = kept;
        }
    assert_true(refused > 300 && run > 0);
}

static void blocks_that_grow_are_refused(void **state)
{
    (void)state;
    for (int b = 0; b < BEAM_N; b++) {
        build();
        plan.x.phi[b][0] = plan.x.phi[b][3] = 0.01; /* 1.01 ± i θ */
        assert_int_equal(beam_plan_check(&plan), BEAM_ERROR_PLAN);
        build();
        plan.x.phi[b][0] = -2.1; /* eigenvalue below −1 */
        plan.x.phi[b][1] = plan.x.phi[b][2] = 0.0;
        assert_int_equal(beam_plan_check(&plan), BEAM_ERROR_PLAN);
        build();
        plan.x.phi[b][1] = plan.x.phi[b][2] = 1.0; /* real pair across 1 */
        assert_int_equal(beam_plan_check(&plan), BEAM_ERROR_PLAN);
    }
    build();
    plan.x.link_phi[0][0] = 1e-3;
    assert_int_equal(beam_plan_check(&plan), BEAM_ERROR_PLAN);
    build();
    plan.x.dt_s = 0.0;
    assert_int_equal(beam_plan_check(&plan), BEAM_ERROR_PLAN);
    build();
    plan.use[1].effect = NULL;
    assert_int_equal(beam_plan_check(&plan), BEAM_ERROR_PLAN);
    build();
    plan.use[0].effect = beam_effect_find("tip_mass"); /* a port needs a law */
    assert_int_equal(beam_plan_check(&plan), BEAM_ERROR_PLAN);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_status_has_its_own_text_and_actor),
        cmocka_unit_test(a_good_model_and_plan_pass),
        cmocka_unit_test(models_filled_from_outside_are_checked),
        cmocka_unit_test(every_number_of_a_plan_must_be_finite),
        cmocka_unit_test(no_count_can_lead_outside_the_arrays),
        cmocka_unit_test(blocks_that_grow_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
