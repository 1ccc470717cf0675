/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The commands that make models from models: init, add, drop, effects, history. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "ask.h"

static void add_writes_to_standard_output_and_keeps_comments(void **state)
{
    struct rig *rig = *state;
    rig_model_with(rig, 6, "  EI_beam_Nm2: {value: 0.491, prior: 0.03}   # from the book");
    const char *text = RAN(rig, 0, "add", "model.yaml", "point_mass", "--at", "0.4", "mass_kg=0.5e-3", "-o", "-");
    says(text, "prior: 0.03}   # from the book\n");
    says(text, "effects:\n  - {kind: point_mass, mass_kg: {value: 0.0005}, at_m: 0.4}\n");
    says(text, "parent_sha256: \"");
}

static void add_holds_and_frees(void **state)
{
    struct rig *rig = *state;
    json_t *root = ANSWER(rig, "add", "model.yaml", "point_mass", "--at", "0.4", "--free", "at_m", "--fix", "mass_kg",
                          "-o", "new.yaml", "--json");
    json_t *parameters = json_object_get(root, "parameters");
    assert_string_equal(json_string_value(json_object_get(root, "effect")), "point_mass");
    assert_true(json_is_false(json_object_get(json_object_get(parameters, "at_m"), "fixed")));
    assert_true(json_is_true(json_object_get(json_object_get(parameters, "mass_kg"), "fixed")));
    json_decref(root);
    says(RAN(rig, 0, "drop", "new.yaml", "point_mass", "-o", "-"), "effects: []");
}

static void what_add_refuses(void **state)
{
    struct rig *rig = *state;
    RAN(rig, 0, "add", "model.yaml", "tip_mass", "-o", "tip.yaml");
    int files = count_files(rig->dir);
    says(RAN(rig, 2, "add", "tip.yaml", "tip_mass", "-o", "new.yaml"), "already");
    says(RAN(rig, 2, "add", "model.yaml", "tip_mas", "-o", "new.yaml"), "did you mean 'tip_mass'");
    says(RAN(rig, 2, "add", "model.yaml", "tip_mass", "mass=1", "-o", "new.yaml"), "mass_kg");
    says(RAN(rig, 2, "add", "model.yaml", "tip_mass", "mass_kg=heavy", "-o", "new.yaml"), "heavy");
    says(RAN(rig, 2, "add", "model.yaml", "tip_mass", "mass_kg=-1", "-o", "new.yaml"), "outside");
    says(RAN(rig, 2, "add", "model.yaml", "point_mass", "--at", "40", "-o", "new.yaml"), "metres");
    says(RAN(rig, 2, "add", "model.yaml", "mains_hum", "--channel", "nothing", "-o", "new.yaml"), "nothing");
    says(RAN(rig, 2, "add", "model.yaml", "tip_mass"), "-o");
    says(RAN(rig, 2, "drop", "model.yaml", "tip_mass", "-o", "new.yaml"), "no effect 'tip_mass'");
    says(RAN(rig, 3, "add", "nowhere.yaml", "tip_mass", "-o", "new.yaml"), "nowhere.yaml");
    assert_int_equal(count_files(rig->dir), files);
}

static void init_never_overwrites_unasked(void **state)
{
    struct rig *rig = *state;
    says(RAN(rig, 2, "init", "-o", "model.yaml"), "--force");
    assert_true(file_is(rig->dir, "model.yaml", rig_model));
    RAN(rig, 0, "init", "--force", "-o", "model.yaml");
    assert_false(file_is(rig->dir, "model.yaml", rig_model));
}

