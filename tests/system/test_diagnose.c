/* SPDX-License-Identifier: GPL-3.0-or-later */
/* `beamfit diagnose` at a terminal: Ctrl-C while it searches and while it draws; a computation that is too coarse. */
#include <math.h>
#include <poll.h>
#include <pty.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>
#include "ask.h"

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 0.5}\n"
                                 "  EI_patch_Nm2: {value: 0.8}\n"
                                 "  rho_beam_kgpm: {value: 0.093, fixed: true}\n"
                                 "  rho_patch_kgpm: {value: 0.433, fixed: true}\n"
                                 "  cDI_beam_sNm2: {value: 2e-5}\n"
                                 "  cDI_patch_sNm2: {value: 2e-5}\n"
                                 "  gamma_sNpm2: {value: 0.05}\n"
                                 "  Ks_V: {value: 40}\n"
                                 "inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}\n"
                                 "outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.44}}\n"
                                 "effects: []\n";

/* Two hits of different level on a beam with a drag: laws are refitted, which takes seconds. */
static const char spec_text[] = "length_m 0.4573\npatch_m 0.02535 0.08905\nEI_beam_Nm2 0.491\nEI_patch_Nm2 0.793\n"
                                "rho_beam_kgpm 0.093\nrho_patch_kgpm 0.433\ncDI_beam_sNm2 2e-5\ncDI_patch_sNm2 2e-5\n"
                                "gamma_sNpm2 0.05\nKs_V 40\ninput hammer_N point_force at_m=0.0254\n"
                                "output piezo_V patch_strain\noutput tip_mps velocity at_m=0.44\nsample_rate_Hz 512\n"
                                "duration_s 3\nnoise 0.004\n%s\n"
                                "signal hammer_N half_sine start_s=0.15 width_s=0.008 level=%g\nseed %d\n";

static void make_case(struct rig *rig, const char *effect)
{
    char text[1200];
    write_text(rig->dir, "model.yaml", model_text);
    for (int r = 0; r < 2; r++) {
        (void)snprintf(text, sizeof text, spec_text, effect, r == 0 ? 2.0 : 20.0, 40 + r);
        write_text(rig->dir, r == 0 ? "soft.txt" : "hard.txt", text);
    }
    run_program(rig->dir,
                (const char *[]){"sh", "-c", "exec \"$(dirname \"$BEAMFIT\")/beam_truth\" soft.txt hard.txt", NULL},
                &rig->outcome);
    if (rig->outcome.status != 0)
        fail_msg("beam_truth: %s", rig->outcome.err);
}

/* What the terminal has shown so far; 0 at its end. */
static int read_terminal(int terminal, char *text, size_t size)
{
    size_t n = strlen(text);
    struct pollfd ready = {.fd = terminal, .events = POLLIN};
    if (poll(&ready, 1, 20) <= 0)
        return 1;
    const ssize_t got = read(terminal, text + n, size - 1 - n);
    if (got <= 0 || n + (size_t)got + 1 >= size)
        return 0;
    text[n + (size_t)got] = '\0';
    return 1;
}

/* Ctrl-C is typed when the terminal shows `shown`, or when the file exists; standard output goes to the file "out". */
static int run_and_type(struct rig *rig, const char *const arguments[], const char *shown, const char *file)
{
    static char text[1 << 16];
    int terminal, ended, typed = 0;
    const pid_t child = forkpty(&terminal, NULL, NULL, NULL);
    assert_true(child >= 0);
    if (child == 0) {
        if (chdir(rig->dir) != 0 || freopen("out", "w", stdout) == NULL)
            _exit(98);
        execv(getenv("BEAMFIT"), (char *const *)arguments);
        _exit(127);
    }
    text[0] = '\0';
    while (read_terminal(terminal, text, sizeof text)) {
        if (typed || !(shown ? strstr(text, shown) != NULL : file_exists(rig->dir, file)))
            continue;
        assert_int_equal(write(terminal, "\x03", 1), 1);
        typed = 1;
    }
    assert_int_equal(waitpid(child, &ended, 0), child);
    close(terminal);
    if (!typed)
        fail_msg("it ended before Ctrl-C: %s", text);
    (void)snprintf(rig->outcome.err, sizeof rig->outcome.err, "%s", text);
    struct outcome *said = malloc(sizeof *said);
    assert_non_null(said);
    run_program(rig->dir, (const char *[]){"cat", "out", NULL}, said);
    memcpy(rig->outcome.out, said->out, sizeof said->out);
    free(said);
    return WIFEXITED(ended) ? WEXITSTATUS(ended) : 128 + WTERMSIG(ended);
}

