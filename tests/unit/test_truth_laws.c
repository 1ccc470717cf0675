/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The truth simulator: balances of forces, complex modulus, convergence of every law. */
#include "truth_rig.h"

/* Slow push of F at the tip: the displacement there when the push is largest. */
static double slow_push(struct truth_spec *spec, double force_N)
{
    char line[200];
    spec->gamma_sNpm2 = 4;
    spec->region[0].cDI_sNm2 = spec->region[1].cDI_sNm2 = 1e-3; /* BDF is not at home on undamped modes */
    spec->sample_rate_Hz = 32;
    spec->oversampling = 16;
    spec->duration_s = 20;
    spec->filter_order = 0;
    spec->modes = 24;
    say(spec, "input push point_force at_m=1");
    say(spec, "output y displacement at_m=1");
    snprintf(line, sizeof line, "signal push raised_cosine start_s=0 width_s=20 level=%.17g", force_N);
    say(spec, line);
    struct truth_record record = run(spec);
    double y = truth_record_channel(&record, "y")[320];
    truth_record_free(&record);
    return y;
}

static void test_statics_of_linear_beam(void **state)
{
    (void)state;
    struct truth_spec spec;
    unit_beam(&spec);
    near(slow_push(&spec, 0.01), 0.01 / 3, 1e-2); /* damping delays a little: 1 % */
}

/* Balance at the tip: 3 EI/ℓ³ y + law(y) = F */
static void tip_balance(const char *effect, double force_N, double law(double y))
{
    struct truth_spec spec;
    unit_beam(&spec);
    say(&spec, effect);
    double y = slow_push(&spec, force_N);
    near(3 * y + law(y), force_N, 1e-2);
    assert_true(fabs(law(y)) > 0.1 * fabs(force_N));
}

static double cubic(double y)
{
    return 2000 * y * y * y;
}

static double quintic(double y)
{
    return 1e6 * y * y * y * y * y;
}

static double stop(double y)
{
    return y > 0.01 ? 50 * (y - 0.01) : 0;
}

static double magnet(double y)
{
    double r = y / 0.05;
    return -0.05 * r / ((1 + r * r) * (1 + r * r));
}

static void test_tip_laws_balance(void **state)
{
    (void)state;
    tip_balance("effect cubic_stiffness coefficient_Npm3=2000", 0.1, cubic);
    tip_balance("effect quintic_spring coefficient_Npm5=1e6", -0.1, quintic);
    tip_balance("effect stop_contact stiffness_Npm=50 gap_m=0.01", 0.1, stop);
    tip_balance("effect tip_magnet strength_N=0.05 reach_m=0.05", 0.1, magnet);
}

static void test_stop_acts_on_one_side_only(void **state)
{
    (void)state;
    struct truth_spec spec;
    unit_beam(&spec);
    say(&spec, "effect stop_contact stiffness_Npm=50 gap_m=0.01");
    near(slow_push(&spec, -0.1), -0.1 / 3, 1e-2);
}

/* A patch from 0.2 to 0.5 of the unit beam; the tip load makes the moment F (1 − x). */
static void with_patch(struct truth_spec *spec)
{
    unit_beam(spec);
    spec->n_regions = 2;
    spec->region[1] = (struct truth_region){0.2, 0.5, 1, 1, 0, 1e-4};
}

static void test_patch_and_crack_laws(void **state)
{
    (void)state;
    struct truth_spec spec;
    double weak = 0.005, F = 0.1, lever = 0.3 * 0.65; /* ∫(1 − x) over the patch: s = (F lever − M 0.3)/EI */
    with_patch(&spec);
    say(&spec, "effect patch_softening coefficient_Nmprad2=-500");
    /* s = F lever + 500 s² 0.3, the smaller root; the tip gains (500 s²) lever */
    double s = (1 - sqrt(1 - 4 * 150 * weak * lever)) / (2 * 150);
    near(slow_push(&spec, weak), weak / 3 + 500 * s * s * lever, 1e-2);

    with_patch(&spec); /* M = k s, stuck */
    say(&spec, "effect microslip stiffness_Nmprad=2 slip_Nm=10");
    s = F * lever / (1 + 2 * 0.3);
    near(slow_push(&spec, F), F / 3 - 2 * s * lever, 1e-2);

    with_patch(&spec); /* M = M0, sliding */
    say(&spec, "effect microslip stiffness_Nmprad=2000 slip_Nm=0.001");
    near(slow_push(&spec, F), F / 3 - 0.001 * lever, 1e-2);

    unit_beam(&spec); /* open crack: r = F ∫(1−x) + Δk r w */
    say(&spec, "effect bilinear_stiffness change_Nmprad=10 at_m=0.35 width_m=0.02");
    double narrow = 0.65 * 0.02, r = F * narrow / (1 - 10 * 0.02);
    const double open = slow_push(&spec, F);
    unit_beam(&spec);
    say(&spec, "effect bilinear_stiffness change_Nmprad=10 at_m=0.35 width_m=0.02");
    const double closed = slow_push(&spec, -F);
    near(closed, -F / 3, 1e-2);
    near(open + closed, 10 * r * narrow, 1e-2); /* what delays both cancels */
}

