/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Bad models, one test per pathology; see refuse_everywhere() in rig.h. Wrong units are only warned of. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

static void unknown_key_of_a_parameter(void **state)
{
    rig_model_with(*state, 6, "  EI_beam_Nm2: {vlaue: 0.491}");
    refuse_everywhere(*state, "model.yaml:6", "vlaue");
}

static void unknown_key_of_the_beam(void **state)
{
    rig_model_with(*state, 3, "  length_mm: 457.3");
    refuse_everywhere(*state, "model.yaml:3", "length_mm");
}

static void unknown_parameter(void **state)
{
    rig_model_with(*state, 6, "  EI_baem_Nm2: {value: 0.491}");
    refuse_everywhere(*state, "model.yaml:6", "EI_baem_Nm2");
}

static void unknown_kind(void **state)
{
    rig_model_with(*state, 17, "  piezo_V: {kind: patch_stain}");
    refuse_everywhere(*state, "model.yaml:17", "patch_stain");
}

static void patch_outside_the_beam(void **state)
{
    rig_model_with(*state, 4, "  patch_m: [0.42535, 0.48905]");
    refuse_everywhere(*state, "model.yaml:4", "");
}

static void patch_ends_before_it_begins(void **state)
{
    rig_model_with(*state, 4, "  patch_m: [0.08905, 0.02535]");
    refuse_everywhere(*state, "model.yaml:4", "");
}

static void input_outside_the_beam(void **state)
{
    rig_model_with(*state, 15, "  hammer_N: {kind: point_force, at_m: 0.5}");
    refuse_everywhere(*state, "model.yaml:15", "");
}

static void negative_density(void **state)
{
    rig_model_with(*state, 8, "  rho_beam_kgpm: {value: -0.093}");
    refuse_everywhere(*state, "model.yaml:8", "rho_beam_kgpm");
}

static void negative_length(void **state)
{
    rig_model_with(*state, 3, "  length_m: -0.4573");
    refuse_everywhere(*state, "model.yaml:3", "length");
}

static void text_for_a_number(void **state)
{
    rig_model_with(*state, 7, "  EI_patch_Nm2: {value: about one}");
    refuse_everywhere(*state, "model.yaml:7", "about one");
}

static void not_yaml(void **state)
{
    rig_model_with(*state, 7, "  EI_patch_Nm2: {value: [}");
    refuse_everywhere(*state, "model.yaml:7", "");
}

static void empty_model(void **state)
{
    write_text(((struct rig *)*state)->dir, "model.yaml", "");
    refuse_everywhere(*state, "model.yaml", "empty");
}

static void binary_model(void **state)
{
    unsigned char bytes[4096];
    for (size_t i = 0; i < sizeof bytes; i++)
        bytes[i] = (unsigned char)(i * 167 + 5);
    write_file(((struct rig *)*state)->dir, "model.yaml", bytes, sizeof bytes);
    refuse_everywhere(*state, "model.yaml:1", "");
}

static void record_for_a_model(void **state)
{
    struct rig *rig = *state;
    char text[RIG_RECORD_TEXT];
    rig_make_record(text, "time_s,hammer_N,piezo_V", RIG_SAMPLES, -1, "", 1.0);
    write_text(rig->dir, "model.yaml", text);
    refuse_everywhere(rig, "model.yaml", "");
}

/* ---- Wrong units by 1000: a warning, not a refusal ---- */

static void assert_warned(struct rig *rig, const char *const arguments[], const char *word)
{
    run_beamfit(rig->dir, arguments, &rig->outcome);
    const char *warning = strstr(rig->outcome.err, "beamfit: warning: ");
    if (rig->outcome.status != 0 || warning == NULL || strstr(warning, word) == NULL)
        fail_msg("wanted status 0 and a warning with '%s', got status %d and '%s'", word, rig->outcome.status,
                 rig->outcome.err);
}

static void beam_in_millimetres(void **state)
{
    struct rig *rig = *state;
    write_text(rig->dir, "model.yaml",
               "format: beamfit-model/1\n"
               "beam: {length_m: 457.3, patch_m: [25.35, 89.05]}\n"
               "parameters: {EI_beam_Nm2: {value: 0.491}, EI_patch_Nm2: {value: 0.793},\n"
               "  rho_beam_kgpm: {value: 0.093}, rho_patch_kgpm: {value: 0.433}, Ks_V: {value: 60}}\n"
               "outputs: {piezo_V: {kind: patch_strain}}\n");
    assert_warned(rig, (const char *[]){"modes", "model.yaml", NULL}, "length_m");
}

static void stiffness_in_newton_millimetres(void **state)
{
    rig_model_with(*state, 6, "  EI_beam_Nm2: {value: 491000}");
    assert_warned(*state, (const char *[]){"modes", "model.yaml", NULL}, "EI_beam_Nm2");
}

static void density_in_grams(void **state)
{
    rig_model_with(*state, 8, "  rho_beam_kgpm: {value: 93}");
    assert_warned(*state, (const char *[]){"modes", "model.yaml", NULL}, "rho_beam_kgpm");
}

static void time_in_milliseconds(void **state)
{
    struct rig *rig = *state;
    char text[RIG_RECORD_TEXT];
    rig_make_record(text, "time_s,hammer_N,piezo_V", RIG_SAMPLES, -1, "", 1000.0);
    write_text(rig->dir, "record.csv", text);
    assert_warned(rig, (const char *[]){"compare", "model.yaml", "record.csv", NULL}, "time_s");
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(unknown_key_of_a_parameter),
        CASE(unknown_key_of_the_beam),
        CASE(unknown_parameter),
        CASE(unknown_kind),
        CASE(patch_outside_the_beam),
        CASE(patch_ends_before_it_begins),
        CASE(input_outside_the_beam),
        CASE(negative_density),
        CASE(negative_length),
        CASE(text_for_a_number),
        CASE(not_yaml),
        CASE(empty_model),
        CASE(binary_model),
        CASE(record_for_a_model),
        CASE(beam_in_millimetres),
        CASE(stiffness_in_newton_millimetres),
        CASE(density_in_grams),
        CASE(time_in_milliseconds),
    };
    return cmocka_run_group_tests_name("bad model", tests, NULL, NULL);
}
