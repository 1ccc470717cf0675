/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Reading model files: what a good one says. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "comma_locale.h"
#include "model_text.h"
#include "test_files.h"

static void the_example_of_the_format(void **state)
{
    (void)state;
    struct model m;
    reads(HEAD "beam:\n  length_m: 0.4573\n  support: clamped-free # c\n  patch_m: [0.02535, 0.08905]\n"
               "parameters:\n"
               "  EI_beam_Nm2:    {value: 0.495, prior: 0.03}\n  EI_patch_Nm2: {value: 1.050}\n"
               "  rho_beam_kgpm:  {value: 0.0925, fixed: true}\n  rho_patch_kgpm: {value: 0.300}\n"
               "  cDI_beam_sNm2: 0.8e-5\n  cDI_patch_sNm2: {value: 0.8e-5, min: 0, max: 1}\n"
               "  gamma_sNpm2:    {value: 0.00183}\n  Ks_V: {value: -60.0}\n  KB_NmpV: {value: 0.010}\n"
               "inputs:\n  hammer_N: {kind: point_force, at_m: 0.0254}\n  drive_V:  {kind: patch_moment}\n"
               "outputs:\n  piezo_V: {kind: patch_strain}\n  accel_mps2: {kind: acceleration, at_m: 0.0214}\n"
               "  tip_mps: {kind: velocity, at_m: 0.44}\n  tip_m: {kind: displacement, at_m: 0.44}\n"
               "effects:\n  - {kind: quadratic_drag, coefficient_Ns2pm3: {value: 0.02}}\n",
          &m);
    assert_int_equal(m.n_regions, 3);
    assert_string_equal(m.regions[0].name, "beam");
    assert_string_equal(m.regions[1].name, "patch");
    assert_string_equal(m.regions[2].name, "beam");
    assert_true(m.regions[1].from_m == 0.02535 && m.regions[1].to_m == 0.08905 && m.regions[2].to_m == 0.4573);
    assert_int_equal(m.n_materials, 2);
    const struct material *beam = model_material(&m, "beam"), *patch = model_material(&m, "patch");
    assert_true(beam->EI.value == 0.495 && beam->EI.prior == 0.03 && beam->EI.prior_value == 0.495);
    assert_true(beam->EI.logarithmic && !beam->EI.fixed && beam->rho.fixed);
    assert_true(patch->EI.value == 1.05 && patch->cDI.value == 0.8e-5 && patch->cDI.max == 1.0);
    assert_true(beam->cDI.value == 0.8e-5 && beam->cDI.logarithmic);
    assert_true(m.Ks.value == -60.0 && !m.Ks.logarithmic && isinf(m.Ks.min));
    assert_true(m.KB.value == 0.01 && m.KB.logarithmic);
    assert_int_equal(m.n_inputs, 2);
    assert_true(m.inputs[1].kind == INPUT_PATCH_MOMENT && m.inputs[1].from_m == 0.02535);
    assert_int_equal(m.n_outputs, 4);
    assert_true(m.outputs[0].kind == OUTPUT_PATCH_STRAIN && m.outputs[0].to_m == 0.08905);
    assert_true(m.outputs[3].kind == OUTPUT_DISPLACEMENT && m.outputs[3].at_m == 0.44);
    assert_int_equal(m.n_effects, 1);
    assert_string_equal(m.effects[0].effect->id, "quadratic_drag");
    assert_true(m.effects[0].parameters[0].value == 0.02 && !m.effects[0].parameters[0].fixed);
    assert_false(m.fit.present);
    model_free(&m);
}

/* Every ```yaml block of the page is a model. */
static void the_manual_s_examples_read(void **state)
{
    (void)state;
    const char *top = getenv("TOP");
    char path[512], *text = calloc(1, 1 << 16);
    (void)snprintf(path, sizeof path, "%s/docs/model_file.md", top ? top : ".");
    FILE *f = fopen(path, "rb");
    if (!f)
        fail_msg("%s cannot be read; run from the project's root", path);
    assert_true(fread(text, 1, (1 << 16) - 1, f) > 1000);
    (void)fclose(f);
    int n = 0;
    for (char *block = strstr(text, "```yaml\n"); block; block = strstr(block, "```yaml\n"), n++) {
        struct model m;
        char *end = strstr(block += strlen("```yaml\n"), "```");
        assert_non_null(end);
        *end = '\0';
        reads(block, &m);
        model_free(&m);
        block = end + 1;
    }
    assert_int_equal(n, 3);
    free(text);
}

