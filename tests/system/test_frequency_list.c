/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From a list of measured frequencies to a model: the commands as typed, on frequencies of the transcendental equation. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "../exact_beam.h"
#include "../exact_response.h"
#include "ask.h"

static const char model[] = "format: beamfit-model/1\nbeam:\n  length_m: 0.3\n  support: clamped-free\nparameters:\n"
                            "  EI_beam_Nm2: {value: 2.8}\n  rho_beam_kgpm: {value: 0.21, fixed: true}\n"
                            "  cDI_beam_sNm2: {value: 1e-4}\n  gamma_sNpm2: {value: 0.2}\n"
                            "inputs:\n  hammer_N: {kind: point_force, at_m: 0.3}\n"
                            "outputs:\n  accel_mps2: {kind: acceleration, at_m: 0.3}\neffects: []\n";
static const char law[] = "format: beamfit-model/1\nbeam:\n  length_m: 0.3\n  support: clamped-free\nparameters:\n"
                          "  EI_beam_Nm2: {value: 2.1}\n  rho_beam_kgpm: {value: 0.21, fixed: true}\n"
                          "  cDI_beam_sNm2: {value: 2e-4}\n  gamma_sNpm2: {value: 0.05}\n"
                          "inputs:\n  hammer_N: {kind: point_force, at_m: 0.3}\n"
                          "outputs:\n  accel_mps2: {kind: acceleration, at_m: 0.3}\n"
                          "effects:\n  - {kind: quadratic_drag, coefficient_Ns2pm3: {value: 0.02}}\n";
static const struct exact_cantilever beam = {
    .length_m = 0.3, .EI_Nm2 = 2.1, .rho_kgpm = 0.21, .cDI_sNm2 = 2e-5, .gamma_sNpm2 = 0.05};
enum { MODES = 5 };

static FILE *begin(const struct rig *rig, const char *name)
{
    char path[128];
    (void)snprintf(path, sizeof path, "%s/%s", rig->dir, name);
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    return out;
}

static void put(const struct rig *rig, const char *name, const char *text)
{
    FILE *out = begin(rig, name);
    (void)fputs(text, out);
    assert_int_equal(fclose(out), 0);
}

/* |p| and ζ of mode k of the uniform beam: ω = (z/ℓ)² √(EI/ρ), 2ζω = γ/ρ + ω² cDI/EI. */
static void put_list(const struct rig *rig, const char *name, double sd, uint64_t seed)
{
    FILE *out = begin(rig, name);
    (void)fprintf(out, sd > 0.0 ? "mode,freq_Hz,sd_Hz,damping_ratio,sd\n" : "freq_Hz\n");
    for (int k = 0; k < MODES; k++) {
        const double z = exact_uniform_root(0, k) / beam.length_m, omega = z * z * sqrt(beam.EI_Nm2 / beam.rho_kgpm);
        const double damping =
            0.5 * (beam.gamma_sNpm2 / beam.rho_kgpm + omega * omega * beam.cDI_sNm2 / beam.EI_Nm2) / omega;
        const double f_Hz = omega / (2.0 * acos(-1.0)), off = 1.0 + (sd > 0.0 ? sd : 1e-3) * signal_normal(&seed);
        if (sd > 0.0)
            (void)fprintf(out, "%d,%.9g,%.3g,%.6g,%.3g\n", k + 1, f_Hz * off, sd * f_Hz,
                          damping * (1.0 + 0.1 * signal_normal(&seed)), 0.1 * damping);
        else
            (void)fprintf(out, "%.9g\n", f_Hz * off);
    }
    assert_int_equal(fclose(out), 0);
}

static double parameter(const json_t *fit, const char *name, const char *what)
{
    const json_t *value = json_object_get(json_object_get(json_object_get(fit, "parameters"), name), what);
    return json_is_number(value) ? json_number_value(value) : nan("");
}

static void assert_within(const json_t *fit, const char *name, double truth, double most_sd)
{
    const double value = parameter(fit, name, "value"), sd = parameter(fit, name, "sd");
    if (!(fabs(value - truth) < 4.0 * sd && sd < most_sd * truth))
        fail_msg("%s: %g ± %g, true %g", name, value, sd, truth);
}

static void frequencies_and_damping_are_fitted(void **state)
{
    struct rig *rig = *state;
    put(rig, "model.yaml", model);
    put_list(rig, "list.csv", 1e-3, 1);
    put_list(rig, "bare.csv", 0.0, 2);
    json_t *fit = answer(rig, (const char *[]){"fit", "model.yaml", "list.csv", "--check", "bare.csv", "-o",
                                               "fitted.yaml", "--json", NULL});
    assert_true(json_is_true(json_object_get(fit, "converged")));
    assert_within(fit, "EI_beam_Nm2", beam.EI_Nm2, 2e-3);
    assert_within(fit, "cDI_beam_sNm2", beam.cDI_sNm2, 0.15);
    assert_within(fit, "gamma_sNpm2", beam.gamma_sNpm2, 0.3);
    const json_t *check = json_object_get(fit, "check");
    assert_true(json_number_value(json_object_get(check, "nrmse")) < 3e-3);
    json_decref(fit);
    json_t *compared =
        answer(rig, (const char *[]){"compare", "fitted.yaml", "list.csv", "--check", "bare.csv", "--json", NULL});
    const json_t *list = json_array_get(json_object_get(compared, "records"), 0);
    assert_int_equal(json_array_size(json_object_get(list, "measured")), MODES);
    assert_int_equal(json_array_size(json_object_get(list, "channels")), 2);
    assert_true(json_number_value(json_object_get(compared, "noise_ratio")) < 2.0);
    json_decref(compared);
}

