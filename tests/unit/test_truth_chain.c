/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The truth simulator: sensors, filter, noise, ADC, drive, spec files. */
#include "truth_rig.h"

static void say_number(struct truth_spec *spec, const char *format, double value)
{
    char line[200];
    snprintf(line, sizeof line, format, value);
    say(spec, line);
}

/* One sine through the measurement chain: in and quadrature parts of piezo_V over whole periods. */
static void through_chain(const char *effect, double f_Hz, double part[2])
{
    struct truth_spec spec;
    truth_spec_default(&spec);
    say(&spec, "input drive_V patch_moment");
    say(&spec, "output piezo_V patch_strain");
    say(&spec, "gamma_sNpm2 = 5");
    say(&spec, "duration_s = 3");
    say_number(&spec, "signal drive_V sine level=10 from_Hz=%g", f_Hz);
    if (effect)
        say(&spec, effect);
    struct truth_record record = run(&spec);
    const double *y = truth_record_channel(&record, "piezo_V");
    part[0] = part[1] = 0;
    for (size_t i = 2048; i < 3072; i++) { /* the third second */
        double a = 2 * pi * f_Hz * (double)i / 1024;
        part[0] += y[i] * sin(a) / 512;
        part[1] += y[i] * cos(a) / 512;
    }
    truth_record_free(&record);
}

static void expect_factor(const char *effect, double f_Hz, double real, double imaginary)
{
    double w[2], v[2];
    through_chain(NULL, f_Hz, w);
    through_chain(effect, f_Hz, v);
    double size = hypot(w[0], w[1]);
    assert_true(fabs(v[0] - (real * w[0] - imaginary * w[1])) < 1e-4 * size);
    assert_true(fabs(v[1] - (real * w[1] + imaginary * w[0])) < 1e-4 * size);
}

static void test_sensor_filters(void **state)
{
    (void)state;
    double x = 2 * pi * 20 * 0.004; /* ωτ */
    expect_factor("effect sensor_lag tau_s=0.004", 20, 1 / (1 + x * x), -x / (1 + x * x));
    expect_factor("effect sensor_highpass tau_s=0.004", 20, x * x / (1 + x * x), x / (1 + x * x));
    expect_factor("effect sensor_delay delay_s=0.00077", 100, cos(2 * pi * 0.077), -sin(2 * pi * 0.077));
}

static void test_additive_sensor_effects(void **state)
{
    (void)state;
    struct truth_spec spec;
    truth_spec_default(&spec);
    say(&spec, "input drive_V patch_moment");
    say(&spec, "output piezo_V patch_strain");
    say(&spec, "output tip_mps velocity at_m=0.44");
    say(&spec, "signal drive_V raised_cosine start_s=0.5 width_s=0.5 level=10");
    say(&spec, "effect sensor_offset offset=0.3 drift_per_s=0.1 channel=piezo_V");
    say(&spec, "effect mains_hum amplitude=0.02 phase_rad=0.5 frequency_Hz=50 channel=piezo_V");
    say(&spec, "effect feedthrough gain=0.01 channel=tip_mps");
    struct truth_record with = run(&spec);
    spec.n_effects = 0;
    struct truth_record without = run(&spec);
    for (size_t i = 200; i < with.n; i += 97) {
        double t = (double)i / 1024, drive = truth_record_channel(&with, "drive_V")[i];
        double piezo = truth_record_channel(&with, "piezo_V")[i] - truth_record_channel(&without, "piezo_V")[i];
        double tip = truth_record_channel(&with, "tip_mps")[i] - truth_record_channel(&without, "tip_mps")[i];
        assert_true(fabs(piezo - 0.3 - 0.1 * t - 0.02 * sin(2 * pi * 50 * t + 0.5)) < 1e-6);
        assert_true(fabs(tip - 0.01 * drive) < 1e-9);
    }
    truth_record_free(&with);
    truth_record_free(&without);
}

static void test_antialias_filter(void **state)
{
    (void)state;
    static const double f_Hz[3] = {100, 409.6, 500}; /* |H|² of order 8: 1/(1 + (f/fc)¹⁶) */
    for (int k = 0; k < 3; k++) {
        struct truth_spec spec;
        truth_spec_default(&spec);
        spec.filter_ratio = 0.4;
        say(&spec, "duration_s = 1");
        say(&spec, "input drive_V patch_moment");
        say_number(&spec, "signal drive_V sine level=1 from_Hz=%g", f_Hz[k]);
        struct truth_record record = run(&spec);
        const double *u = truth_record_channel(&record, "drive_V");
        double in = 0, out = 0;
        for (size_t i = 256; i < 768; i++) {
            double a = 2 * pi * f_Hz[k] * (double)i / 1024;
            in += u[i] * sin(a) / 256;
            out += u[i] * cos(a) / 256;
        }
        near(hypot(in, out), 1 / (1 + pow(f_Hz[k] / 409.6, 16)), 2e-2);
        assert_true(fabs(out) < 1e-2); /* zero phase */
        truth_record_free(&record);
    }
}