static void the_open_cases_read(void **state)
{
    (void)state;
    static const char *const cases[] = {"o0_clean",          "o1_tip_mass",        "o2_root_compliance",
                                        "o3_quadratic_drag", "o4_sensor_highpass", "o5_coulomb_friction",
                                        "o6_stop_contact",   "o7_viscoelastic"};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char name[128];
        struct model m;
        struct bf_error err = {0};
        (void)snprintf(name, sizeof name, "data/open/%s/model.yaml", cases[i]);
        char *path = shared_file(name);
        if (!path)
            skip();
        assert_int_equal(model_read(path, &m, &err), BF_OK);
        assert_int_equal(m.n_outputs, 3);
        model_free(&m);
        free(path);
    }
}

static void absent_damping_and_gains_are_fixed_at_zero(void **state)
{
    (void)state;
    struct model m;
    reads(GOOD, &m);
    assert_true(m.gamma.value == 0.0 && m.gamma.fixed && m.KB.value == 0.0 && m.KB.fixed);
    assert_true(m.materials[0].cDI.value == 0.0 && m.materials[0].cDI.fixed);
    assert_true(!m.Ks.fixed);
    model_free(&m);
}

static void regions_in_any_order_with_gaps(void **state)
{
    (void)state;
    struct model m;
    reads(HEAD "beam:\n  length_m: 1\n  support: pinned-pinned\n  regions:\n"
               "    - {name: tip, from_m: 0.9, to_m: 1}\n    - {name: patch, from_m: 0.1, to_m: 0.2}\n"
               "    - {name: patch, from_m: 0.5, to_m: 0.6}\n"
               "parameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1, EI_patch_Nm2: 2, rho_patch_kgpm: 2,\n"
               "  EI_tip_Nm2: 3, rho_tip_kgpm: 3, Ks_V: 1}\n"
               "outputs: {p: {kind: patch_strain}, q: {kind: patch_strain, patch_m: [0.5, 0.6]}}\n",
          &m);
    static const double edges[] = {0.0, 0.1, 0.2, 0.5, 0.6, 0.9, 1.0};
    static const char *const names[] = {"beam", "patch", "beam", "patch", "beam", "tip"};
    assert_int_equal(m.n_regions, 6);
    for (size_t i = 0; i < 6; i++) {
        assert_string_equal(m.regions[i].name, names[i]);
        assert_true(m.regions[i].from_m == edges[i] && m.regions[i].to_m == edges[i + 1]);
    }
    assert_int_equal(m.n_materials, 3);
    assert_int_equal(m.support, SUPPORT_PINNED_PINNED);
    assert_true(m.outputs[0].from_m == 0.1 && m.outputs[0].to_m == 0.2 && m.outputs[1].from_m == 0.5);
    model_free(&m);
}

static void a_patch_at_the_clamp_and_a_whole_patch(void **state)
{
    (void)state;
    struct model m;
    reads(HEAD
          "beam: {length_m: 1, patch_m: [0, 0.2]}\nparameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1, EI_patch_Nm2: 2, "
          "rho_patch_kgpm: 2}\n",
          &m);
    assert_int_equal(m.n_regions, 2);
    assert_string_equal(m.materials[0].name, "patch");
    model_free(&m);
    reads(HEAD "beam: {length_m: 1, patch_m: [0, 1]}\nparameters: {EI_patch_Nm2: 2, rho_patch_kgpm: 2}\n", &m);
    assert_int_equal(m.n_regions, 1);
    model_free(&m);
}

static void numbers_whatever_the_locale(void **state)
{
    (void)state;
    if (!comma_locale())
        skip();
    struct model m;
    reads(HEAD "beam: {length_m: 1.5}\nparameters: {EI_beam_Nm2: 1.050, rho_beam_kgpm: +.5, cDI_beam_sNm2: 0.8e-5, "
               "gamma_sNpm2: {value: 1E-3, max: .inf}}\n",
          &m);
    assert_true(m.length_m == 1.5 && m.materials[0].EI.value == 1.05 && m.materials[0].rho.value == 0.5);
    assert_true(m.materials[0].cDI.value == 0.8e-5 && m.gamma.value == 1e-3 && isinf(m.gamma.max));
    model_free(&m);
    (void)setlocale(LC_ALL, "C");
}