/* Elastica under a dead tip load, shooting: θ'' = −α cos θ, θ(0) = 0, θ'(1) = 0; tip height ∫ sin θ. */
static double elastica_tip(double alpha)
{
    enum { STEPS = 2000 };
    double low = 0, high = 2 * alpha, y = 0;
    for (int trial = 0; trial < 80; trial++) {
        double theta = 0, turn = (low + high) / 2, h = 1.0 / STEPS;
        y = 0;
        for (int i = 0; i < STEPS; i++) { /* midpoint */
            double half = theta + turn * h / 2, half_turn = turn - alpha * cos(theta) * h / 2;
            y += h * sin(half);
            turn -= h * alpha * cos(half);
            theta += h * half_turn;
        }
        *(turn > 0 ? &high : &low) = (low + high) / 2;
    }
    return y;
}

static void test_large_rotation_against_the_elastica(void **state)
{
    (void)state;
    struct truth_spec spec;
    double alpha = 0.6, exact = elastica_tip(alpha), y[2];
    for (int with = 0; with < 2; with++) {
        unit_beam(&spec);
        if (with)
            say(&spec, "effect large_rotation scale=1");
        y[with] = slow_push(&spec, alpha);
    }
    assert_true(alpha / 3 - exact > 0.005 * exact); /* there is something to get right */
    near(y[0] - y[1], alpha / 3 - exact, 0.15);     /* third order in the slope */
}

static void test_viscoelastic_modulus(void **state)
{
    (void)state;
    /* far below the first frequency the tip follows F/3EI*, EI* = EI + E1 iωτ/(1 + iωτ) */
    for (int patch = 0; patch < 2; patch++) {
        struct truth_spec spec;
        unit_beam(&spec);
        spec.region[0].EI_Nm2 = 1e4;
        spec.sample_rate_Hz = 32;
        spec.duration_s = 8;
        spec.filter_order = 0;
        say(&spec, "input push point_force at_m=1");
        say(&spec, "signal push sine from_Hz=1 level=100 taper_s=1");
        say(&spec, "output y displacement at_m=1");
        say(&spec, patch ? "effect electrical_coupling stiffening_Nm2=5e3 time_constant_s=0.15"
                         : "effect viscoelastic strength_Nm2=5e3 relaxation_s=0.15");
        struct truth_record record = run(&spec);
        const double *y = truth_record_channel(&record, "y");
        double wt = 2 * pi * 0.15, real = 1e4 + 5e3 * wt * wt / (1 + wt * wt), imaginary = 5e3 * wt / (1 + wt * wt);
        double in = 0, out = 0; /* over the last four periods */
        for (size_t i = record.n - 128; i < record.n; i++) {
            double t = (double)i / 32;
            in += y[i] * sin(2 * pi * t) / 64;
            out += y[i] * cos(2 * pi * t) / 64;
        }
        double size = real * real + imaginary * imaginary;
        near(in, 100.0 / 3 * real / size, 3e-3);
        near(out, -100.0 / 3 * imaginary / size, 1e-2);
        truth_record_free(&record);
    }
}

