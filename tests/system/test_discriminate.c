/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * `beamfit discriminate` from rivals to the proposed experiment: a velocity sensor that lags or that is late, which a soft hit
 * hardly tells apart; the drive that is written does.
 */
#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

enum { SAMPLES = 1024 };
static const double noise = 0.004; /* of the signal */

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 0.5}\n"
                                 "  EI_patch_Nm2: {value: 0.8}\n"
                                 "  rho_beam_kgpm: {value: 0.093, fixed: true}\n"
                                 "  rho_patch_kgpm: {value: 0.433, fixed: true}\n"
                                 "  cDI_beam_sNm2: {value: 2e-5}\n"
                                 "  cDI_patch_sNm2: {value: 2e-5, fixed: true}\n"
                                 "  gamma_sNpm2: {value: 0.05}\n"
                                 "  Ks_V: {value: 40}\n"
                                 "  KB_NmpV: {value: 0.0175, fixed: true}\n"
                                 "inputs:\n"
                                 "  hammer_N: {kind: point_force, at_m: 0.0254}\n"
                                 "  drive_V: {kind: patch_moment}\n"
                                 "outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.44}}\n"
                                 "effects: []\n";

static const char spec_text[] = "length_m 0.4573\npatch_m 0.02535 0.08905\nEI_beam_Nm2 0.491\nEI_patch_Nm2 0.793\n"
                                "rho_beam_kgpm 0.093\nrho_patch_kgpm 0.433\ncDI_beam_sNm2 2e-5\ncDI_patch_sNm2 2e-5\n"
                                "gamma_sNpm2 0.05\nKs_V 40\nKB_NmpV 0.0175\n"
                                "input hammer_N point_force at_m=0.0254\ninput drive_V patch_moment\n"
                                "output piezo_V patch_strain\noutput tip_mps velocity at_m=0.44\nsample_rate_Hz 512\n"
                                "duration_s 2\nnoise 0.004\neffect sensor_lag channel=tip_mps tau_s=3e-4\n"
                                "signal hammer_N raised_cosine start_s=0.15 width_s=0.04 level=2\nseed 7\n";

static void run_expect(struct rig *rig, int status, const char *const arguments[])
{
    run_beamfit(rig->dir, arguments, &rig->outcome);
    if (rig->outcome.status != status)
        fail_msg("%s %s: status %d, %s", arguments[0], arguments[1], rig->outcome.status, rig->outcome.err);
}

static void make_case(struct rig *rig)
{
    write_text(rig->dir, "model.yaml", model_text);
    write_text(rig->dir, "soft.txt", spec_text);
    run_program(rig->dir, (const char *[]){"sh", "-c", "exec \"$(dirname \"$BEAMFIT\")/beam_truth\" soft.txt", NULL},
                &rig->outcome);
    if (rig->outcome.status != 0)
        fail_msg("beam_truth: %s", rig->outcome.err);
}

/* The last column of a record. */
static size_t read_last_column(const struct rig *rig, const char *name, const char *header, double x[SAMPLES])
{
    char path[256], line[512];
    size_t n = 0;
    (void)snprintf(path, sizeof path, "%s/%s", rig->dir, name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL) {
        const char *comma = strrchr(line, ',');
        if (line[0] == '#')
            continue;
        assert_non_null(comma);
        if (strncmp(line, "time_s", 6) == 0)
            assert_int_equal(strncmp(comma + 1, header, strlen(header)), 0);
        else if (n < SAMPLES)
            x[n++] = strtod(comma + 1, NULL);
    }
    fclose(file);
    return n;
}

/* What this rival says of the proposed experiment, fitted to the record so far. */
static size_t predict_rival(struct rig *rig, const char *id, double x[SAMPLES])
{
    char simulated[64];
    (void)snprintf(simulated, sizeof simulated, "%s.csv", id);
    run_expect(rig, 0, (const char *[]){"add", "model.yaml", id, "--channel", "tip_mps", "-o", "rival.yaml", NULL});
    run_expect(rig, 0, (const char *[]){"fit", "rival.yaml", "soft.csv", "-o", "fitted.yaml", "--force", NULL});
    run_expect(rig, 0, (const char *[]){"simulate", "fitted.yaml", "--input", "next.csv", "-o", simulated, NULL});
    return read_last_column(rig, simulated, "tip_mps", x);
}

static double separation(const json_t *of)
{
    return json_number_value(json_object_get(of, "separation"));
}