/* Eqs. 30 and 31 with the paper's dimensions. */
static void init_knows_the_handbook(void **state)
{
    struct rig *rig = *state;
    json_t *root =
        ANSWER(rig, "init", "--length", "0.4573", "--width", "0.0203", "--thickness", "0.0016", "--E", "73e9",
               "--patch", "0.02535", "0.08905", "--patch-thickness", "0.000254", "-o", "new.yaml", "--json");
    json_t *parameters = json_object_get(root, "parameters");
    double beam = json_real_value(json_object_get(parameters, "EI_beam_Nm2"));
    double patch = json_real_value(json_object_get(parameters, "EI_patch_Nm2"));
    assert_true(beam > 0.5057 && beam < 0.5059 && patch > 1.067 && patch < 1.069);
    json_decref(root);
    says(RAN(rig, 2, "init", "--length", "0.4573", "--patch", "25", "89"), "metres");
    says(RAN(rig, 2, "init", "--material", "steal"), "did you mean 'steel'");
    says(RAN(rig, 2, "init", "--thickness", "-1"), "above 0");
    says(RAN(rig, 2, "init", "--input", "f=point_force"), "place");
}

/* Sum of an output of `simulate` and of its squares: two numbers that no other response shares. */
static void respond(struct rig *rig, const char *model, double sums[2])
{
    RAN(rig, 0, "simulate", model, "--input", "drive.csv", "-o", "out.csv", "--digits", "12", "--force");
    run_program(rig->dir,
                (const char *[]){"awk", "-F,", "/^[0-9]/ {s += $3; q += $3 * $3} END {printf \"%.12g %.12g\", s, q}",
                                 "out.csv", NULL},
                &rig->outcome);
    char *rest;
    sums[0] = strtod(rig->outcome.out, &rest);
    sums[1] = strtod(rest, NULL);
}

/* A simulated record says which filter it went through; one that does not say gets a usual one, and a model that bends a warning. */
static void a_filter_is_stated_or_said_to_be_assumed(void **state)
{
    struct rig *rig = *state;
    char drive[4096] = "time_s,drive_V\n";
    for (int k = 0; k < 128; k++)
        (void)snprintf(drive + strlen(drive), sizeof drive - strlen(drive), "%.9g,%d\n", k / 2048.0, k == 5 || k == 6);
    write_text(rig->dir, "drive.csv", drive);
    RAN(rig, 0, "init", "--length", "0.3", "--patch", "0.02", "0.06", "--input", "drive_V=patch_moment", "--output",
        "tip_m=displacement@0.3", "-o", "plain.yaml", "--force");
    RAN(rig, 0, "add", "plain.yaml", "drive_saturation", "level_V=0.5", "-o", "bent.yaml", "--force");
    RAN(rig, 0, "simulate", "bent.yaml", "--input", "drive.csv", "-o", "out.csv", "--force");
    run_program(rig->dir, (const char *[]){"grep", "-c", "^# anti-alias filter: none$", "out.csv", NULL},
                &rig->outcome);
    assert_string_equal(rig->outcome.out, "1\n");
    RAN(rig, 0, "compare", "bent.yaml", "out.csv");
    assert_null(strstr(rig->outcome.err, "anti-alias"));
    run_program(rig->dir, (const char *[]){"sed", "-i", "/^# anti-alias/d", "out.csv", NULL}, &rig->outcome);
    RAN(rig, 0, "compare", "bent.yaml", "out.csv");
    says(rig->outcome.err, "states no anti-alias filter of the recorder");
    RAN(rig, 0, "compare", "plain.yaml", "out.csv");
    assert_null(strstr(rig->outcome.err, "anti-alias"));
}

#define TWO_PATCHES                                                                                                    \
    "init", "--length", "0.3", "--support", "clamped-clamped", "--patch", "0.02", "0.06", "--patch", "0.2", "0.26"