static void test_every_law_converges_and_acts(void **state)
{
    (void)state;
    static const char *const laws[] = {
        "effect quadratic_drag coefficient_Ns2pm3=2",
        "effect cubic_stiffness coefficient_Npm3=1e6",
        "effect patch_softening coefficient_Nmprad2=-40",
        "effect coulomb_friction moment_Nm=0.002 velocity_radps=0.01",
        "effect microslip stiffness_Nmprad=1 slip_Nm=0.002",
        "effect bilinear_stiffness change_Nmprad=10 at_m=0.2 width_m=0.01",
        "effect large_rotation scale=20",
        "effect stop_contact stiffness_Npm=500 gap_m=0.0005",
        "effect thermal_drift rate_ps=0.05",
        "effect quintic_spring coefficient_Npm5=1e11",
        "effect tip_magnet strength_N=0.02 reach_m=0.002",
        "effect delayed_feedback gain_Nspm=0.2 delay_s=0.004",
        "effect stiffness_step relative=-0.1 at_s=0.1",
    };
    struct truth_spec base;
    paper_rig(&base);
    base.duration_s = 0.15;
    base.modes = 12;
    struct truth_record linear = run(&base);
    for (size_t k = 0; k < sizeof laws / sizeof laws[0]; k++) {
        struct truth_spec spec = base;
        say(&spec, laws[k]);
        say(&spec, "tolerance = 1e-7");
        struct truth_record usual = run(&spec);
        say(&spec, "tolerance = 1e-9");
        struct truth_record tight = run(&spec);
        if (!(relative_rms(&tight, &usual, "tip_m") < 1e-4 && relative_rms(&tight, &usual, "accel_mps2") < 1e-3))
            fail_msg("%s: not converged, %g %g", laws[k], relative_rms(&tight, &usual, "tip_m"),
                     relative_rms(&tight, &usual, "accel_mps2"));
        if (!(relative_rms(&tight, &linear, "tip_m") > 2e-3))
            fail_msg("%s: changes nothing", laws[k]);
        truth_record_free(&usual);
        truth_record_free(&tight);
    }
    truth_record_free(&linear);
}

/* Another form of a law: near the catalogue's, not equal to it, and right where it is known in closed form. */
static void test_bent_laws(void **state)
{
    (void)state;
    static const char *const laws[][2] = {
        {"effect quadratic_drag coefficient_Ns2pm3=2", " power=1.9"},
        {"effect cubic_stiffness coefficient_Npm3=1e6", " power=2.9"},
        {"effect patch_softening coefficient_Nmprad2=-40", " power=1.9"},
        {"effect coulomb_friction moment_Nm=0.002 velocity_radps=0.01", " curve=1"},
        {"effect bilinear_stiffness change_Nmprad=10 at_m=0.2 width_m=0.01", " rounding_rad=1e-4"},
        {"effect stop_contact stiffness_Npm=500 gap_m=0.0005", " power=1.1"},
        {"effect thermal_drift rate_ps=0.05", " settling_s=0.2"},
    };
    for (size_t k = 0; k < sizeof laws / sizeof laws[0]; k++) {
        struct truth_record record[2];
        for (int bent = 0; bent < 2; bent++) {
            struct truth_spec spec;
            char line[128];
            paper_rig(&spec);
            spec.duration_s = 0.15;
            spec.modes = 12;
            snprintf(line, sizeof line, "%s%s", laws[k][0], bent ? laws[k][1] : "");
            say(&spec, line);
            record[bent] = run(&spec);
        }
        double change = relative_rms(&record[1], &record[0], "tip_m");
        if (!(change > 1e-5 && change < 0.5))
            fail_msg("%s%s: changes the tip by %g", laws[k][0], laws[k][1], change);
        truth_record_free(&record[0]);
        truth_record_free(&record[1]);
    }
    /* F = EI 3 y/l³ + k y^n under a slow push, F found from the y that comes out */
    struct truth_spec spec;
    unit_beam(&spec);
    say(&spec, "effect cubic_stiffness coefficient_Npm3=20 power=2.5");
    double y = slow_push(&spec, 0.6);
    near(3 * y + 20 * pow(y, 2.5), 0.6, 0.01);
}

/* Equal to the linear beam when every law is at its neutral value. */
static void test_neutral_laws_leave_the_beam_alone(void **state)
{
    (void)state;
    struct truth_spec spec;
    bool known;
    const char *id;
    paper_rig(&spec);
    spec.duration_s = 0.2;
    spec.modes = 12;
    struct truth_record linear = run(&spec);
    for (size_t k = 0; (id = truth_effect_name(k, &known)); k++) {
        struct truth_spec with = spec;
        if (strcmp(id, "sensor_highpass") == 0) /* neutral at infinite time constant */
            continue;
        assert_non_null(truth_effect_add(&with, id));
        struct truth_record same = run(&with);
        if (!(relative_rms(&linear, &same, "tip_m") < 1e-6))
            fail_msg("%s changes the beam at its neutral value by %g", id, relative_rms(&linear, &same, "tip_m"));
        truth_record_free(&same);
    }
    truth_record_free(&linear);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_statics_of_linear_beam),
        cmocka_unit_test(test_tip_laws_balance),
        cmocka_unit_test(test_stop_acts_on_one_side_only),
        cmocka_unit_test(test_patch_and_crack_laws),
        cmocka_unit_test(test_large_rotation_against_the_elastica),
        cmocka_unit_test(test_viscoelastic_modulus),
        cmocka_unit_test(test_every_law_converges_and_acts),
        cmocka_unit_test(test_bent_laws),
        cmocka_unit_test(test_neutral_laws_leave_the_beam_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
