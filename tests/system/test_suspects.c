/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Ordinary causes come before physics: a silent input, a gain, a sign, a frequency, another place, on records of the independent simulator. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "ask.h"

static const char start[] = "init --length 0.4573 --width 0.0203 --thickness 0.0016 --patch 0.02535 0.08905 --input "
                            "hammer_N=point_force@0.0254 --output piezo_V=patch_strain --output tip_mps=velocity@0.44";

/* The tutorial's taps without the hidden mass; held-out taps that differ in one ordinary thing; a model that was fitted. */
static int setup(void **state)
{
    char script[1500];
    if (rig_setup(state) != 0)
        return -1;
    (void)snprintf(
        script, sizeof script,
        "set -e; truth() { sed \"$2\" \"$TOP\"/data/tutorial/tap3.txt | sed '/^effect/d' >$1.txt; "
        "\"$(dirname \"$BEAMFIT\")\"/beam_truth $1.txt >/dev/null; }\n"
        "truth same s/seed.*/seed\\ 41/; truth fitted s/level=8/level=5/; truth place s/at_m=0.0254/at_m=0.3/\n"
        "truth level s/Ks_V.*/Ks_V\\ 61/; truth sign s/Ks_V.*/Ks_V\\ -41/; truth longer s/length_m.*/length_m\\ 0.47/\n"
        "truth moved 's/^output.*/&\\noutput tip_mps velocity at_m=0.35/; s/duration_s.*/duration_s 1/'\n"
        "awk -F, -v OFS=, '/^[0-9]/ {$2 = 0} {print}' same.csv >silent.csv\n"
        "\"$BEAMFIT\" %s -o model.yaml --force\n"
        "\"$BEAMFIT\" fit model.yaml fitted.csv -o fitted.yaml",
        start);
    must(*state, script);
    return 0;
}

static const struct {
    const char *record, *words;
} cases[] = {
    {"place.csv", "was hit, driven or measured at another place than the model says"},
    {"level.csv", "Measured is 1.49 times predicted"},
    {"sign.csv", "the sensor or an input is the other way round"},
    {"longer.csv", "Hz in the record and at "},
    {"silent.csv", "Every input is zero throughout"},
};
enum { CASES = sizeof cases / sizeof *cases };

/* However the lines are broken. */
static void assert_says(const struct rig *rig, const char *text, const char *words)
{
    static char line[PROGRAM_TEXT];
    size_t n = 0;
    for (bool blank = false; *text != '\0'; text++) {
        const bool space = *text == ' ' || *text == '\n';
        if (!space || !blank)
            line[n++] = space ? ' ' : *text;
        blank = space;
    }
    line[n] = '\0';
    if (strstr(line, words) == NULL)
        fail_msg("'%s' is not in:\n%s%s", words, rig->outcome.out, rig->outcome.err);
}

static void fit_says_why_a_held_out_record_disagrees(void **state)
{
    struct rig *rig = *state;
    for (size_t i = 0; i < CASES; i++) {
        run_beamfit(
            rig->dir,
            (const char *[]){"fit", "fitted.yaml", "fitted.csv", "--check", cases[i].record, "-o", "out.yaml", NULL},
            &rig->outcome);
        assert_int_equal(rig->outcome.status, 0);
        assert_says(rig, rig->outcome.out, "is predicted far worse than the fitted records");
        assert_says(rig, rig->outcome.out, cases[i].words);
    }
}

