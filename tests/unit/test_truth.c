/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The truth simulator against closed forms: frequencies, structure, damping; and against itself, refined. */
#include "truth_rig.h"

static double beta(const struct truth_spec *spec, size_t mode)
{
    double f[8], zeta[8];
    char message[TRUTH_MESSAGE] = "";
    if (truth_modes(spec, 8, f, zeta, message) != 0)
        fail_msg("%s", message);
    return sqrt(2 * pi * f[mode]);
}

static void test_frequencies_of_the_paper(void **state)
{
    (void)state;
    static const double exact_Hz[5] = {6.64605, 38.36154, 95.51843, 178.74231, 305.19956};
    struct truth_spec spec;
    double f[5], zeta[5];
    char message[TRUTH_MESSAGE];
    truth_spec_default(&spec);
    spec.elements = 160;
    assert_int_equal(truth_modes(&spec, 5, f, zeta, message), 0);
    for (int j = 0; j < 5; j++)
        near(f[j], exact_Hz[j], 1.2e-6); /* the reference is printed to 1e-5 Hz */
    spec.elements = 80;
    assert_int_equal(truth_modes(&spec, 5, f, zeta, message), 0);
    for (int j = 0; j < 5; j++)
        near(f[j], exact_Hz[j], 2e-6);
}

static void test_frequencies_of_uniform_beams(void **state)
{
    (void)state;
    struct truth_spec spec;
    unit_beam(&spec);
    near(beta(&spec, 0), 1.8751040687, 1e-7);
    near(beta(&spec, 3), 10.995540735, 1e-6);
    say(&spec, "support clamped-clamped");
    near(beta(&spec, 0), 4.7300407449, 1e-7);
    say(&spec, "support pinned-pinned");
    near(beta(&spec, 1), 2 * pi, 1e-7);
    say(&spec, "support free-free");
    assert_true(beta(&spec, 1) < 1e-2);
    near(beta(&spec, 2), 4.7300407449, 1e-7);
}

static void test_structural_effects_move_frequencies(void **state)
{
    (void)state;
    struct truth_spec spec;
    unit_beam(&spec); /* 1 + cos cosh + μ b (cos sinh − sin cosh) = 0 */
    say(&spec, "effect tip_mass mass_kg=0.5");
    double b = beta(&spec, 0);
    assert_true(fabs(1 + cos(b) * cosh(b) + 0.5 * b * (cos(b) * sinh(b) - sin(b) * cosh(b))) < 1e-5);
    unit_beam(&spec); /* a very stiff spring at the tip is a support, a very soft root is a hinge */
    say(&spec, "effect point_spring stiffness_Npm=1e8");
    near(beta(&spec, 0), 3.9266023, 1e-4);
    unit_beam(&spec);
    say(&spec, "effect root_compliance compliance_radpNm=1e8");
    assert_true(beta(&spec, 0) < 0.02);
    near(beta(&spec, 1), 3.9266023, 1e-6);
    unit_beam(&spec); /* a support that rocks: 1 + cos cosh = c/(1 − ω²/Ω²) b (sin cosh − cos sinh), ω = b² */
    say(&spec, "effect root_compliance compliance_radpNm=0.3 frequency_Hz=1");
    for (size_t k = 0; k < 3; k++) {
        const double q = beta(&spec, k), c = 0.3 / (1 - pow(q, 4) / (4 * pi * pi));
        const double left = 1 + cos(q) * cosh(q), right = c * q * (sin(q) * cosh(q) - cos(q) * sinh(q));
        assert_true(fabs(left - right) < 1e-4 * (1 + fabs(left)));
    }
    unit_beam(&spec); /* tension on a hinged beam: ω² = b⁴ + P b² */
    say(&spec, "support pinned-pinned");
    say(&spec, "effect axial_load force_N=-3");
    near(pow(beta(&spec, 0), 4), pow(pi, 4) - 3 * pi * pi, 1e-6);
    unit_beam(&spec); /* rotary inertia with shear correction: ω² = b⁴ / (1 + 4.192 r² b²) */
    say(&spec, "support pinned-pinned");
    say(&spec, "effect rotary_inertia scale=1");
    near(pow(beta(&spec, 1), 4), pow(2 * pi, 4) / (1 + (1 + 2 * 1.33 * 1.2) * 1e-4 * 4 * pi * pi), 1e-6);
}

