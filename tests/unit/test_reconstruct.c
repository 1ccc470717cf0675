/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Reconstructed forces of the truth simulator: where they act and what they look like. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "motion_rig.h"
#include "estimate/estimate.h"

static void reconstruct(const char *effect, double wrong, struct reconstruction *out)
{
    struct motion_rig rig;
    struct bf_error err;
    rig_open(&rig, effect, wrong, MOTION_FLOOR);
    if (reconstruct_run(&rig.motion, out, &err) != BF_OK)
        fail_msg("%s", err.text);
    rig_close(&rig);
}

static void says(const struct reconstruction *out, const char *words)
{
    if (strstr(out->text, words) == NULL)
        fail_msg("'%s' is not in: %s", words, out->text);
}

/* Outside the catalogue's list: a spring of the fifth power in the middle of the span. */
static void a_hardening_spring_is_described_and_located(void **state)
{
    (void)state;
    struct reconstruction out;
    reconstruct("effect quintic_spring coefficient_Npm5=2e9 at_m=0.28", 0.0, &out);
    assert_true(out.is_law);
    assert_int_equal(out.best.place, RECONSTRUCT_POINT);
    rig_near(out.best.at_m, 0.28, 0.2);
    assert_true(out.elastic_odd > 0.4);
    assert_true(out.dissipative < 0.1);
    assert_true(out.hardening);
    says(&out, "hardening spring");
    assert_true(fabs(out.dissipated) < 0.2);
    reconstruct_free(&out);
}

static void a_softening_patch_is_found_at_the_patch(void **state)
{
    (void)state;
    struct reconstruction out;
    reconstruct("effect patch_softening coefficient_Nmprad2=-60", 0.0, &out);
    assert_int_equal(out.best.place, RECONSTRUCT_PATCH);
    assert_true(out.elastic_odd > 0.5);
    assert_false(out.hardening);
    says(&out, "at the patch");
    says(&out, "softening spring");
    reconstruct_free(&out);
}

static void friction_is_dissipative(void **state)
{
    (void)state;
    struct reconstruction out;
    reconstruct("effect coulomb_friction moment_Nm=0.001 velocity_radps=0.005", 0.0, &out);
    assert_true(out.dissipative > out.elastic_odd + out.elastic_even);
    assert_false(out.drag);
    reconstruct_free(&out);
}

static void a_curve_in_one_sensor_is_no_force(void **state)
{
    (void)state;
    struct reconstruction out;
    reconstruct("effect sensor_quadratic channel=tip_mps coefficient=0.1", 0.0, &out);
    assert_true(out.sensor_like);
    assert_string_equal(out.channel, "tip_mps");
    says(&out, "Only tip_mps");
    reconstruct_free(&out);
}

/* Curves and spectrum are there to be drawn. */
/* A clamp that shakes between two modes: the frequency is told, and that the model may have a mode elsewhere. */
static void a_line_where_no_mode_is_is_told_with_its_frequency(void **state)
{
    (void)state;
    struct reconstruction out;
    reconstruct("effect base_motion amplitude_mps2=20 frequency_Hz=61.5 phase_rad=0.7", 0.0, &out);
    assert_true(out.resonant);
    rig_near(out.frequency_Hz, 61.5, 0.02);
    says(&out, "a force at one frequency, 61.");
    says(&out, "or a mode of the beam that the model has elsewhere");
    reconstruct_free(&out);
    /* what creeps through the record of 1.5 s is larger, and no line */
    reconstruct("effect base_motion amplitude_mps2=20 frequency_Hz=23.7 phase_rad=0.7", 0.0, &out);
    assert_true(out.frequency_Hz > 4.0 / 1.5);
    reconstruct_free(&out);
}

static void curves_are_filled(void **state)
{
    (void)state;
    struct reconstruction out;
    reconstruct("effect cubic_stiffness coefficient_Npm3=20000", 0.0, &out);
    assert_int_equal(out.n_records, RIG_RECORDS);
    assert_non_null(out.spectrum);
    assert_true(out.frequency_Hz > 0.0 && out.frequency_Hz < 512.0);
    size_t filled = 0;
    for (size_t i = 0; i < RECONSTRUCT_BINS; i++) {
        filled += isfinite(out.f_of_w[i]);
        assert_true(i == 0 || out.w_bin[i] > out.w_bin[i - 1]);
    }
    assert_true(filled > RECONSTRUCT_BINS / 2);
    /* a hardening spring pushes back at both ends */
    assert_true(!(out.f_of_w[RECONSTRUCT_BINS - 1] < 0.0));
    assert_true(!(out.f_of_w[0] > 0.0));
    reconstruct_free(&out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hardening_spring_is_described_and_located),
        cmocka_unit_test(a_softening_patch_is_found_at_the_patch),
        cmocka_unit_test(friction_is_dissipative),
        cmocka_unit_test(a_curve_in_one_sensor_is_no_force),
        cmocka_unit_test(a_line_where_no_mode_is_is_told_with_its_frequency),
        cmocka_unit_test(curves_are_filled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