static void fit_says_nothing_of_a_record_that_agrees(void **state)
{
    struct rig *rig = *state;
    run_beamfit(rig->dir,
                (const char *[]){"fit", "fitted.yaml", "fitted.csv", "--check", "same.csv", "-o", "out.yaml", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    assert_null(strstr(rig->outcome.out, "far worse"));
}

static void diagnose_says_it_too(void **state)
{
    struct rig *rig = *state;
    json_error_t error;
    run_beamfit(rig->dir,
                (const char *[]){"diagnose", "fitted.yaml", "fitted.csv", "--check", "sign.csv", "--json", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    assert_says(rig, rig->outcome.err, "warning: sign.csv piezo_V is predicted far worse");
    json_t *root = json_loads(rig->outcome.out, JSON_REJECT_DUPLICATES, &error);
    assert_non_null(root);
    assert_int_equal(json_array_size(json_object_get(root, "notes")), 1);
    json_decref(root);
}

/* compare: the sentence is there, in place of a path or a delay that would follow from the cause. */
static void compare_suspects_the_ordinary_first(void **state)
{
    struct rig *rig = *state;
    for (size_t i = 0; i < CASES; i++) {
        run_program(rig->dir,
                    (const char *[]){"sh", "-c",
                                     "COLUMNS=120 \"$BEAMFIT\" compare fitted.yaml --check \"$1\" | tr -s ' \\n' ' '",
                                     "sh", cases[i].record, NULL},
                    &rig->outcome);
        assert_int_equal(rig->outcome.status, 0);
        assert_says(rig, rig->outcome.out, cases[i].words);
        assert_null(strstr(rig->outcome.out, "direct path"));
        assert_null(strstr(rig->outcome.out, "It follows"));
    }
}

/* A model from ruler and handbook before any fit: its frequency is off, nothing else is worth a word. */
static void an_unfitted_model(void **state)
{
    struct rig *rig = *state;
    run_program(rig->dir,
                (const char *[]){"sh", "-c", "\"$BEAMFIT\" compare model.yaml fitted.csv | tr -s ' \\n' ' '", NULL},
                &rig->outcome);
    assert_says(rig, rig->outcome.out, "fit the model first");
    assert_null(strstr(rig->outcome.out, "direct path"));
}

static struct rig *shared;

static int share(void **state)
{
    const int status = setup(state);
    shared = *state;
    return status;
}

static int use(void **state)
{
    *state = shared;
    return 0;
}

#define CASE(f) cmocka_unit_test_setup(f, use)

/* No effect takes what a sensor at another place leaves, so that the place is asked for after them; then nothing is missing. */
static void diagnose_finds_a_sensor_at_another_place(void **state)
{
    struct rig *rig = *state;
    json_error_t error;
    run_beamfit(rig->dir,
                (const char *[]){"diagnose", "model.yaml", "moved.csv", "--effects", "1", "--json", "--without",
                                 "base_motion,clock_error,electrical_coupling,feedthrough,hysteretic_damping,"
                                 "input_position,mains_hum,patch_position,point_damper,point_mass,point_spring,"
                                 "root_compliance,rotary_inertia,sensor_delay,sensor_highpass,sensor_lag,sensor_offset,"
                                 "square_root_damping,viscoelastic,attached_resonator,thermal_drift,stop_contact,"
                                 "cubic_stiffness,quadratic_drag,coulomb_friction,microslip,bilinear_stiffness,"
                                 "large_rotation,patch_softening,drive_hysteresis,drive_saturation,sensor_saturation",
                                 NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    json_t *root = json_loads(rig->outcome.out, JSON_REJECT_DUPLICATES, &error);
    assert_non_null(root);
    assert_string_equal(json_string_value(json_object_get(root, "verdict")), "complete");
    const json_t *factors = json_object_get(root, "channel_factors"), *first = json_array_get(factors, 0);
    assert_int_equal(json_array_size(factors), 1);
    assert_string_equal(json_string_value(json_object_get(first, "kind")), "place");
    assert_non_null(strstr(json_string_value(json_object_get(first, "text")), "tip_mps was at 0.35 m"));
    json_decref(root);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(fit_says_why_a_held_out_record_disagrees),
        CASE(fit_says_nothing_of_a_record_that_agrees),
        CASE(diagnose_says_it_too),
        CASE(diagnose_finds_a_sensor_at_another_place),
        CASE(compare_suspects_the_ordinary_first),
        CASE(an_unfitted_model),
    };
    return cmocka_run_group_tests_name("ordinary causes", tests, share, rig_teardown);
}