/* What one patch does to the other, the other does to the one (Maxwell, Betti); what a patch does to itself is another matter. */
static void two_patches_are_reciprocal(void **state)
{
    struct rig *rig = *state;
    double there[2], back[2], itself[2];
    char drive[4096] = "time_s,drive_V\n";
    for (int k = 0; k < 128; k++)
        (void)snprintf(drive + strlen(drive), sizeof drive - strlen(drive), "%.9g,%d\n", k / 2048.0, k == 5 || k == 6);
    write_text(rig->dir, "drive.csv", drive);
    RAN(rig, 0, TWO_PATCHES, "--input", "drive_V=patch_moment", "--output", "piezo_V=patch_strain@0.23", "-o",
        "a.yaml");
    RAN(rig, 0, TWO_PATCHES, "--input", "drive_V=patch_moment@0.23", "--output", "piezo_V=patch_strain", "-o",
        "b.yaml");
    RAN(rig, 0, TWO_PATCHES, "--input", "drive_V=patch_moment@0.03", "--output", "piezo_V=patch_strain", "-o",
        "c.yaml");
    respond(rig, "a.yaml", there);
    respond(rig, "b.yaml", back);
    respond(rig, "c.yaml", itself);
    assert_true(there[1] > 0.0 && fabs(there[1] / back[1] - 1.0) < 1e-6 &&
                fabs(there[0] - back[0]) < 1e-6 * sqrt(there[1]));
    assert_true(fabs(itself[1] / there[1] - 1.0) > 0.1);
}

static void patches_that_cannot_be(void **state)
{
    struct rig *rig = *state;
    says(RAN(rig, 2, TWO_PATCHES, "--patch", "0.05", "0.1", "-o", "x.yaml"), "overlaps");
    says(RAN(rig, 2, TWO_PATCHES, "--output", "piezo_V=patch_strain@0.1", "-o", "x.yaml"), "there is none");
    says(RAN(rig, 2, "init", "--output", "piezo_V=patch_strain", "-o", "x.yaml"), "give --patch FROM TO");
    says(RAN(rig, 2, "init", "--output", "tip_mps=velocity", "-o", "x.yaml"), "needs a place");
    assert_int_equal(file_exists(rig->dir, "x.yaml"), 0);
}

static void effects_are_explained(void **state)
{
    struct rig *rig = *state;
    says(RAN(rig, 0, "effects"), "\n  tip_mass ");
    says(RAN(rig, 0, "effects", "root_compliance"), "Confused with");
    json_t *one = ANSWER(rig, "effects", "root_compliance", "--json");
    assert_string_equal(json_string_value(json_object_get(one, "family")), "structure");
    json_decref(one);
}

/* A chain, given in the wrong order and with a link missing. */
static void history_finds_the_order(void **state)
{
    struct rig *rig = *state;
    RAN(rig, 0, "add", "model.yaml", "tip_mass", "-o", "a.yaml");
    RAN(rig, 0, "add", "a.yaml", "quadratic_drag", "-o", "b.yaml");
    RAN(rig, 0, "drop", "b.yaml", "tip_mass", "-o", "c.yaml");
    json_t *root = ANSWER(rig, "history", "c.yaml", "model.yaml", "a.yaml", "--json");
    const json_t *models = json_object_get(root, "models");
    static const char *const order[] = {"model.yaml", "a.yaml", "c.yaml"};
    assert_int_equal(json_array_size(models), 3);
    for (size_t i = 0; i < 3; i++)
        assert_string_equal(json_string_value(json_object_get(json_array_get(models, i), "file")), order[i]);
    const json_t *last = json_array_get(models, 2);
    assert_string_equal(json_string_value(json_object_get(last, "parent")), "a.yaml"); /* b.yaml is not given */
    assert_string_equal(json_string_value(json_array_get(json_object_get(last, "gained"), 0)), "quadratic_drag");
    assert_string_equal(json_string_value(json_array_get(json_object_get(last, "lost"), 0)), "tip_mass");
    assert_true(json_is_null(json_object_get(last, "nrmse")) && json_is_false(json_object_get(last, "fitted")));
    json_decref(root);
    says(RAN(rig, 2, "history", "model.yaml", "--plot", "pictures"), "none of the models was fitted");
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(add_writes_to_standard_output_and_keeps_comments),
        CASE(add_holds_and_frees),
        CASE(what_add_refuses),
        CASE(init_never_overwrites_unasked),
        CASE(init_knows_the_handbook),
        CASE(a_filter_is_stated_or_said_to_be_assumed),
        CASE(two_patches_are_reciprocal),
        CASE(patches_that_cannot_be),
        CASE(effects_are_explained),
        CASE(history_finds_the_order),
    };
    return cmocka_run_group_tests_name("models", tests, NULL, NULL);
}