static void ctrl_c_while_searching_says_what_is_known(void **state)
{
    struct rig *rig = *state;
    make_case(rig, "effect quadratic_drag coefficient_Ns2pm3=0.02");
    const int status = run_and_type(
        rig, (const char *[]){"beamfit", "diagnose", "model.yaml", "soft.csv", "hard.csv", "--plot", "pictures", NULL},
        " s left; ", NULL);
    assert_int_equal(status, 0);
    assert_non_null(strstr(rig->outcome.out, "Verdict: unknown (interrupted)\n"));
    assert_non_null(strstr(rig->outcome.out, "Interrupted, so nothing is named. The model leaves"));
    assert_non_null(strstr(rig->outcome.out, "Where the model as it is fails:"));
    assert_non_null(strstr(rig->outcome.out, "Linearity: "));
    assert_null(strstr(rig->outcome.out, "Next: "));
    assert_non_null(strstr(rig->outcome.err, "no pictures are drawn"));
    assert_false(file_exists(rig->dir, "pictures"));
}

static void an_interrupted_answer_is_still_json(void **state)
{
    struct rig *rig = *state;
    make_case(rig, "effect quadratic_drag coefficient_Ns2pm3=0.02");
    const int status =
        run_and_type(rig, (const char *[]){"beamfit", "diagnose", "model.yaml", "soft.csv", "hard.csv", "--json", NULL},
                     "; short list", NULL);
    assert_int_equal(status, 0);
    json_t *root = json_loads(rig->outcome.out, 0, NULL);
    assert_non_null(root);
    assert_true(json_is_true(json_object_get(root, "interrupted")));
    assert_string_equal(json_string_value(json_object_get(root, "verdict")), "unknown");
    assert_int_equal(json_array_size(json_object_get(root, "effects")), 0);
    assert_true(json_number_value(json_object_get(root, "noise_ratio_before")) > 1.0);
    json_decref(root);
}

/* Every PNG ends with its IEND, every PDF with its %%EOF. */
static void assert_whole(struct rig *rig, const char *name, const char *end, size_t n)
{
    char path[256], tail[32] = {0};
    (void)snprintf(path, sizeof path, "%s/pictures/%s", rig->dir, name);
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return;
    assert_int_equal(fseek(file, -(long)n, SEEK_END), 0);
    assert_int_equal(fread(tail, 1, n, file), n);
    fclose(file);
    assert_memory_equal(tail, end, n);
}

static void ctrl_c_while_drawing_leaves_whole_pictures(void **state)
{
    struct rig *rig = *state;
    make_case(rig, "");
    const int status = run_and_type(rig,
                                    (const char *[]){"beamfit", "diagnose", "model.yaml", "soft.csv", "hard.csv",
                                                     "--effects", "1", "--plot", "pictures", NULL},
                                    NULL, "pictures/diagnose-amplitude.png");
    assert_int_equal(status, 0);
    assert_non_null(strstr(rig->outcome.out, "Verdict: complete\n"));
    assert_non_null(strstr(rig->outcome.err, "not every picture is drawn"));
    assert_true(file_exists(rig->dir, "pictures/diagnose-amplitude.png"));
    assert_whole(rig, "diagnose-amplitude.png", "IEND\xae\x42\x60\x82", 8);
    assert_whole(rig, "diagnose-amplitude.pdf", "%%EOF\n", 6);
    assert_false(file_exists(rig->dir, "pictures/diagnose-ranking.png"));
}

