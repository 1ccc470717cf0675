/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Measured recordings, which stand beside the project and not in it (docs/real_data.md). Also fit --splines. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <limits.h>
#include "ask.h"

/* Absolute path of a real recording; skips the test, aloud, where it is absent. */
static void need(const char *name, char path[PATH_MAX])
{
    char wanted[512];
    const char *shared = getenv("BEAMFIT_SHARED");
    (void)snprintf(wanted, sizeof wanted, "%s/data/real/%s", shared ? shared : "../shared", name);
    if (realpath(wanted, path) == NULL) {
        print_message("SKIPPED: %s is not there (set BEAMFIT_SHARED to the directory that has data/)\n", wanted);
        skip();
    }
}

static double number(const json_t *root, const char *first, const char *second, const char *third)
{
    const json_t *at = json_object_get(json_object_get(root, first), second);
    const json_t *value = third ? json_object_get(at, third) : at;
    assert_true(json_is_number(value));
    return json_number_value(value);
}

static void within(const char *what, double value, double low, double high)
{
    if (!(value >= low && value <= high))
        fail_msg("%s is %.6g, wanted %.6g to %.6g", what, value, low, high);
}

static double frequency(struct rig *rig, const char *model, size_t mode)
{
    json_t *root = ANSWER(rig, "modes", model, "-n", "9", "--json");
    const json_t *one = json_array_get(json_object_get(root, "modes"), mode - 1);
    const double value = json_number_value(json_object_get(one, "frequency_Hz"));
    json_decref(root);
    return value;
}

static const char plate[] = "format: beamfit-model/1\n"
                            "beam: {length_m: 0.3, patch_m: [0.005, 0.025]}\n"
                            "parameters:\n"
                            "  EI_beam_Nm2: 1.055\n"
                            "  EI_patch_Nm2: {value: 1.322, fixed: true}\n"
                            "  rho_beam_kgpm: {value: 0.1057, fixed: true}\n"
                            "  rho_patch_kgpm: {value: 0.1289, fixed: true}\n"
                            "  cDI_beam_sNm2: 1.794e-5\n"
                            "  cDI_patch_sNm2: {value: 2.247e-5, fixed: true}\n"
                            "  gamma_sNpm2: 0.001638\n"
                            "  Ks_V: {value: 50, fixed: true}\n"
                            "outputs:\n"
                            "  piezo_V: {kind: patch_strain}\n"
                            "effects:\n"
                            "  - {kind: mains_hum, amplitude: 0.05, frequency_Hz: 49.2}\n"
                            "  - {kind: sensor_offset, offset: 0.01, drift_per_s: {value: 0, fixed: true}}\n";

/* From the handbook's start: the mode and the mains' frequency that the recording is known to hold. */
static void a_free_decay_gives_mode_and_hum(void **state)
{
    struct rig *rig = *state;
    char source[PATH_MAX];
    need("iitd_pzt_cantilever/pzt_free_decay.csv", source);
    RAN(rig, 0, "import", source, "--time", "time_s_corrected", "--channel", "pzt_voltage_V=piezo_V", "--free-decay",
        "--free-from", "1.4", "--to", "2.4", "-o", "hit.csv");
    write_text(rig->dir, "plate.yaml", plate);
    json_t *root = ANSWER(rig, "fit", "plate.yaml", "hit.csv", "--no-search", "-o", "fitted.yaml", "--json");
    within("hum, Hz", number(root, "parameters", "frequency_Hz", "value"), 49.0, 49.4);
    within("hum, V", number(root, "parameters", "amplitude", "value"), 0.08, 0.12);
    within("error", json_number_value(json_object_get(root, "nrmse")), 0.0, 0.12);
    json_decref(root);
    within("mode 1, Hz", frequency(rig, "fitted.yaml", 1), 18.6, 18.85);
}

/* The workbook's own time axis is five times too slow: hum at 9.85 Hz is refused, and so is a recording with two clocks. */
static void a_wrong_clock_is_not_taken_for_hum(void **state)
{
    struct rig *rig = *state;
    char source[PATH_MAX];
    need("iitd_pzt_cantilever/pzt_free_decay.csv", source);
    assert_non_null(strstr(RAN(rig, 2, "import", source, "-o", "hit.csv"), "time_s_as_listed"));
    write_text(rig->dir, "plate.yaml", plate);
    RAN(rig, 0, "drop", "plate.yaml", "mains_hum", "-o", "quiet.yaml");
    assert_non_null(
        strstr(RAN(rig, 2, "add", "quiet.yaml", "mains_hum", "frequency_Hz=9.85", "-o", "x.yaml"), "outside"));
}

