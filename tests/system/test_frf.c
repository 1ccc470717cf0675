/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A model's frequency responses written for other programs, read back by import, and compared with the model that they came from. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "ask.h"

static const char beam[] =
    "format: beamfit-model/1\nbeam: {length_m: 0.3}\nparameters:\n"
    "  {EI_beam_Nm2: 2.1, rho_beam_kgpm: 0.21, cDI_beam_sNm2: 2e-4, gamma_sNpm2: 0.05}\n"
    "inputs:\n  hammer_N: {kind: point_force, at_m: 0.1}\n"
    "outputs:\n  accel_mps2: {kind: acceleration, at_m: 0.3, gain: 1.1}\n"
    "  tip_mps: {kind: velocity, at_m: 0.28}\n"
    "effects:\n  - {kind: tip_mass, mass_kg: 0.01}\n  - {kind: sensor_lag, channel: tip_mps, tau_s: 1e-4}\n";

static void what_is_written_is_read_back(void **state)
{
    struct rig *rig = *state;
    write_text(rig->dir, "beam.yaml", beam);
    json_t *root = ANSWER(rig, "frf", "beam.yaml", "--to", "600", "--step", "0.5", "-o", "beam.uff", "--json");
    assert_int_equal(json_integer_value(json_object_get(root, "lines")), 1200);
    assert_int_equal(json_array_size(json_object_get(root, "responses")), 2);
    json_decref(root);
    json_decref(ANSWER(rig, "import", "beam.uff", "--channel", "#1=accel_mps2/hammer_N_re", "--channel",
                       "#2=accel_mps2/hammer_N_im", "--channel", "#3=tip_mps/hammer_N_re", "--channel",
                       "#4=tip_mps/hammer_N_im", "-o", "back.csv", "--json"));
    root = ANSWER(rig, "compare", "beam.yaml", "back.csv", "--json");
    const double error = json_number_value(json_object_get(root, "nrmse"));
    print_message("read back: %.2g\n", error);
    assert_true(error >= 0.0 && error < 1e-6);
    json_decref(root);
}

static void what_cannot_be_written_is_said(void **state)
{
    static const struct {
        const char *step, *says;
    } wrong[] = {{"400", "lines"}, {"1e-9", "lines"}, {"x", "--step"}};
    struct rig *rig = *state;
    write_text(rig->dir, "beam.yaml", beam);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        const char *const arguments[] = {"frf",         "beam.yaml", "--to",  "600", "--step",
                                         wrong[i].step, "-o",        "x.uff", NULL};
        run_beamfit(rig->dir, arguments, &rig->outcome);
        assert_int_equal(rig->outcome.status, 2);
        assert_non_null(strstr(rig->outcome.err, wrong[i].says));
    }
    char nonlinear[1200];
    (void)snprintf(nonlinear, sizeof nonlinear, "%s  - {kind: cubic_stiffness, coefficient_Npm3: 1e6, at_m: 0.2}\n",
                   beam);
    write_text(rig->dir, "cubic.yaml", nonlinear);
    const char *const arguments[] = {"frf", "cubic.yaml", "-o", "x.uff", NULL};
    run_beamfit(rig->dir, arguments, &rig->outcome);
    assert_int_equal(rig->outcome.status, 2);
    assert_non_null(strstr(rig->outcome.err, "cubic_stiffness"));
    assert_false(file_exists(rig->dir, "x.uff"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_is_written_is_read_back, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(what_cannot_be_written_is_said, rig_setup, rig_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
