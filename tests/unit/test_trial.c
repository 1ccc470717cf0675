/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Trials of nonlinear effects on recordings of the truth simulator, from a baseline that is wrong. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "motion_rig.h"
#include "estimate/estimate.h"
#include "estimate/trial_roles.h"

static void try_all(struct motion_rig *rig, const char *effect, double wrong, struct trial **list, size_t *n)
{
    static const struct trial_options options = {.rounds = 3};
    struct bf_error err;
    rig_open(rig, effect, wrong, MOTION_FLOOR);
    if (trial_all(&rig->motion, &options, list, n, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static void end_all(struct motion_rig *rig, struct trial *list, size_t n)
{
    for (size_t i = 0; i < n; i++)
        trial_free(&list[i]);
    free(list);
    rig_close(rig);
}

/* The true effect is first, its strength right within `relative`, and the baseline comes back beside it. */
static void finds(const char *effect, const char *id, double strength, double relative)
{
    struct motion_rig rig;
    struct trial *list;
    size_t n;
    try_all(&rig, effect, 0.05, &list, &n);
    if (strcmp(list[0].effect->id, id) != 0)
        fail_msg("%s comes first for %s", list[0].effect->id, effect);
    rig_near(list[0].strength, strength, relative);
    assert_true(list[0].p_value < 1e-6);
    assert_true(list[1].chi_square > 1.1 * list[0].chi_square);
    rig_near(rig_value(&rig, list[0].theta, "EI_patch_Nm2") / rig_value(&rig, list[0].theta, "EI_beam_Nm2"),
             rig_EI_patch / rig_EI_beam, 0.02);
    end_all(&rig, list, n);
}

static void a_hardening_spring(void **state)
{
    (void)state;
    finds("effect cubic_stiffness coefficient_Npm3=20000", "cubic_stiffness", 20000.0, 0.2);
}

static void drag_over_the_span(void **state)
{
    (void)state;
    finds("effect quadratic_drag coefficient_Ns2pm3=0.15", "quadratic_drag", 0.15, 0.2);
}

static void an_element_with_internal_state(void **state)
{
    (void)state;
    finds("effect microslip stiffness_Nmprad=2 slip_Nm=0.001", "microslip", 2.0, 0.3);
}

static void friction_with_a_threshold_far_below_the_motion(void **state)
{
    (void)state;
    finds("effect coulomb_friction moment_Nm=0.001 velocity_radps=0.005", "coulomb_friction", 0.001, 0.3);
}

/* The place is found too when it is not where the catalogue puts it. */
static void a_spring_in_the_middle_of_the_span(void **state)
{
    (void)state;
    struct motion_rig rig;
    struct trial *list;
    size_t n;
    try_all(&rig, "effect cubic_stiffness coefficient_Npm3=200000 at_m=0.25", 0.0, &list, &n);
    assert_string_equal(list[0].effect->id, "cubic_stiffness");
    rig_near(list[0].p[1], 0.25, 0.15);
    end_all(&rig, list, n);
}

/* The catalogue puts the stop at the far end, which is a support here and does not move. */
static void a_stop_in_the_middle_of_a_beam_on_two_pins(void **state)
{
    (void)state;
    struct motion_rig rig;
    struct trial *list;
    size_t n;
    rig_support = "pinned-pinned";
    try_all(&rig, "effect stop_contact stiffness_Npm=500 gap_m=3e-4 at_m=0.25", 0.0, &list, &n);
    rig_support = "clamped-free";
    assert_string_equal(list[0].effect->id, "stop_contact");
    assert_true(list[0].share > 0.5);
    end_all(&rig, list, n);
}

/* Nothing to find: no effect explains more than a hair of what is left. */
static void a_linear_beam_leaves_nothing_to_explain(void **state)
{
    (void)state;
    struct motion_rig rig;
    struct trial *list;
    size_t n;
    try_all(&rig, "", 0.0, &list, &n);
    for (size_t i = 0; i < n; i++)
        assert_true(list[i].share < 0.02);
    end_all(&rig, list, n);
}

static void an_effect_without_a_law_is_refused(void **state)
{
    (void)state;
    struct motion_rig rig;
    struct trial trial;
    struct bf_error err;
    const struct trial_options options = {.rounds = 0};
    rig_open(&rig, "", 0.0, 0.0);
    assert_false(trial_possible(effect_by_id("tip_mass")));
    assert_int_equal(trial_run(&rig.motion, effect_by_id("tip_mass"), &options, &trial, &err), BF_USAGE);
    rig_close(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hardening_spring),
        cmocka_unit_test(drag_over_the_span),
        cmocka_unit_test(an_element_with_internal_state),
        cmocka_unit_test(friction_with_a_threshold_far_below_the_motion),
        cmocka_unit_test(a_spring_in_the_middle_of_the_span),
        cmocka_unit_test(a_stop_in_the_middle_of_a_beam_on_two_pins),
        cmocka_unit_test(a_linear_beam_leaves_nothing_to_explain),
        cmocka_unit_test(an_effect_without_a_law_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