static void test_noise_and_adc(void **state)
{
    (void)state;
    struct truth_spec spec;
    paper_rig(&spec);
    say(&spec, "noise = 0.05");
    say(&spec, "noise_ar = 0.8 -0.1");
    say(&spec, "adc_bits = 12");
    struct truth_record clean = run(&spec), a, b, c;
    truth_measure(&spec, &clean, 7, &a);
    truth_measure(&spec, &clean, 7, &b);
    truth_measure(&spec, &clean, 8, &c);
    assert_true(relative_rms(&a, &b, "piezo_V") <= 0);
    assert_true(relative_rms(&a, &c, "piezo_V") > 0.02);
    assert_true(relative_rms(&clean, &a, "hammer_N") <= 0);
    double lag = 0, power = 0, level = 0, largest = 0;
    const char *const names[] = {"piezo_V", "accel_mps2", "tip_mps", "tip_m"};
    for (int k = 0; k < 4; k++) {
        const double *x = truth_record_channel(&clean, names[k]), *y = truth_record_channel(&a, names[k]);
        level += relative_rms(&clean, &a, names[k]) / 4;
        double size = 0;
        for (size_t i = 0; i < clean.n; i++)
            size += x[i] * x[i];
        for (size_t i = 1; i < clean.n; i++) {
            lag += (y[i] - x[i]) * (y[i - 1] - x[i - 1]) / size;
            power += (y[i] - x[i]) * (y[i] - x[i]) / size;
        }
    }
    near(level, 0.05, 0.15);
    near(lag / power, 0.8 / 1.1, 0.12); /* ρ₁ = a1/(1 − a2) */
    const double *y = truth_record_channel(&a, "piezo_V");
    for (size_t i = 0; i < a.n; i++)
        largest = fmax(largest, fabs(y[i]));
    double whole = largest / round(2048 / 1.1), worst = 0; /* the largest value is that many steps */
    for (size_t i = 0; i < a.n; i++)
        worst = fmax(worst, fabs(y[i] / whole - round(y[i] / whole)));
    assert_true(worst < 1e-6);
    truth_record_free(&clean);
    truth_record_free(&a);
    truth_record_free(&b);
    truth_record_free(&c);
}

static void test_drive_effects(void **state)
{
    (void)state;
    /* quasi-static triangle through the hysteresis: z saturates at 1/(β + ζ), and the drive lags behind by it */
    struct truth_spec spec;
    truth_spec_default(&spec);
    say(&spec, "input drive_V patch_moment");
    say(&spec, "output piezo_V patch_strain");
    say(&spec, "gamma_sNpm2 = 1");
    say(&spec, "duration_s = 4");
    say(&spec, "signal drive_V raised_cosine start_s=0 width_s=4 level=100");
    struct truth_record plain = run(&spec);
    say(&spec, "effect drive_hysteresis share=0.5 slip_pV=0.2 shape_pV=0.05");
    struct truth_record loop = run(&spec);
    spec.n_effects = 0;
    say(&spec, "effect drive_saturation level_V=60");
    struct truth_record saturated = run(&spec);
    spec.n_effects = 0;
    say(&spec, "effect drive_dead_zone half_width_V=10");
    struct truth_record dead = run(&spec);
    double gain = truth_record_channel(&plain, "piezo_V")[2048] / 100;
    near(truth_record_channel(&loop, "piezo_V")[2048] / gain, 100 - 0.5 / 0.25, 1e-3);
    double up = truth_record_channel(&loop, "piezo_V")[1024], down = truth_record_channel(&loop, "piezo_V")[3072];
    double unloop = truth_record_channel(&plain, "piezo_V")[1024] - truth_record_channel(&plain, "piezo_V")[3072];
    near((down - up + unloop) / gain, 2 * 0.5 / 0.25, 5e-2);
    near(truth_record_channel(&saturated, "piezo_V")[2048] / gain, 60 * tanh(100.0 / 60), 2e-3);
    near(truth_record_channel(&dead, "piezo_V")[2048] / gain, 90, 2e-3);
    truth_record_free(&plain);
    truth_record_free(&loop);
    truth_record_free(&saturated);
    truth_record_free(&dead);
}

static void test_bad_specs_are_refused(void **state)
{
    (void)state;
    static const char *const bad[] = {"nonsense 1",
                                      "length_m",
                                      "length_m one",
                                      "modes = 0",
                                      "input x",
                                      "input x velocity at_m=0.1",
                                      "output y velocity",
                                      "output y velocity at=0.1",
                                      "signal nobody sine level=1",
                                      "effect unknown_effect",
                                      "effect tip_mass weight=1",
                                      "effect sensor_lag tau_s=0.1 channel=nobody",
                                      "support glued",
                                      "region 0 1 2",
                                      "adc_bits = 99"};
    struct truth_spec spec;
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        char message[TRUTH_MESSAGE] = "";
        truth_spec_default(&spec);
        if (truth_spec_line(&spec, bad[k], message) == 0 || message[0] == '\0')
            fail_msg("accepted: %s", bad[k]);
    }
    char message[TRUTH_MESSAGE] = "";
    assert_int_equal(truth_spec_read(&spec, "/nonexistent/spec.txt", message), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sensor_filters),   cmocka_unit_test(test_additive_sensor_effects),
        cmocka_unit_test(test_antialias_filter), cmocka_unit_test(test_noise_and_adc),
        cmocka_unit_test(test_drive_effects),    cmocka_unit_test(test_bad_specs_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
