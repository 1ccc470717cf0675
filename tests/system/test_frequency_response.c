/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From a frequency response with coherence to a model, and to the mass that it lacks: the commands as typed. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "../exact_response.h"
#include "ask.h"

static const char model[] = "format: beamfit-model/1\nbeam:\n  length_m: 0.3\n  support: clamped-free\nparameters:\n"
                            "  EI_beam_Nm2: {value: 2.5}\n  rho_beam_kgpm: {value: 0.25}\n"
                            "  cDI_beam_sNm2: {value: 1e-3}\n  gamma_sNpm2: {value: 0.2}\n"
                            "inputs:\n  hammer_N: {kind: point_force, at_m: 0.3}\n"
                            "outputs:\n  accel_mps2: {kind: acceleration, at_m: 0.3}\neffects: []\n";

static void put(const struct rig *rig, const char *name, double tip_kg, double window_rate, uint64_t seed)
{
    const struct exact_cantilever beam = {
        .length_m = 0.3, .EI_Nm2 = 2.1, .rho_kgpm = 0.21, .cDI_sNm2 = 2e-4, .gamma_sNpm2 = 0.05, .tip_kg = tip_kg};
    const struct exact_measurement m = {.df_Hz = 0.5,
                                        .lines = 800,
                                        .averages = 10,
                                        .noise = 0.05,
                                        .seed = &seed,
                                        .window_rate = window_rate,
                                        .form = window_rate > 0.0 ? EXACT_DECIBEL : EXACT_COMPLEX};
    char path[128];
    (void)snprintf(path, sizeof path, "%s/%s", rig->dir, name);
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    exact_write(&beam, &m, out);
    assert_int_equal(fclose(out), 0);
}

static double at(const json_t *root, const char *first, const char *second, const char *third)
{
    const json_t *value = json_object_get(json_object_get(json_object_get(root, first), second), third);
    assert_true(json_is_number(value));
    return json_number_value(value);
}

static void assert_drawn(const struct rig *rig, const char *name)
{
    char path[160];
    (void)snprintf(path, sizeof path, "%s/%s", rig->dir, name);
    FILE *in = fopen(path, "r");
    if (in == NULL)
        fail_msg("%s was not drawn", name);
    assert_int_equal(fseek(in, 0, SEEK_END), 0);
    assert_true(ftell(in) > 1000);
    assert_int_equal(fclose(in), 0);
}

static void a_response_is_fitted_and_what_is_missing_named(void **state)
{
    struct rig *rig = *state;
    write_text(rig->dir, "model.yaml", model);
    put(rig, "clean.csv", 0.0, 0.0, 1);
    put(rig, "window.csv", 0.0, 3.0, 2);
    put(rig, "mass.csv", 0.004, 0.0, 3);
    json_t *fit = answer(rig, (const char *[]){"fit", "model.yaml", "clean.csv", "--check", "window.csv", "-o",
                                               "fitted.yaml", "--json", NULL});
    assert_true(fabs(at(fit, "parameters", "EI_beam_Nm2", "value") / 2.1 - 1.0) < 3e-3);
    assert_true(fabs(at(fit, "parameters", "gamma_sNpm2", "value") / 0.05 - 1.0) < 0.05);
    assert_true(fabs(json_number_value(json_object_get(fit, "noise_ratio")) - 1.0) < 0.1);
    json_decref(fit);
    json_t *held = answer(rig, (const char *[]){"compare", "fitted.yaml", "window.csv", "--json", NULL});
    assert_true(fabs(json_number_value(json_object_get(held, "noise_ratio")) - 1.0) < 0.1);
    json_decref(held);
    json_decref(
        answer(rig, (const char *[]){"compare", "fitted.yaml", "mass.csv", "--plot", "pictures", "--json", NULL}));
    assert_drawn(rig, "pictures/mass-accel_mps2.png");
    assert_drawn(rig, "pictures/mass-accel_mps2-model.dat");
    json_t *found = answer(rig, (const char *[]){"diagnose", "fitted.yaml", "mass.csv", "--json", NULL});
    assert_string_equal(json_string_value(json_object_get(found, "verdict")), "missing");
    assert_string_equal(json_string_value(json_array_get(json_object_get(found, "effects"), 0)), "tip_mass");
    const json_t *best = json_array_get(json_object_get(found, "candidates"), 0);
    assert_true(fabs(at(best, "parameters", "mass_kg", "value") / 0.004 - 1.0) < 0.01);
    json_decref(found);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_response_is_fitted_and_what_is_missing_named, rig_setup, rig_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