/* The spread of the frequencies tells their errors; what damps stays as it is, and that is said. */
static void a_bare_list_tells_stiffness_alone(void **state)
{
    struct rig *rig = *state;
    put(rig, "model.yaml", model);
    put_list(rig, "bare.csv", 0.0, 3);
    json_t *fit = answer(rig, (const char *[]){"fit", "model.yaml", "bare.csv", "-o", "fitted.yaml", "--json", NULL});
    assert_within(fit, "EI_beam_Nm2", beam.EI_Nm2, 5e-3);
    assert_true(parameter(fit, "gamma_sNpm2", "value") == 0.2 && isnan(parameter(fit, "gamma_sNpm2", "sd")));
    assert_true(json_is_null(json_object_get(fit, "noise_ratio")));
    assert_int_equal(json_array_size(json_object_get(fit, "null_directions")), 2);
    json_decref(fit);
}

/* A response without mass knows EI/ρ; a list that is wrong pulls it, a list that is right does not. */
static void a_list_is_fitted_beside_a_response(void **state)
{
    struct rig *rig = *state;
    uint64_t seed = 5;
    const struct exact_measurement m = {.df_Hz = 0.5, .lines = 800, .averages = 10, .noise = 0.05, .seed = &seed};
    put(rig, "model.yaml", model);
    put_list(rig, "list.csv", 1e-3, 4);
    FILE *out = begin(rig, "response.csv");
    exact_write(&beam, &m, out);
    assert_int_equal(fclose(out), 0);
    json_t *alone =
        answer(rig, (const char *[]){"fit", "model.yaml", "response.csv", "-o", "alone.yaml", "--json", NULL});
    json_t *both = answer(
        rig, (const char *[]){"fit", "model.yaml", "list.csv", "response.csv", "-o", "both.yaml", "--json", NULL});
    assert_int_equal(json_array_size(json_object_get(both, "records")), 2);
    assert_within(both, "EI_beam_Nm2", beam.EI_Nm2, 2e-3);
    assert_true(parameter(both, "EI_beam_Nm2", "sd") <= parameter(alone, "EI_beam_Nm2", "sd"));
    json_decref(alone), json_decref(both);
}

/* On the terminal: the frequencies beside the modes, by compare and by modes, errors of both channels, and where they are. */
static void a_list_is_told_to_a_person(void **state)
{
    struct rig *rig = *state;
    static const char *const commands[][4] = {{"compare", "model.yaml", "list.csv"},
                                              {"modes", "model.yaml", "--measured", "shapes.csv"}};
    static const char *const told[][5] = {
        {"list.csv, and the modes that its frequencies belong to", "± sd", "damping_ratio", "Where the misfit is",
         "list.csv damping_ratio:\n    0-"},
        {"Measured frequencies beside them", "model Hz", "× model", "MAC", "torsion,"},
    };
    put(rig, "model.yaml", model);
    put(rig, "shapes.csv", "freq_Hz,shape_at_0.1_m,shape_at_0.3_m\n20,0.17,1\n124,-0.6,1\n215,,\n346,0.5,1\n");
    put_list(rig, "list.csv", 1e-3, 7);
    for (size_t i = 0; i < 2; i++) {
        const char *const words[] = {commands[i][0], commands[i][1], commands[i][2], commands[i][3], NULL};
        run_beamfit(rig->dir, words, &rig->outcome);
        assert_int_equal(rig->outcome.status, 0);
        for (size_t k = 0; k < 5; k++)
            says(rig->outcome.out, told[i][k]);
        assert_null(strstr(rig->outcome.out, "in time (thirds)"));
    }
}

static void what_a_list_cannot_do_is_said(void **state)
{
    struct rig *rig = *state;
    static const struct {
        const char *words[8];
        int status;
        const char *says;
    } cases[] = {
        {{"fit", "law.yaml", "list.csv", "-o", "x.yaml"}, 2, "quadratic_drag has no natural frequencies"},
        {{"compare", "law.yaml", "list.csv"}, 2, "quadratic_drag has no natural frequencies"},
        {{"diagnose", "model.yaml", "list.csv"}, 2, "a list of frequencies has no motion in it"},
        {{"report", "model.yaml", "list.csv", "-o", "r.html"}, 2, "a list of frequencies has no motion in it"},
        {{"fit", "model.yaml", "empty.csv", "-o", "x.yaml"}, 3, "no frequency in it"},
    };
    put(rig, "model.yaml", model);
    put(rig, "law.yaml", law);
    put(rig, "empty.csv", "mode,freq_Hz\n");
    put_list(rig, "list.csv", 1e-3, 6);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        run_beamfit(rig->dir, cases[i].words, &rig->outcome);
        assert_int_equal(rig->outcome.status, cases[i].status);
        if (strstr(rig->outcome.err, cases[i].says) == NULL)
            fail_msg("%s: %s", cases[i].words[0], rig->outcome.err);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(frequencies_and_damping_are_fitted, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(a_bare_list_tells_stiffness_alone, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(a_list_is_fitted_beside_a_response, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(a_list_is_told_to_a_person, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(what_a_list_cannot_do_is_said, rig_setup, rig_teardown),
    };
    return cmocka_run_group_tests_name("frequency_list", tests, NULL, NULL);
}
