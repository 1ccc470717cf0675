/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The image of a model: the same prediction as the host's, and what is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "response/response.h"
#include "target_image_rig.h"

enum { SAMPLES = 4096 };
/* A held drive: a chirp from 3 Hz in whole codes. */
static void make_drive(double top_Hz, double u[SAMPLES])
{
    double phase = 0.0;
    for (int k = 0; k < SAMPLES; k++) {
        phase += 2.0 * acos(-1.0) * (3.0 + (top_Hz - 3.0) * k / SAMPLES) / rate_Hz;
        u[k] = 0.02 * round(266.0 * sin(phase));
    }
    u[0] = 0.0;
}

static void predict(const struct model *model, const double u[SAMPLES], double y[SAMPLES])
{
    struct record record = {.n = SAMPLES, .dt_s = 1.0 / rate_Hz, .path = bf_strdup("live.csv")};
    struct predictor *predictor;
    struct prediction prediction;
    struct parameter_ref *refs;
    struct bf_error err;
    double *zeros = bf_alloc(SAMPLES, sizeof *zeros);
    record_add_column(&record, "drive_V", u);
    record_add_column(&record, "piezo_V", zeros);
    free(zeros);
    const struct predict_options options = {.intersample = INTERSAMPLE_ZERO_ORDER_HOLD, .quiet = true};
    const char *name = "live.csv";
    const size_t n = model_parameters(model, &name, 1, &refs);
    double *theta = bf_alloc(n, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    enum bf_status status = predictor_new(model, &record, 1, &options, &predictor, &err);
    if (status == BF_OK)
        status = predictor_run(predictor, theta, NULL, &prediction, &err);
    if (status != BF_OK)
        fail_msg("%s", err.text);
    memcpy(y, prediction.y, SAMPLES * sizeof *y);
    predictor_free(predictor);
    free(theta);
    free(refs);
    record_free(&record);
}

static double rms(const double x[SAMPLES])
{
    double square = 0.0;
    for (int k = 0; k < SAMPLES; k++)
        square += x[k] * x[k];
    return sqrt(square / SAMPLES);
}

/* rms of the controller's steps less the host's prediction, over the prediction's rms. */
static double distance(const char *effects, bool plain, double top_Hz)
{
    static double u[SAMPLES], y[SAMPLES];
    static struct target_image image;
    struct model model;
    fixture_model(&model, effects);
    make_drive(top_Hz, u);
    predict(&model, u, y);
    const double size = rms(y);
    make_as(effects, plain, &image);
    struct beam_image_run *run = bf_alloc(1, beam_image_run_bytes());
    beam_image_run_load(run, &image.file);
    assert_int_equal(beam_image_run_check(run, NULL, (float)(1.0 / rate_Hz)), BEAM_IMAGE_FINE);
    beam_image_run_rest(run);
    for (int k = 0; k < SAMPLES; k++) {
        float value;
        assert_int_equal(beam_image_run_step(run, (float)u[k], &value), BEAM_OK);
        y[k] -= (double)value;
    }
    assert_true(image.float_error < 1e-5);
    free(run);
    target_image_free(&image);
    model_free(&model);
    return rms(y) / size;
}

/*
 * Ten dimensions and one step a sample beside the host's many and its eight steps a sample. The linear beam: 2e-4.
 * Filters and laws: straight lines between samples, (π f/f_s)²/3 of what they change, 6e-3 at 45 Hz; friction's corners.
 */
static void the_controller_predicts_what_the_host_predicts(void **state)
{
    static const struct {
        const char *effects;
        double most;
    } cases[] = {
        {"", 5e-4},
        {"  - {kind: tip_mass, mass_kg: 0.001}\n", 2e-3},
        {"  - {kind: point_mass, mass_kg: 0.001, at_m: 0.2}\n", 2e-3},
        {"  - {kind: root_compliance, compliance_radpNm: 0.01}\n", 2e-3},
        {"  - {kind: axial_load, force_N: 1}\n", 1e-3},
        {"  - {kind: rotary_inertia}\n", 1e-3},
        {"  - {kind: hysteretic_damping, loss_factor: 0.01}\n", 1e-3},
        {"  - {kind: square_root_damping}\n", 1e-3},
        {"  - {kind: point_damper, damping_Nspm: 0.01}\n", 2e-3},
        {"  - {kind: point_spring, stiffness_Npm: 10}\n", 2e-3},
        {"  - {kind: viscoelastic, strength_Nm2: 0.02}\n", 1e-3},
        {"  - {kind: electrical_coupling}\n", 1e-3},
        {"  - {kind: patch_position, shift_m: 0.003}\n", 2e-3},
        {"  - {kind: clock_error, relative: 0.001}\n", 1e-3},
        {"  - {kind: sensor_highpass, tau_s: 0.05}\n", 2e-3},
        {"  - {kind: sensor_lag, tau_s: 0.0005}\n", 4e-3},
        {"  - {kind: sensor_delay, delay_s: 0.0015}\n", 6e-3},
        {"  - {kind: sensor_saturation, level: 0.5}\n", 1e-3},
        {"  - {kind: sensor_offset, offset: 0.01, drift_per_s: 0}\n", 1e-3},
        {"  - {kind: feedthrough, gain: 0.001}\n", 1e-3},
        {"  - {kind: drive_saturation, level_V: 5}\n", 1e-3},
        {"  - {kind: drive_hysteresis}\n", 1e-3},
        {"  - {kind: cubic_stiffness, coefficient_Npm3: 1e4, at_m: 0.44}\n", 3e-3},
        {"  - {kind: quadratic_drag, coefficient_Ns2pm3: 0.2}\n", 4e-3},
        {"  - {kind: coulomb_friction}\n", 3e-2},
        {"  - {kind: patch_softening}\n", 1e-3},
        {"  - {kind: bilinear_stiffness}\n", 2e-3},
        {"  - {kind: microslip}\n", 1e-3},
        {"  - {kind: stop_contact, stiffness_Npm: 100}\n", 1e-2},
        {"  - {kind: sensor_saturation, level: 0.5}\n  - {kind: sensor_highpass, tau_s: 0.05}\n", 2e-3},
        {"  - {kind: quadratic_drag, coefficient_Ns2pm3: 0.1}\n  - {kind: patch_softening}\n"
         "  - {kind: sensor_lag, tau_s: 0.0002}\n  - {kind: drive_saturation, level_V: 5}\n",
         5e-3},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double off = distance(cases[i].effects, false, 45.0); /* over the first two modes */
        if (!(off < cases[i].most))
            fail_msg("%s: off by %.3g of rms, at most %.3g", cases[i].effects, off, cases[i].most);
    }
}

/* A drive that jumps shakes what is above the space: two blocks beside it answer for that. */
static void blocks_beside_the_space(void **state)
{
    (void)state;
    const double plain = distance("", true, 300.0), mended = distance("", false, 300.0);
    assert_true(plain > 4e-3 && plain < 8e-3);
    assert_true(mended < 1.5e-3);
    static const char shifted[] = "  - {kind: patch_position, shift_m: 0.003}\n";
    assert_true(distance(shifted, true, 300.0) > 1e-2);
    assert_true(distance(shifted, false, 300.0) < 1.5e-3);
    static struct target_image image;
    make("", &image);
    assert_int_equal(image.n_beside, 2);
    assert_true(image.held_error < 1e-3);
    target_image_free(&image);
    make("  - {kind: viscoelastic}\n", &image); /* 15 blocks of its own */
    assert_int_equal(image.n_beside, 1);
    target_image_free(&image);
}

/* ---- What is refused, and what is not said ---- */

static const char *refused(const char *effects, const struct target_options *o, enum bf_status status)
{
    static struct bf_error err;
    static struct target_image image;
    struct model model;
    fixture_model(&model, effects);
    assert_int_equal(target_image_make(&model, o, &image, &err), status);
    target_image_free(&image);
    model_free(&model);
    return err.text;
}

/* At 1 kHz a 168 MHz controller leaves 82 300 instructions, at 10 kHz 6700. */
static void a_step_that_may_not_fit_is_refused(void **state)
{
    static const char two[] = "  - {kind: coulomb_friction}\n  - {kind: cubic_stiffness}\n";
    static const char six[] = "  - {kind: coulomb_friction}\n  - {kind: microslip}\n  - {kind: stop_contact}\n"
                              "  - {kind: cubic_stiffness, at_m: 0.1}\n  - {kind: cubic_stiffness, at_m: 0.3}\n"
                              "  - {kind: cubic_stiffness, at_m: 0.44}\n";
    static struct target_image image;
    struct model model;
    struct bf_error err;
    (void)state;
    struct target_options o = options_for(2e-3);
    o.board.sample_Hz = 10000.0;
    assert_contains(refused(two, &o, BF_NUMERIC), "leaves 6700");
    o.board.core_MHz = 400.0;
    fixture_model(&model, two);
    assert_int_equal(target_image_make(&model, &o, &image, &err), BF_OK);
    assert_true(image.step_bound <= image.step_budget && image.step_budget == 18300);
    assert_in_range(image.law_evaluations, 4, 15); /* 16 would not fit */
    struct target_controller board = {.stored = -1, .sample_Hz = 10000.0, .core_Hz = 400e6};
    assert_int_equal(target_image_check(&image.file, &board), BEAM_IMAGE_FINE);
    board.core_Hz = 168e6;
    assert_int_equal(target_image_check(&image.file, &board), BEAM_IMAGE_TOO_SLOW);
    target_image_free(&image);
    model_free(&model);
    o = options_for(2e-3);
    fixture_model(&model, six);
    assert_int_equal(target_image_make(&model, &o, &image, &err), BF_OK);
    assert_true(image.law_evaluations < 16 && image.step_bound <= image.step_budget);
    target_image_free(&image);
    model_free(&model);
    o.board.sample_Hz = 4000.0;
    assert_contains(refused(six, &o, BF_NUMERIC), "--core-MHz");
}

static void effects_that_cannot_run(void **state)
{
    struct target_options o = options_for(2e-3);
    (void)state;
    assert_contains(refused("  - {kind: mains_hum}\n", &o, BF_BAD_FILE), "--without mains_hum");
    assert_contains(refused("  - {kind: base_motion, amplitude_mps2: 1}\n", &o, BF_BAD_FILE), "phase");
    assert_contains(refused("  - {kind: thermal_drift}\n", &o, BF_BAD_FILE), "begins with a recording");
    assert_contains(refused("  - {kind: sensor_offset, drift_per_s: 0.1}\n", &o, BF_BAD_FILE), "begins with");
    assert_contains(refused("  - {kind: large_rotation}\n", &o, BF_BAD_FILE), "inertia along the beam");
    assert_contains(refused("  - {kind: sensor_delay, delay_s: 0.08}\n", &o, BF_BAD_FILE), "remember more samples");
    assert_contains(refused("  - {kind: quadratic_drag}\n  - {kind: cubic_stiffness, at_m: 0.1}\n"
                            "  - {kind: cubic_stiffness, at_m: 0.2}\n  - {kind: cubic_stiffness, at_m: 0.3}\n"
                            "  - {kind: cubic_stiffness, at_m: 0.4}\n  - {kind: patch_softening}\n",
                            &o, BF_BAD_FILE),
                    "law coordinates");
    assert_contains(
        refused("  - {kind: viscoelastic, relaxation_s: 0.01}\n  - {kind: viscoelastic, relaxation_s: 0.1}\n"
                "  - {kind: electrical_coupling}\n",
                &o, BF_BAD_FILE),
        "memories");
    static const char *const hum[] = {"mains_hum"}, *const nothing[] = {"tip_mass"};
    o.without = nothing;
    o.n_without = 1;
    assert_contains(refused("  - {kind: mains_hum}\n", &o, BF_USAGE), "no such effect");
    o.without = hum;
    static struct target_image image;
    struct bf_error err;
    struct model model;
    fixture_model(&model,
                  "  - {kind: mains_hum}\n  - {kind: input_position}\n  - {kind: sensor_lag, channel: tip_mps}\n");
    assert_int_equal(target_image_make(&model, &o, &image, &err), BF_OK);
    assert_int_equal(image.file.counts.n_uses, 0);
    assert_string_equal(image.effects[0].fate, "left out, as asked");
    assert_contains(image.effects[1].fate, "left out");
    assert_contains(image.effects[2].fate, "left out");
    target_image_free(&image);
    model_free(&model);
}

static void what_is_not_said(void **state)
{
    struct target_options o = options_for(2e-3);
    (void)state;
    o.board.sample_Hz = 0.0;
    assert_contains(refused("", &o, BF_BAD_FILE), "sample_Hz");
    o = options_for(2e-3);
    o.board.sensor[0] = '\0';
    assert_contains(refused("", &o, BF_BAD_FILE), "--sensor");
    (void)strcpy(o.board.sensor, "nothing");
    assert_contains(refused("", &o, BF_USAGE), "no such output");
    o = options_for(2e-3);
    o.board.drive[0] = '\0'; /* the only patch moment is meant */
    assert_contains(refused("  - {kind: mains_hum}\n", &o, BF_BAD_FILE), "mains_hum");
    (void)strcpy(o.board.drive, "nothing");
    assert_contains(refused("", &o, BF_USAGE), "no such input");
    o = options_for(2e-3);
    o.board.sensor_per_code = 0.0;
    assert_contains(refused("", &o, BF_BAD_FILE), "--sensor-per-code");
    o = options_for(2e-3);
    o.board.drive_per_code = 0.0;
    assert_contains(refused("", &o, BF_BAD_FILE), "--drive-per-code");
    o = options_for(0.0);
    assert_contains(refused("", &o, BF_BAD_FILE), "noise_rms");
    o = options_for(2e-3);
    o.board.alarm_ratio = 2.0;
    o.board.clear_ratio = 2.0;
    assert_contains(refused("", &o, BF_BAD_FILE), "clear_ratio");
}

/* The noise of the fitted records in root mean square; held-out records do not count; the block goes before. */
static void the_noise_of_the_fit(void **state)
{
    static struct target_image image;
    struct bf_error err;
    struct model model;
    struct target_options o = options_for(0.0);
    (void)state;
    fixture_model(&model, "");
    struct fit_record *records = bf_alloc(3, sizeof *records);
    for (int r = 0; r < 3; r++) {
        records[r] = (struct fit_record){.file = bf_strdup("a.csv"), .held_out = r == 2, .n_channels = 1};
        records[r].channels = bf_alloc(1, sizeof *records[r].channels);
        (void)strcpy(records[r].channels[0].name, "piezo_V");
        records[r].channels[0].noise_rms = r == 0 ? 3e-3 : r == 1 ? 4e-3 : 1.0;
    }
    model.fit.records = records;
    model.fit.n_records = 3;
    assert_int_equal(target_image_make(&model, &o, &image, &err), BF_OK);
    assert_true(fabs(image.board.noise_rms - 5e-3 / sqrt(2.0)) < 1e-12);
    assert_string_equal(image.noise_from, "the fit");
    target_image_free(&image);
    model.board.present = true;
    model.board.noise_rms = 7e-3;
    assert_int_equal(target_image_make(&model, &o, &image, &err), BF_OK);
    assert_true(image.file.front.setup.noise_rms == 7e-3F);
    assert_true(image.file.front.setup.alarm_ratio == 3.0F && image.file.front.setup.clear_ratio == 2.0F);
    target_image_free(&image);
    model_free(&model);
}

static void other_sensors_and_drives(void **state)
{
    static struct target_image image;
    static const char *const sensors[] = {"accel_mps2", "tip_mps"};
    struct bf_error err;
    struct model model;
    (void)state;
    fixture_model(&model, "");
    for (int i = 0; i < 2; i++) {
        struct target_options o = options_for(2e-3);
        (void)strcpy(o.board.sensor, sensors[i]);
        (void)strcpy(o.board.drive, i == 0 ? "drive_V" : "hammer_N");
        o.hold = i == 0 ? BEAM_HOLD_ZERO_ORDER : BEAM_HOLD_FIRST_ORDER;
        assert_int_equal(target_image_make(&model, &o, &image, &err), BF_OK);
        assert_true(image.float_error < 1e-5);
        assert_string_equal(image.sensor_unit, i == 0 ? "m/s^2" : "m/s");
        assert_string_equal(image.drive_unit, i == 0 ? "V" : "N");
        assert_int_equal(image.file.counts.drive_input, i == 0 ? 0 : -1);
        target_image_free(&image);
    }
    model_free(&model);
}

/* A beam that hangs free may drift; its own motions have no frequency to be wrong in. */
static void a_free_beam(void **state)
{
    static struct target_image image;
    static const char text[] = "format: beamfit-model/1\nbeam: {length_m: 0.5, support: free-free}\n"
                               "parameters: {EI_beam_Nm2: 0.9, rho_beam_kgpm: 0.1, cDI_beam_sNm2: 1e-5, "
                               "gamma_sNpm2: 0.01}\n"
                               "inputs: {shaker_N: {kind: point_force, at_m: 0.15}}\n"
                               "outputs: {vel: {kind: velocity, at_m: 0.35}}\n"
                               "board: {sample_Hz: 2000, sensor: {per_code: 0.001}, drive: {per_code: 0.02}, "
                               "noise_rms: 0.01}\n";
    const struct target_options o = {.hold = BEAM_HOLD_ZERO_ORDER};
    struct bf_error err;
    struct model model;
    (void)state;
    assert_int_equal(model_read_text("free.yaml", text, sizeof text - 1, &model, &err), BF_OK);
    if (target_image_make(&model, &o, &image, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_true(isnan(image.relative_error[0]) && isnan(image.relative_error[1]));
    assert_true(fabs(image.relative_error[2]) < 1e-6);
    assert_true(image.held_error < 2e-3 && image.float_error < 1e-5);
    target_image_free(&image);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_controller_predicts_what_the_host_predicts),
        cmocka_unit_test(blocks_beside_the_space),
        cmocka_unit_test(a_step_that_may_not_fit_is_refused),
        cmocka_unit_test(effects_that_cannot_run),
        cmocka_unit_test(what_is_not_said),
        cmocka_unit_test(the_noise_of_the_fit),
        cmocka_unit_test(other_sensors_and_drives),
        cmocka_unit_test(a_free_beam),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
