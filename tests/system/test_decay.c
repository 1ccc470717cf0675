/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Free decays of a beam in air, from the truth simulator through import, diagnose and fit: the drag is named and within its interval. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>
#include "ask.h"

static const double drag = 0.25; /* N s²/m³ */
/* The record begins 0.4 s after the hit: nobody saw the force, and the beam moves. */
static const char spec[] = "EI_beam_Nm2 0.498\nEI_patch_Nm2 0.78\nrho_beam_kgpm 0.0921\nrho_patch_kgpm 0.44\n"
                           "cDI_beam_sNm2 6.5e-6\ncDI_patch_sNm2 1.1e-5\ngamma_sNpm2 0.0125\n"
                           "effect quadratic_drag coefficient_Ns2pm3=0.25\n"
                           "modes 16\ntolerance 3e-7\nnoise 0.003\nsample_rate_Hz 256\nduration_s 2\nkeep_from_s 0.5\n"
                           "input hammer_N point_force at_m=0.0254\noutput tip_mps velocity at_m=0.44\n"
                           "signal hammer_N raised_cosine start_s=0.1 width_s=0.012 level=%d\nseed %d\n";
static const char model[] =
    "format: beamfit-model/1\nbeam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\nparameters:\n"
    "  EI_beam_Nm2: 0.48\n  EI_patch_Nm2: {value: 0.78, fixed: true}\n"
    "  rho_beam_kgpm: {value: 0.0921, fixed: true}\n  rho_patch_kgpm: {value: 0.44, fixed: true}\n"
    "  cDI_beam_sNm2: 8e-6\n  cDI_patch_sNm2: {value: 1.1e-5, fixed: true}\n  gamma_sNpm2: 0.02\n"
    "outputs: {tip_mps: {kind: velocity, at_m: 0.44}}\n";

/* The simulator stands beside the program. */
static void simulate(const struct rig *rig, int number)
{
    char text[1024], name[32], command[1024];
    const char *program = getenv("BEAMFIT");
    assert_non_null(program);
    (void)snprintf(text, sizeof text, spec, 40 * number, number);
    (void)snprintf(name, sizeof name, "d%d.txt", number);
    write_text(rig->dir, name, text);
    (void)snprintf(command, sizeof command, "'%.*s/beam_truth' '%s/%s' -o '%s'", (int)(strrchr(program, '/') - program),
                   program, rig->dir, name, rig->dir);
    assert_int_equal(system(command), 0); /* NOLINT(cert-env33-c): a program of this build, names of this test */
}

static void the_drag_of_free_decays_is_named_and_found(void **state)
{
    struct rig *rig = *state;
    write_text(rig->dir, "still.yaml", model);
    for (int k = 1; k <= 3; k++) {
        char from[32], to[32];
        simulate(rig, k);
        (void)snprintf(from, sizeof from, "d%d.csv", k);
        (void)snprintf(to, sizeof to, "f%d.csv", k);
        const char *const import[] = {"import", from, "--channel", "tip_mps", "--free-decay", "-o", to, "--json", NULL};
        json_decref(answer(rig, import));
    }
    const char *const diagnose[] = {"diagnose",  "still.yaml", "f1.csv", "f2.csv",     "--check", "f3.csv",
                                    "--effects", "1",          "-o",     "named.yaml", "--json",  NULL};
    json_t *said = answer(rig, diagnose);
    assert_string_equal(json_string_value(json_object_get(said, "verdict")), "missing");
    const json_t *effects = json_object_get(said, "effects");
    assert_int_equal(json_array_size(effects), 1);
    assert_string_equal(json_string_value(json_array_get(effects, 0)), "quadratic_drag");
    json_decref(said);
    const char *const fit[] = {"fit",    "named.yaml", "f1.csv",   "f2.csv", "--check",
                               "f3.csv", "-o",         "air.yaml", "--json", NULL};
    json_t *fitted = answer(rig, fit);
    const json_t *coefficient = json_object_get(json_object_get(fitted, "parameters"), "coefficient_Ns2pm3");
    const json_t *interval = json_object_get(coefficient, "ci95");
    const double low = json_number_value(json_array_get(interval, 0)),
                 high = json_number_value(json_array_get(interval, 1));
    print_message("drag %.4g to %.4g, true %.4g; %.3g times the noise\n", low, high, drag,
                  json_number_value(json_object_get(fitted, "noise_ratio")));
    assert_true(low > 0.0 && low < drag && drag < high && high - low < 0.1 * drag);
    assert_true(json_number_value(json_object_get(fitted, "noise_ratio")) < 1.15);
    json_decref(fitted);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(the_drag_of_free_decays_is_named_and_found, rig_setup, rig_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