static void check_answer(const struct rig *rig)
{
    json_t *root = json_loads(rig->outcome.out, 0, NULL);
    assert_non_null(root);
    const json_t *experiments = json_object_get(root, "experiments"), *rivals = json_object_get(root, "rivals");
    assert_true(json_array_size(experiments) > 4);
    const json_t *first = json_array_get(experiments, 0);
    assert_string_equal(json_string_value(json_object_get(root, "best")),
                        json_string_value(json_object_get(first, "name")));
    assert_string_equal(json_string_value(json_object_get(root, "drive")), "next.csv");
    const json_t *pair = json_array_get(json_object_get(first, "pairs"), 0);
    assert_string_equal(json_string_value(json_object_get(pair, "a")), "sensor_lag@tip_mps");
    assert_string_equal(json_string_value(json_object_get(pair, "b")), "sensor_delay@tip_mps");
    /* far more than the soft hit says */
    assert_true(separation(first) > 50.0 * separation(json_array_get(json_object_get(root, "present"), 0)));
    /* the lag was looked for where it is: on the velocity sensor, not on the default patch */
    const json_t *tau = json_object_get(json_object_get(json_array_get(rivals, 0), "parameters"), "sensor_lag.tau_s");
    assert_true(fabs(json_number_value(tau) / 3e-4 - 1.0) < 0.02);
    assert_true(json_number_value(json_object_get(json_array_get(rivals, 0), "noise_ratio")) < 1.1);
    json_decref(root);
}

static void the_proposed_drive_tells_the_rivals_apart(void **state)
{
    struct rig *rig = *state;
    static double lag[SAMPLES], delay[SAMPLES];
    double difference = 0.0, size = 0.0;
    make_case(rig);
    run_expect(rig, 0,
               (const char *[]){"discriminate", "model.yaml", "sensor_lag@tip_mps", "sensor_delay@tip_mps", "soft.csv",
                                "--no-sensors", "-o", "next.csv", "--json", NULL});
    check_answer(rig);
    assert_int_equal(predict_rival(rig, "sensor_lag", lag), SAMPLES);
    assert_int_equal(predict_rival(rig, "sensor_delay", delay), SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        difference += (lag[k] - delay[k]) * (lag[k] - delay[k]);
        size += lag[k] * lag[k];
    }
    assert_true(sqrt(difference / size) > 3.0 * noise);
}

/* Without @ the lag sits on the default channel, the patch, where it explains nothing. */
static void a_channel_is_not_the_default_one(void **state)
{
    struct rig *rig = *state;
    make_case(rig);
    run_expect(rig, 0,
               (const char *[]){"discriminate", "model.yaml", "sensor_lag", "sensor_lag@tip_mps", "soft.csv",
                                "--no-sensors", "--only", "hit", "--json", NULL});
    json_t *root = json_loads(rig->outcome.out, 0, NULL);
    assert_non_null(root);
    const json_t *rivals = json_object_get(root, "rivals");
    const double of_default = json_number_value(json_object_get(json_array_get(rivals, 0), "noise_ratio"));
    const double on_tip = json_number_value(json_object_get(json_array_get(rivals, 1), "noise_ratio"));
    assert_true(of_default > 1.1 * on_tip);
    json_decref(root);
}

static void bad_input_is_said_in_words(void **state)
{
    static const struct {
        const char *arguments[8];
        int status;
        const char *words;
    } cases[] = {
        {{"discriminate", "model.yaml", "tip_mas", "root_compliance", NULL}, 2, "did you mean 'tip_mass'?"},
        {{"discriminate", "model.yaml", "tip_mass", NULL}, 2, "at least two rival effects"},
        {{"discriminate", "model.yaml", "tip_mass", "soft.csv", NULL}, 2, "at least two rival effects"},
        {{"discriminate", "model.yaml", "sensor_lag@accel_mps2", "tip_mass", NULL},
         2,
         "no such output; it has piezo_V, tip_mps"},
        {{"discriminate", "model.yaml", "drive_saturation@tip_mps", "tip_mass", NULL},
         2,
         "no such input; it has hammer_N, drive_V"},
        {{"discriminate", "model.yaml", "tip_mass@tip_mps", "sensor_lag", NULL}, 2, "not on a channel"},
        {{"discriminate", "model.yaml", "sensor_lag@", "tip_mass", NULL}, 2, "give a channel after @"},
        {{"discriminate", "model.yaml", "sensor_lag@tip_mps=model.yaml", "tip_mass", NULL},
         2,
         "has no effect sensor_lag on tip_mps"},
        {{"discriminate", "nosuch.yaml", "tip_mass", "root_compliance", NULL}, 3, "nosuch.yaml"},
        {{"discriminate", "model.yaml", "tip_mass", "root_compliance", "nosuch.csv", NULL}, 3, "nosuch.csv"},
    };
    struct rig *rig = *state;
    write_text(rig->dir, "model.yaml", model_text);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        run_expect(rig, cases[i].status, cases[i].arguments);
        if (strstr(rig->outcome.err, cases[i].words) == NULL)
            fail_msg("'%s' is not in: %s", cases[i].words, rig->outcome.err);
        assert_string_equal(rig->outcome.out, "");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(the_proposed_drive_tells_the_rivals_apart, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(a_channel_is_not_the_default_one, rig_setup, rig_teardown),
        cmocka_unit_test_setup_teardown(bad_input_is_said_in_words, rig_setup, rig_teardown),
    };
    return cmocka_run_group_tests_name("discriminate", tests, NULL, NULL);
}