static void test_buckled_beam_is_refused(void **state)
{
    (void)state;
    struct truth_spec spec;
    char message[TRUTH_MESSAGE] = "";
    double f[1], zeta[1];
    unit_beam(&spec); /* Euler: π²EI/4ℓ² = 2.467 */
    say(&spec, "effect axial_load force_N=-2.4");
    assert_int_equal(truth_modes(&spec, 1, f, zeta, message), 0);
    spec.effect[0].parameter[0] = -2.6;
    assert_int_equal(truth_modes(&spec, 1, f, zeta, message), -1);
    assert_non_null(strstr(message, "stiffness"));
}

static void test_damping_ratios(void **state)
{
    (void)state;
    struct truth_spec spec;
    double f[4], zeta[4];
    char message[TRUTH_MESSAGE];
    unit_beam(&spec); /* 2ζω = γ/ρ + cDI b⁴/ρ + η ω */
    say(&spec, "gamma_sNpm2 = 0.02");
    spec.region[0].cDI_sNm2 = 1e-4;
    say(&spec, "effect hysteretic_damping loss_factor=0.01");
    assert_int_equal(truth_modes(&spec, 4, f, zeta, message), 0);
    for (int j = 0; j < 4; j++) {
        double w = 2 * pi * f[j];
        near(zeta[j], (0.02 + 1e-4 * w * w + 0.01 * w) / (2 * w), 1e-9);
    }
    unit_beam(&spec); /* square root: ⟨c φ', φ'⟩ = c b² on a hinged beam */
    say(&spec, "support pinned-pinned");
    say(&spec, "effect square_root_damping coefficient_Ns=0.03");
    assert_int_equal(truth_modes(&spec, 4, f, zeta, message), 0);
    for (int j = 0; j < 4; j++)
        near(zeta[j], 0.03 / 2, 1e-6);
}

static void test_both_integrators_agree(void **state)
{
    (void)state;
    static const char *const channels[] = {"piezo_V", "accel_mps2", "tip_mps", "tip_m"};
    struct truth_spec spec;
    paper_rig(&spec);
    say(&spec, "effect viscoelastic strength_Nm2=0.03 relaxation_s=0.006");
    say(&spec, "effect attached_resonator mass_kg=0.002 frequency_Hz=40 damping_ratio=0.05 at_m=0.3");
    say(&spec, "effect root_compliance compliance_radpNm=0.008 loss_s=2e-5");
    say(&spec, "effect base_motion amplitude_mps2=2 frequency_Hz=30 phase_rad=0.3");
    struct truth_record exact = run(&spec);
    say(&spec, "force_ode = 1");
    struct truth_record ode = run(&spec);
    for (int k = 0; k < 4; k++) /* the accelerometer sees the ends of the hammer pulse, where inputs are interpolated */
        if (!(relative_rms(&exact, &ode, channels[k]) < (k == 1 ? 1e-3 : 2e-5)))
            fail_msg("%s differs by %g", channels[k], relative_rms(&exact, &ode, channels[k]));
    truth_record_free(&exact);
    truth_record_free(&ode);
}

/* Static vectors make 24 modes as good as 60; without them 60 are still wrong by a per cent. */
static void test_modes_and_grid_converge(void **state)
{
    (void)state;
    static const char *const channels[] = {"piezo_V", "accel_mps2", "tip_mps", "tip_m"};
    struct truth_spec spec;
    paper_rig(&spec);
    say(&spec, "modes = 60");
    say(&spec, "elements = 120");
    struct truth_record fine = run(&spec);
    say(&spec, "static_vectors = 0");
    struct truth_record truncated = run(&spec);
    say(&spec, "static_vectors = 1");
    say(&spec, "modes = 24");
    say(&spec, "elements = 80");
    struct truth_record few = run(&spec);
    spec.oversampling = 64;
    struct truth_record dense = run(&spec);
    for (int k = 0; k < 4; k++) {
        assert_true(relative_rms(&fine, &few, channels[k]) < 5e-5);
        assert_true(relative_rms(&dense, &few, channels[k]) < 5e-4);
    }
    assert_true(relative_rms(&fine, &truncated, "piezo_V") > 5e-3);
    truth_record_free(&fine);
    truth_record_free(&truncated);
    truth_record_free(&few);
    truth_record_free(&dense);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_frequencies_of_the_paper),
        cmocka_unit_test(test_frequencies_of_uniform_beams),
        cmocka_unit_test(test_structural_effects_move_frequencies),
        cmocka_unit_test(test_buckled_beam_is_refused),
        cmocka_unit_test(test_damping_ratios),
        cmocka_unit_test(test_both_integrators_agree),
        cmocka_unit_test(test_modes_and_grid_converge),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