static void a_coarse_computation_is_said_first(void **state)
{
    struct rig *rig = *state;
    make_case(rig, "");
    run_beamfit(rig->dir,
                (const char *[]){"diagnose", "model.yaml", "soft.csv", "hard.csv", "--splines", "6", "--json", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    json_t *root = json_loads(rig->outcome.out, 0, NULL), *numerics = json_object_get(root, "numerics");
    assert_non_null(root);
    assert_string_equal(json_string_value(json_object_get(root, "verdict")), "unknown");
    assert_true(json_is_false(json_object_get(numerics, "fine")));
    assert_true(json_number_value(json_object_get(numerics, "change_over_noise")) > 0.3);
    assert_true(json_is_string(json_object_get(numerics, "channel")));
    const char *text = json_string_value(json_object_get(root, "text"));
    assert_int_equal(strncmp(text, "The computation itself is off by ", 33), 0);
    json_decref(root);
}

/*
 * A drive near a clamp that gives turns what a sensor close by sees: with the other sign the model as given is nearer to the records, and
 * explains nothing.
 */
static void a_sign_that_a_soft_clamp_makes_wrong_is_taken_back(void **state)
{
    static const char model[] = "format: beamfit-model/1\n"
                                "beam: {length_m: 0.42, patch_m: [0.0146, 0.0698]}\n"
                                "parameters:\n"
                                "  EI_beam_Nm2: {value: 5.03, fixed: true}\n"
                                "  rho_beam_kgpm: {value: 0.237, fixed: true}\n"
                                "  EI_patch_Nm2: {value: 10}\n"
                                "  rho_patch_kgpm: {value: 0.35}\n"
                                "  cDI_beam_sNm2: {value: 1.5e-5}\n"
                                "  cDI_patch_sNm2: {value: 1.5e-5}\n"
                                "  gamma_sNpm2: {value: 0.4}\n"
                                "  KB_NmpV: {value: 0.0005}\n"
                                "inputs: {drive_V: {kind: patch_moment}}\n"
                                "outputs: {laser_mps: {kind: velocity, at_m: 0.091}}\n"
                                "effects: []\n";
    static const char spec[] = "length_m 0.42\npatch_m 0.0146 0.0698\nEI_beam_Nm2 5.03\nEI_patch_Nm2 8.7\n"
                               "rho_beam_kgpm 0.237\nrho_patch_kgpm 0.396\ncDI_beam_sNm2 1.84e-5\n"
                               "cDI_patch_sNm2 3.2e-5\ngamma_sNpm2 0.29\nKB_NmpV 0.00055\n"
                               "input drive_V patch_moment\noutput laser_mps velocity at_m=0.091\n"
                               "sample_rate_Hz 800\nduration_s 2.3\nnoise 0.003\ninput_noise 0\nadc_bits 16\nseed 3\n"
                               "signal drive_V chirp start_s=0 width_s=2.1 level=60 from_Hz=8.6 to_Hz=248 taper_s=0.1\n"
                               "effect root_compliance compliance_radpNm=0.034 loss_s=5e-5\n";
    static const char others[] =
        "point_mass,tip_mass,axial_load,point_spring,point_damper,attached_resonator,viscoelastic,rotary_inertia,"
        "base_motion,mains_hum,drive_hysteresis,sensor_saturation,drive_saturation,sensor_offset,feedthrough,"
        "electrical_coupling,cubic_stiffness,microslip,stop_contact,bilinear_stiffness,large_rotation,quadratic_drag,"
        "coulomb_friction,thermal_drift,patch_softening,hysteretic_damping,square_root_damping,clock_error";
    struct rig *rig = *state;
    write_text(rig->dir, "model.yaml", model);
    write_text(rig->dir, "sweep.txt", spec);
    must(rig, "\"$(dirname \"$BEAMFIT\")/beam_truth\" sweep.txt");
    must(rig, "\"$BEAMFIT\" compare model.yaml sweep.csv | grep -q 'opposite ways'");
    json_t *root = ANSWER(rig, "diagnose", "model.yaml", "sweep.csv", "--effects", "1", "--json", "--without", others);
    const json_t *effects = json_object_get(root, "effects");
    assert_string_equal(json_string_value(json_object_get(root, "verdict")), "missing");
    assert_string_equal(json_string_value(json_array_get(effects, 0)), "root_compliance");
    assert_int_equal(json_array_size(json_object_get(root, "channel_factors")), 0);
    says(json_string_value(json_array_get(json_object_get(root, "warnings"), 0)), "they stay as they are");
    json_decref(root);
}

static double number_of(const json_t *root, const char *key)
{
    const json_t *value = json_object_get(root, key);
    if (!json_is_number(value))
        fail_msg("%s is no number", key);
    return json_number_value(value);
}

/* Runs one command as a person would type it, with the program of the tests first in the path. */
static void type_command(struct rig *rig, const char *command)
{
    char line[4096];
    (void)snprintf(line, sizeof line, "PATH=\"$(dirname \"$BEAMFIT\"):$PATH\"; export PATH; %s", command);
    run_program(rig->dir, (const char *[]){"sh", "-c", line, NULL}, &rig->outcome);
    if (rig->outcome.status != 0)
        fail_msg("%s: status %d: %s", command, rig->outcome.status, rig->outcome.err);
}

/* Each command of `next`, the fit with --json at its end: its error is the one that the diagnosis stated. */
static void the_next_commands_end_at_the_stated_error(void **state)
{
    struct rig *rig = *state;
    make_case(rig, "effect tip_mass mass_kg=0.002");
    json_t *root = answer(rig, (const char *[]){"diagnose", "model.yaml", "soft.csv", "hard.csv", "--json", NULL});
    const json_t *next = json_object_get(root, "next");
    assert_string_equal(json_string_value(json_object_get(root, "verdict")), "missing");
    assert_true(json_array_size(next) >= 2);
    for (size_t i = 0; i < 2; i++) {
        char command[2048];
        (void)snprintf(command, sizeof command, "%s%s", json_string_value(json_array_get(next, i)),
                       i == 1 ? " --json" : "");
        type_command(rig, command);
    }
    json_error_t error;
    json_t *fit = json_loads(rig->outcome.out, 0, &error);
    assert_non_null(fit);
    assert_true(number_of(fit, "noise_ratio") < 1.001 * number_of(root, "noise_ratio_after"));
    json_decref(fit), json_decref(root);
}

/* -o: the file holds the effect at the found values, and a fit from it stays there. */
static void the_found_model_is_written(void **state)
{
    struct rig *rig = *state;
    make_case(rig, "effect tip_mass mass_kg=0.002");
    json_t *root = answer(
        rig, (const char *[]){"diagnose", "model.yaml", "soft.csv", "hard.csv", "-o", "found.yaml", "--json", NULL});
    json_t *compared = answer(rig, (const char *[]){"compare", "found.yaml", "soft.csv", "hard.csv", "--json", NULL});
    assert_true(fabs(number_of(compared, "noise_ratio") / number_of(root, "noise_ratio_after") - 1.0) < 1e-3);
    json_decref(root), json_decref(compared);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(ctrl_c_while_searching_says_what_is_known, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(an_interrupted_answer_is_still_json, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(ctrl_c_while_drawing_leaves_whole_pictures, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(a_coarse_computation_is_said_first, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(a_sign_that_a_soft_clamp_makes_wrong_is_taken_back, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(the_next_commands_end_at_the_stated_error, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(the_found_model_is_written, rig_setup, rig_teardown),
    };
    return cmocka_run_group_tests_name("diagnose", tests, NULL, NULL);
}
