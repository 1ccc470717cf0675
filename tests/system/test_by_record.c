/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A mass that was changed between two records of the independent simulator: what `diagnose` says of it, and that its commands do what they say. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <jansson.h>
#include <math.h>
#include "ask.h"

static const struct {
    const char *record;
    double mass_kg;
} changed[] = {{"light.csv", 0.006}, {"heavy.csv", 0.015}};
enum { RECORDS = sizeof changed / sizeof *changed };

/* The tutorial's beam, the same tap, two masses at its tip. */
static int setup(void **state)
{
    if (rig_setup(state) != 0)
        return -1;
    must(*state,
         "set -e; truth() { sed \"s/seed.*/seed $2/; s/duration_s.*/duration_s 1/; s/^effect.*/effect tip_mass "
         "mass_kg=$3/\" "
         "\"$TOP\"/data/tutorial/tap3.txt >$1.txt; \"$(dirname \"$BEAMFIT\")\"/beam_truth $1.txt >/dev/null; }\n"
         "truth light 41 0.006; truth heavy 42 0.015; truth same 43 0.006\n"
         "\"$BEAMFIT\" init --length 0.4573 --width 0.0203 --thickness 0.0016 --patch 0.02535 0.08905 --input "
         "hammer_N=point_force@0.0254 --output piezo_V=patch_strain -o model.yaml --force");
    return 0;
}

static double number(const json_t *object, const char *name)
{
    return json_number_value(json_object_get(object, name));
}

static json_t *diagnosis(struct rig *rig, const char *second)
{
    return answer(
        rig, (const char *[]){
                 "diagnose", "model.yaml", "light.csv", second, "--effects", "1", "--json", "--without",
                 "axial_load,point_spring,base_motion,clock_error,electrical_coupling,feedthrough,hysteretic_damping,"
                 "input_position,mains_hum,patch_position,point_damper,attached_resonator,"
                 "rotary_inertia,sensor_delay,sensor_highpass,sensor_lag,sensor_offset,"
                 "square_root_damping,viscoelastic,thermal_drift,stop_contact,cubic_stiffness,"
                 "quadratic_drag,coulomb_friction,microslip,bilinear_stiffness,large_rotation,"
                 "patch_softening,drive_hysteresis,drive_saturation,sensor_saturation",
                 NULL});
}

/* Typed as they are printed. */
static void run_next(struct rig *rig, const json_t *root, size_t n)
{
    const json_t *next = json_object_get(root, "next");
    assert_true(json_array_size(next) >= n);
    for (size_t i = 0; i < n; i++) {
        char line[1200];
        const char *command = json_string_value(json_array_get(next, i));
        assert_int_equal(strncmp(command, "beamfit ", 8), 0);
        (void)snprintf(line, sizeof line, "\"$BEAMFIT\" %s", command + 8);
        must(rig, line);
    }
}

static void what_was_changed_is_found_in_each_record(void **state)
{
    struct rig *rig = *state;
    json_t *root = diagnosis(rig, "heavy.csv");
    assert_string_equal(json_string_value(json_object_get(root, "verdict")), "unknown");
    const json_t *attainable = json_object_get(root, "attainable");
    assert_true(number(attainable, "each_noise_ratio") < 1.1 && number(attainable, "noise_ratio") > 20.0);
    assert_non_null(strstr(json_string_value(json_object_get(attainable, "text")), "not of one linear beam"));
    const json_t *first = json_array_get(json_object_get(root, "by_record"), 0);
    assert_string_equal(json_string_value(json_object_get(first, "effect")), "tip_mass");
    assert_string_equal(json_string_value(json_object_get(first, "parameter")), "mass_kg");
    assert_true(number(first, "noise_ratio_after") < 1.1 && number(first, "explained") > 0.99);
    for (size_t r = 0; r < RECORDS; r++)
        assert_true(fabs(number(json_object_get(first, "values"), changed[r].record) / changed[r].mass_kg - 1.0) < 0.1);
    assert_non_null(strstr(json_string_value(json_object_get(root, "text")), "tip_mass whose mass_kg is"));
    run_next(rig, root, 2);
    json_decref(root);
    root = answer(rig, (const char *[]){"compare", "with_tip_mass.yaml", "light.csv", "heavy.csv", "--json", NULL});
    assert_true(number(root, "noise_ratio") < 1.1);
    json_decref(root);
}

static void nothing_is_said_of_records_of_one_beam(void **state)
{
    struct rig *rig = *state;
    json_t *root = diagnosis(rig, "same.csv");
    assert_int_equal(json_array_size(json_object_get(root, "by_record")), 0);
    assert_true(json_is_null(json_object_get(json_object_get(root, "attainable"), "each_noise_ratio")));
    assert_null(strstr(rig->outcome.out, "not of one linear beam"));
    json_decref(root);
}

static void add_takes_values_of_records(void **state)
{
    struct rig *rig = *state;
    static const struct {
        const char *value;
        int status;
        const char *words;
    } cases[] = {
        {"mass_kg@light.csv=0.006", 0, "free in the next fit"},
        {"mass_kg@=0.006", 2, "names no record"},
        {"mass_kg@light.csv=heavy", 2, "not a number"},
        {"mas_kg@light.csv=1", 2, "did you mean 'mass_kg'?"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        run_beamfit(
            rig->dir,
            (const char *[]){"add", "model.yaml", "tip_mass", cases[i].value, "-o", "own.yaml", "--force", NULL},
            &rig->outcome);
        if (rig->outcome.status != cases[i].status ||
            (strstr(rig->outcome.out, cases[i].words) == NULL && strstr(rig->outcome.err, cases[i].words) == NULL))
            fail_msg("%s: %d\n%s%s", cases[i].value, rig->outcome.status, rig->outcome.out, rig->outcome.err);
    }
    must(rig, "grep -q 'per_record: {light.csv: {value: 0.006}}' own.yaml");
    ran(rig, 0,
        (const char *[]){"add", "model.yaml", "tip_mass", "mass_kg@a=b.csv=0.002", "--fix", "mass_kg", "-o", "own.yaml",
                         "--force", NULL});
    must(rig, "grep -q 'fixed: true, per_record: {\"a=b.csv\": {value: 0.002}}' own.yaml");
    ran(rig, 0,
        (const char *[]){"add", "model.yaml", "tip_mass", "--per-record", "mass_kg", "-o", "own.yaml", "--force",
                         NULL});
    must(rig, "grep -q 'per_record: {}' own.yaml");
    ran(rig, 2, (const char *[]){"add", "model.yaml", "tip_mass", "--per-record", "mass", "-o", "own.yaml", NULL});
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_changed_is_found_in_each_record),
        cmocka_unit_test(nothing_is_said_of_records_of_one_beam),
        cmocka_unit_test(add_takes_values_of_records),
    };
    return cmocka_run_group_tests_name("by record", tests, setup, rig_teardown);
}