/* Nine frequencies of a steel cantilever: all lower than the handbook's by the same share. */
static void a_steel_beam_is_off_by_one_scale(void **state)
{
    static const double measured_Hz[] = {6.62, 41.47, 117.93, 229.97, 380.3, 569.2, 797.4, 1057.2, 1364.6};
    struct rig *rig = *state;
    RAN(rig, 0, "init", "--length", "0.759", "--width", "0.05066", "--thickness", "0.00514", "--E", "200e9",
        "--density", "7850", "--output", "accel_mps2=acceleration@0.38", "-o", "steel.yaml");
    RAN(rig, 0, "add", "steel.yaml", "root_compliance", "compliance_radpNm=0.0007", "-o", "clamp.yaml");
    for (size_t k = 1; k <= 9; k++)
        within("measured / handbook", measured_Hz[k - 1] / frequency(rig, "steel.yaml", k), 0.905, 0.93);
    const double first = measured_Hz[0] / frequency(rig, "clamp.yaml", 1);
    within("a soft clamp: ratio of mode 1 over that of mode 9",
           first * frequency(rig, "clamp.yaml", 9) / measured_Hz[8], 1.1, 1.3);
}

static const char strip[] =
    "format: beamfit-model/1\n"
    "beam: {length_m: 0.03}\n"
    "parameters:\n"
    "  EI_beam_Nm2: 0.02135\n"
    "  rho_beam_kgpm: {value: 0.03925, fixed: true}\n"
    "  cDI_beam_sNm2: 3.63e-7\n"
    "  gamma_sNpm2: {value: 0, fixed: true}\n"
    "inputs:\n"
    "  force_N: {kind: point_force, at_m: 0.03}\n"
    "outputs:\n"
    "  tip_m: {kind: displacement, at_m: 0.03}\n"
    "effects:\n"
    "  - {kind: tip_mass, mass_kg: 0.011}\n"
    "  - {kind: sensor_offset, channel: tip_m, offset: 1e-6, drift_per_s: {value: 0, fixed: true}}\n";

/* One multisine of the silverbox, from the pause before it: 2 N and 1 mm for a volt. */
static void import_silverbox(struct rig *rig, const char *source, const char *from, const char *to, const char *name)
{
    RAN(rig, 0, "import", source, "--channel", "V1_input_V=force_N", "--channel", "V2_output_V=tip_m", "--scale",
        "force_N=2:N", "--scale", "tip_m=0.001:m", "--from", from, "--to", to, "-o", name);
}

/* A circuit with a cubic spring as a strip with one mode: the cubic cuts the error of a held-out multisine tenfold. */
static void a_cubic_spring_explains_the_silverbox(void **state)
{
    static const char *const models[] = {"strip.yaml", "cubic.yaml"};
    struct rig *rig = *state;
    char source[PATH_MAX];
    need("silverbox/SNLS80mV.csv", source);
    import_silverbox(rig, source, "66.4797", "69.833", "fitted.csv");
    import_silverbox(rig, source, "80.7207", "84", "held.csv");
    write_text(rig->dir, models[0], strip);
    RAN(rig, 0, "add", models[0], "cubic_stiffness", "--at", "0.03", "coefficient_Npm3=1e9", "-o", models[1]);
    double error[2];
    for (size_t i = 0; i < 2; i++) {
        json_t *root = ANSWER(rig, "fit", models[i], "fitted.csv", "--check", "held.csv", "--no-search", "-o",
                              "out.yaml", "--json");
        error[i] = number(root, "check", "nrmse", NULL);
        json_decref(root);
    }
    within("linear strip, error of the held-out record", error[0], 0.1, 0.2);
    within("held-out error with the cubic over that without", error[1] / error[0], 1e-3, 0.1);
}

/* ---- fit --splines ---- */

