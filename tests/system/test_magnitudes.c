/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From a spectrum without phase to a model: the commands as typed, on the receptance in closed form. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "../exact_response.h"
#include "ask.h"

/* Frequencies a fifth off, damping far off. */
static const char model[] = "format: beamfit-model/1\nbeam:\n  length_m: 0.3\n  support: clamped-free\nparameters:\n"
                            "  EI_beam_Nm2: {value: 3.0}\n  rho_beam_kgpm: {value: 0.25}\n"
                            "  cDI_beam_sNm2: {value: 1e-3}\n  gamma_sNpm2: {value: 0.2}\n"
                            "inputs:\n  hammer_N: {kind: point_force, at_m: 0.3}\n"
                            "outputs:\n  accel_mps2: {kind: acceleration, at_m: 0.3}\neffects: []\n";
static const struct exact_cantilever beam = {
    .length_m = 0.3, .EI_Nm2 = 2.1, .rho_kgpm = 0.21, .cDI_sNm2 = 2e-4, .gamma_sNpm2 = 0.5};

static void put(const struct rig *rig, const char *name, double tip_kg, double window_rate, uint64_t seed)
{
    struct exact_cantilever loaded = beam;
    const struct exact_measurement m = {.df_Hz = 0.5,
                                        .lines = 800,
                                        .averages = 10,
                                        .noise = 0.05,
                                        .seed = &seed,
                                        .window_rate = window_rate,
                                        .form = EXACT_DECIBEL};
    char path[128];
    loaded.tip_kg = tip_kg;
    (void)snprintf(path, sizeof path, "%s/%s", rig->dir, name);
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    exact_write(&loaded, &m, out);
    assert_int_equal(fclose(out), 0);
}

static void prepare(struct rig *rig)
{
    write_text(rig->dir, "model.yaml", model);
    put(rig, "whole.csv", 0.0, 0.0, 1);
    put(rig, "windowed.csv", 0.0, 3.0, 2);
    put(rig, "loaded.csv", 0.004, 0.0, 3);
    must(rig, "for f in whole windowed loaded; do awk -F, -v OFS=, '/^#/ {print; next} {print $1, $2, $4}' $f.csv "
              ">$f.dB.csv; done\n"
              "awk -F, -v OFS=, '/^#/ {next} {print $1, $2}' whole.csv >bare.csv\n");
}

static double number(const json_t *root, const char *first, const char *second, const char *third)
{
    const json_t *value = json_object_get(json_object_get(json_object_get(root, first), second), third);
    return json_is_number(value) ? json_number_value(value) : nan("");
}

static void assert_within(const json_t *fit, const char *name, double truth)
{
    const double value = number(fit, "parameters", name, "value"), sd = number(fit, "parameters", name, "sd");
    if (!(fabs(value - truth) < 4.0 * sd && sd < 0.05 * truth))
        fail_msg("%s: %g ± %g, true %g", name, value, sd, truth);
}

static void a_spectrum_without_phase_is_fitted(void **state)
{
    struct rig *rig = *state;
    static const char *const records[] = {"whole.dB.csv", "windowed.dB.csv", "bare.csv"};
    prepare(rig);
    for (size_t i = 0; i < 3; i++) {
        json_t *fit = answer(
            rig, (const char *[]){"fit", "model.yaml", records[i], "-o", "fitted.yaml", "--force", "--json", NULL});
        assert_true(json_is_true(json_object_get(fit, "converged")));
        assert_within(fit, "EI_beam_Nm2", beam.EI_Nm2);
        assert_within(fit, "rho_beam_kgpm", beam.rho_kgpm);
        assert_within(fit, "cDI_beam_sNm2", beam.cDI_sNm2);
        assert_within(fit, "gamma_sNpm2", beam.gamma_sNpm2);
        assert_true(fabs(json_number_value(json_object_get(fit, "noise_ratio")) - 1.0) < 0.15);
        json_decref(fit);
    }
}

static void what_it_misses_is_seen_and_what_it_cannot_do_is_said(void **state)
{
    struct rig *rig = *state;
    prepare(rig);
    json_decref(
        answer(rig, (const char *[]){"fit", "model.yaml", "whole.dB.csv", "-o", "fitted.yaml", "--json", NULL}));
    json_t *compared = answer(rig, (const char *[]){"compare", "fitted.yaml", "whole.dB.csv", "--check",
                                                    "loaded.dB.csv", "--plot", "pictures", "--json", NULL});
    assert_true(json_number_value(json_object_get(compared, "noise_ratio")) < 1.1);
    assert_true(json_number_value(json_object_get(compared, "check_noise_ratio")) > 3.0);
    json_decref(compared);
    must(rig, "test -s pictures/loaded.dB-accel_mps2.png\n");
    run_beamfit(rig->dir, (const char *[]){"diagnose", "fitted.yaml", "loaded.dB.csv", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 2);
    says(rig->outcome.err, "a spectrum without phase has no motion in it");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_spectrum_without_phase_is_fitted, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(what_it_misses_is_seen_and_what_it_cannot_do_is_said, rig_setup, rig_teardown),
    };
    return cmocka_run_group_tests_name("magnitudes", tests, NULL, NULL);
}