static void effects_in_every_form(void **state)
{
    (void)state;
    struct model m;
    reads(GOOD "effects:\n"
               "  - {kind: tip_mass, mass_kg: 0.002}\n"
               "  - kind: point_mass\n    mass_kg: {value: 0.001, prior: 0.5, prior_value: 0.002}\n    at_m: 0.3\n"
               "  - {kind: point_mass, at_m: {value: 0.2, fixed: false, sd: 0.001}}\n"
               "  - {kind: mains_hum, channel: piezo_V, frequency_Hz: {value: 50, fixed: true},\n"
               "     phase_rad: {value: 0, per_record: {train1.csv: {value: 0.3, sd: 0.01}, 'b 2.csv': -1}}}\n"
               "  - {kind: sensor_highpass}\n",
          &m);
    assert_int_equal(m.n_effects, 5);
    assert_true(m.effects[0].parameters[0].value == 0.002 && !m.effects[0].parameters[0].fixed);
    assert_true(m.effects[1].parameters[0].prior_value == 0.002);
    assert_true(m.effects[1].parameters[1].value == 0.3 && m.effects[1].parameters[1].fixed);
    assert_true(!m.effects[2].parameters[1].fixed && m.effects[2].parameters[1].sd == 0.001);
    assert_true(m.effects[2].parameters[0].value == m.effects[2].effect->parameters[0].start);
    assert_true(m.effects[2].parameters[1].max == 0.4573);
    assert_string_equal(m.effects[3].channel, "piezo_V");
    assert_int_equal(m.effects[3].n_per_record, 2);
    assert_string_equal(m.effects[3].per_record[1].record, "b 2.csv");
    assert_true(m.effects[3].per_record[0].value == 0.3 && m.effects[3].per_record[0].sd == 0.01);
    assert_true(m.effects[3].per_record[1].value == -1.0);
    model_free(&m);
}

static void own_keys_byte_order_mark_and_crlf_are_welcome(void **state)
{
    (void)state;
    struct model m;
    reads("\xEF\xBB\xBF" HEAD BEAM PARAMETERS "x_operator: Ewa\nnotes: |\n  glued in May\n" CHANNELS
          "x-a: {b: [1, {c: 2}]}\n",
          &m);
    model_free(&m);
    reads("format: beamfit-model/1\r\nbeam: {length_m: 1}\r\nparameters:\r\n  EI_beam_Nm2: 1\r\n  rho_beam_kgpm: 1\r\n",
          &m);
    model_free(&m);
    refuses(
        "format: beamfit-model/1\r\nbeam: {length_m: 1}\r\nparameters:\r\n  EI_beam_Nm2: 1\r\n  rho_baem_kgpm: 1\r\n",
        "m.yaml:5: ", "rho_beam_kgpm");
}

static void level_per_record_of_an_input(void **state)
{
    (void)state;
    struct model m;
    reads(HEAD "beam: {length_m: 1}\nparameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1}\n"
               "inputs: {f: {kind: point_force, at_m: 0.5, level: per_record}}\n",
          &m);
    assert_true(m.inputs[0].level_per_record);
    model_free(&m);
    refuses(HEAD "beam: {length_m: 1}\nparameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1}\n"
                 "inputs: {f: {kind: point_force, at_m: 0.5, level: unknown}}\n",
            "m.yaml:4: ", "per_record");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_example_of_the_format),
        cmocka_unit_test(the_manual_s_examples_read),
        cmocka_unit_test(the_open_cases_read),
        cmocka_unit_test(absent_damping_and_gains_are_fixed_at_zero),
        cmocka_unit_test(regions_in_any_order_with_gaps),
        cmocka_unit_test(a_patch_at_the_clamp_and_a_whole_patch),
        cmocka_unit_test(numbers_whatever_the_locale),
        cmocka_unit_test(effects_in_every_form),
        cmocka_unit_test(own_keys_byte_order_mark_and_crlf_are_welcome),
        cmocka_unit_test(level_per_record_of_an_input),
    };
    return cmocka_run_group_tests_name("model_yaml", tests, NULL, NULL);
}