static void splines_are_checked(void **state)
{
    static const char *const wrong[] = {"ten", "3", "2000", "10,even", "10.5", ""};
    struct rig *rig = *state;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        const char *said = RAN(rig, 2, "fit", "model.yaml", "record.csv", "--splines", wrong[i], "-o", "new.yaml");
        assert_non_null(strstr(said, "--splines"));
    }
    assert_false(file_exists(rig->dir, "new.yaml"));
}

/* A record made by the model itself: the space it was made in finds the values again, a coarse uniform one cannot. */
static void a_coarse_space_moves_the_estimates(void **state)
{
    struct rig *rig = *state;
    char record[RIG_RECORD_TEXT];
    rig_make_record(record, "time_s,hammer_N,piezo_V", 250, -1, "", 1.0);
    write_text(rig->dir, "record.csv", record);
    RAN(rig, 0, "simulate", "model.yaml", "--input", "record.csv", "-o", "clean.csv");
    double off[3];
    static const char *const spaces[] = {"160", "10", "10,uniform"};
    for (size_t i = 0; i < 3; i++) {
        json_t *root = ANSWER(rig, "fit", "model.yaml", "clean.csv", "--start", "near", "--splines", spaces[i], "-o",
                              "new.yaml", "--json");
        off[i] = number(root, "parameters", "EI_patch_Nm2", "value") / 0.793 - 1.0;
        json_decref(root);
    }
    within("160 splines: EI_patch, relative error", off[0], -1e-3, 1e-3);
    assert_true(off[1] * off[1] < off[2] * off[2]);
    within("10 uniform splines: EI_patch, relative error", off[2], -0.3, -0.01);
}

#define CASE(test) cmocka_unit_test_setup_teardown(test, rig_setup, rig_teardown)

/* Hammer and accelerometer of this set point opposite ways; its model here lacks the mass at the tip. */
static void opposite_channels_are_named_on_measured_hits(void **state)
{
    struct rig *rig = *state;
    static const char *const hits[] = {"m2t1", "m2t2", "m4t1", "m4t2"};
    static const char beam[] = "format: beamfit-model/1\n"
                               "beam: {length_m: 0.35}\n"
                               "parameters:\n"
                               "  EI_beam_Nm2: {value: 92.25, prior: 0.1}\n"
                               "  rho_beam_kgpm: {value: 1.177, prior: 0.05}\n"
                               "  cDI_beam_sNm2: 0.0016\n"
                               "  gamma_sNpm2: 0.002\n"
                               "inputs: {%s: {kind: point_force, at_m: 0.345}}\n"
                               "outputs: {accel_mps2: {kind: acceleration, at_m: 0.345}}\n";
    char path[PATH_MAX], name[64], text[1024];
    for (size_t i = 0; i < sizeof hits / sizeof *hits; i++) {
        (void)snprintf(name, sizeof name, "unb_tip_masses/%s.csv", hits[i]);
        need(name, path);
        (void)snprintf(text, sizeof text, beam, "hammer_N");
        write_text(rig->dir, "unb.yaml", text);
        json_t *root = ANSWER(rig, "compare", "unb.yaml", path, "--json");
        const json_t *factors = json_object_get(root, "channel_factors");
        assert_int_equal(json_array_size(factors), 1);
        const json_t *one = json_array_get(factors, 0);
        within("factor", json_number_value(json_object_get(one, "factor")), -1.0, -1.0);
        assert_string_equal(json_string_value(json_object_get(one, "or_channel")), "hammer_N");
        json_decref(root);
    }
    need("unb_tip_masses/shaker_2_12.csv", path); /* one steady sine tells no sign */
    (void)snprintf(text, sizeof text, beam, "shaker_N");
    write_text(rig->dir, "unb.yaml", text);
    json_t *root = ANSWER(rig, "compare", "unb.yaml", path, "--json");
    assert_int_equal(json_array_size(json_object_get(root, "channel_factors")), 0);
    json_decref(root);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(a_free_decay_gives_mode_and_hum),
        CASE(a_wrong_clock_is_not_taken_for_hum),
        CASE(a_steel_beam_is_off_by_one_scale),
        CASE(a_cubic_spring_explains_the_silverbox),
        CASE(opposite_channels_are_named_on_measured_hits),
        CASE(splines_are_checked),
        CASE(a_coarse_space_moves_the_estimates),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
