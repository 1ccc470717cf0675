/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Reading model files: what a good one says, and one test per way of being bad, each with line and remedy. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "comma_locale.h"
#include "model.h"
#include "test_files.h"

#define HEAD       "format: beamfit-model/1\n"                               /* line 1 */
#define BEAM       "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n" /* line 2 */
#define PARAMETERS                                                           /* lines 3 … 8 */                       \
    "parameters:\n  EI_beam_Nm2: {value: 0.495, prior: 0.03}\n  EI_patch_Nm2: 1.050\n"                                 \
    "  rho_beam_kgpm: {value: 0.0925, fixed: true}\n  rho_patch_kgpm: {value: 0.300}\n  Ks_V: {value: 60.0}\n"
#define CHANNELS /* lines 9 … 12 */                                                                                  \
    "inputs:\n  hammer_N: {kind: point_force, at_m: 0.0254}\noutputs:\n  piezo_V: {kind: patch_strain}\n"
#define GOOD HEAD BEAM PARAMETERS CHANNELS

static enum bf_status read_text(const char *text, struct model *model, struct bf_error *err)
{
    return model_read_text("m.yaml", text, strlen(text), model, err);
}

static void reads(const char *text, struct model *model)
{
    struct bf_error err = {0};
    if (read_text(text, model, &err) != BF_OK)
        fail_msg("%s\n%s", err.text, text);
}

/* Refused at `where` ("m.yaml:3: ") with the phrase and a remedy after a semicolon, and nothing left to free. */
static void refuses(const char *text, const char *where, const char *phrase)
{
    struct model model;
    struct bf_error err = {0};
    if (read_text(text, &model, &err) != BF_BAD_FILE)
        fail_msg("accepted:\n%s", text);
    if (strncmp(err.text, where, strlen(where)) != 0 || !strstr(err.text, phrase) || !strchr(err.text, ';'))
        fail_msg("wanted '%s … %s …; remedy', got '%s'", where, phrase, err.text);
    assert_null(model.regions);
    assert_null(model.document);
}

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
    assert_int_equal(n, 2);
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

/* ---- Bad files ---- */

static void not_a_model(void **state)
{
    (void)state;
    refuses("", "m.yaml: ", "empty");
    refuses("# only a comment\n", "m.yaml: ", "empty");
    refuses("\n\n", "m.yaml: ", "empty");
    refuses("time_s,hammer_N\n0,1\n", "m.yaml:1: ", "not a model");
    refuses("- a\n- b\n", "m.yaml:1: ", "not a model");
    refuses("beam: {length_m: 1}\n", "m.yaml:1: ", "format");
    refuses("format: beamfit-model/2\n", "m.yaml:1: ", "beamfit-model/1");
    refuses("format: [1]\n", "m.yaml:1: ", "beamfit-model/1");
    refuses(HEAD, "m.yaml:1: ", "beam");
    refuses(HEAD "beam: {length_m: 1}\n", "m.yaml:1: ", "parameters");
}

static void not_yaml(void **state)
{
    (void)state;
    refuses(HEAD "beam: {length_m: 1\nparameters: 3\n", "m.yaml:", "YAML");
    refuses(HEAD "beam:\n  length_m: 1\n patch_m: 3\n", "m.yaml:", "YAML");
    refuses(HEAD "beam: \"abc\n", "m.yaml:", "YAML");
    refuses(HEAD "beam:\n\tlength_m: 1\n", "m.yaml:", "YAML");
    refuses("]", "m.yaml:1", "YAML");
}

static void binary_files(void **state)
{
    (void)state;
    struct model m;
    struct bf_error err = {0};
    assert_int_equal(model_read_text("m.yaml", "a: 1\nb\0c", 8, &m, &err), BF_BAD_FILE);
    assert_contains(err.text, "m.yaml:2: not a text file");
    refuses("\x7f"
            "ELF",
            "m.yaml:1: ", "not a text file");
    refuses("format: \xff\xfe\n", "m.yaml:1: ", "not UTF-8");
    refuses(HEAD "a: \xc0\x80\n", "m.yaml:2: ", "not UTF-8");         /* overlong */
    refuses(HEAD "a: \xed\xa0\x80\n", "m.yaml:2: ", "not UTF-8");     /* surrogate */
    refuses(HEAD "a: \xf4\x90\x80\x80\n", "m.yaml:2: ", "not UTF-8"); /* beyond Unicode */
    refuses(HEAD "a: \xe2\x82", "m.yaml:2: ", "not UTF-8");           /* cut */
    refuses(HEAD "a: \x1b[31m\n", "m.yaml:2: ", "not a text file");
    refuses(HEAD "a: \"\\0\"\n", "m.yaml:2: ", "zero byte");
}

static void bombs(void **state)
{
    (void)state;
    refuses("a: &a [x, x, x]\nb: &b [*a, *a, *a]\nc: [*b, *b, *b]\n", "m.yaml:1: ", "anchors");
    refuses("a: *b\n", "m.yaml:1: ", "references");
    refuses("a: !!binary aGk=\n", "m.yaml:1: ", "tags");
    refuses("a: 1\n---\nb: 2\n", "m.yaml: ", "more than one document");
    char *deep = malloc(400001);
    memset(deep, '[', 400000);
    deep[400000] = '\0';
    refuses(deep, "m.yaml:1: ", "nested deeper");
    for (size_t i = 0; i < 400000; i += 2)
        memcpy(deep + i, "- ", 2);
    refuses(deep, "m.yaml:1: ", "nested deeper");
    for (size_t i = 0; i < 400000; i += 4)
        memcpy(deep + i, i ? "1,1," : "a: [", 4);
    deep[399999] = ']';
    refuses(deep, "m.yaml:1: ", "entries");
    free(deep);
    char *large = malloc((1 << 20) + 2);
    memset(large, ' ', (1 << 20) + 1);
    large[(1 << 20) + 1] = '\0';
    refuses(large, "m.yaml: ", "larger than");
    free(large);
}

static void unknown_keys(void **state)
{
    (void)state;
    refuses(HEAD "baem: 1\n", "m.yaml:2: ", "did you mean 'beam'");
    refuses(HEAD "beam: {lenght_m: 1}\n", "m.yaml:2: ", "did you mean 'length_m'");
    refuses(HEAD "beam: {length_m: 1}\nparameters: {EI_beam: 1}\n", "m.yaml:3: ", "did you mean 'EI_beam_Nm2'");
    refuses(HEAD "beam: {length_m: 1}\nparameters: {EI_patch_Nm2: 1}\n", "m.yaml:3: ", "per region");
    refuses(HEAD BEAM "parameters: {EI_beam_Nm2: {vlaue: 1}}\n", "m.yaml:3: ", "EI_patch_Nm2");
    refuses(HEAD "beam: {length_m: 1}\nparameters: {EI_beam_Nm2: {value: 1, priro: 2}, rho_beam_kgpm: 1}\n",
            "m.yaml:3: ", "did you mean 'prior'");
    refuses(GOOD "effects: [{kind: tip_mass, mass_g: 2}]\n", "m.yaml:13: ", "did you mean 'mass_kg'");
    refuses(GOOD "effects: [{kind: tip_mass, mass_kg: {value: 1, per_record: {}}}]\n", "m.yaml:13: ", "per_record");
}

static void keys_that_stand_twice(void **state)
{
    (void)state;
    refuses(HEAD "beam: {length_m: 1, length_m: 2}\n", "m.yaml:2: ", "twice");
    refuses(HEAD BEAM "parameters:\n  Ks_V: 1\n  EI_beam_Nm2: 1\n  'Ks_V': 1\n", "m.yaml:6: ", "twice");
    refuses(HEAD HEAD, "m.yaml:2: ", "twice");
    refuses("? [a]\n: b\n", "m.yaml:1: ", "key");
}

static void wrong_types(void **state)
{
    (void)state;
    refuses(HEAD "beam: 3\n" PARAMETERS, "m.yaml:2: ", "mapping");
    refuses(HEAD "beam: {length_m: long}\nparameters: {}\n", "m.yaml:2: ", "'long', not a number");
    refuses(HEAD "beam: {length_m: 0,5}\nparameters: {}\n", "m.yaml:2: ", "");
    refuses(HEAD "beam:\n  length_m: 0,5\nparameters: {}\n", "m.yaml:3: ", "with a point");
    refuses(HEAD "beam: {length_m: '0.5'}\nparameters: {}\n", "m.yaml:2: ", "quotes");
    refuses(HEAD "beam: {length_m: [1]}\nparameters: {}\n", "m.yaml:2: ", "list");
    refuses(HEAD "beam: {length_m: }\nparameters: {}\n", "m.yaml:2: ", "no value");
    refuses(HEAD "beam:\n  length_m:\nparameters: {}\n", "m.yaml:3: ", "no value");
    refuses(HEAD "beam: {length_m: 0x10}\nparameters: {}\n", "m.yaml:2: ", "not a number");
    refuses(HEAD "beam: {length_m: .nan}\nparameters: {}\n", "m.yaml:2: ", "not a number");
    refuses(HEAD "beam: {length_m: 1e999}\nparameters: {}\n", "m.yaml:2: ", "not a number");
    refuses(HEAD "beam: {length_m: 1, support: clamped}\nparameters: {}\n", "m.yaml:2: ", "clamped-free");
    refuses(HEAD "beam: {length_m: 1, patch_m: 0.1}\nparameters: {}\n", "m.yaml:2: ", "pair");
    refuses(HEAD "beam: {length_m: 1}\nparameters: [1]\n", "m.yaml:3: ", "mapping");
    refuses(HEAD "beam: {length_m: 1}\nparameters: {EI_beam_Nm2: {value: 1, fixed: yes}, rho_beam_kgpm: 1}\n",
            "m.yaml:3: ", "neither true nor false");
    refuses(HEAD "beam: {length_m: 1}\nparameters: {EI_beam_Nm2: {prior: 0.1}, rho_beam_kgpm: 1}\n",
            "m.yaml:3: ", "no value");
    refuses(HEAD BEAM PARAMETERS "inputs: [a]\n", "m.yaml:9: ", "mapping");
    refuses(HEAD BEAM PARAMETERS "inputs: {a: b}\n", "m.yaml:9: ", "mapping");
    refuses(GOOD "effects: {kind: tip_mass}\n", "m.yaml:13: ", "list");
    refuses(GOOD "effects: [tip_mass]\n", "m.yaml:13: ", "mapping");
    refuses(GOOD "fit: [1]\n", "m.yaml:13: ", "mapping");
    refuses(GOOD "fit: {parent_sha256: abc}\n", "m.yaml:13: ", "SHA-256");
}

static void impossible_geometry(void **state)
{
    (void)state;
    refuses(HEAD "beam: {length_m: 0}\nparameters: {}\n", "m.yaml:2: ", "above 0");
    refuses(HEAD "beam: {length_m: -1}\nparameters: {}\n", "m.yaml:2: ", "above 0");
    refuses(HEAD "beam: {length_m: .inf}\nparameters: {}\n", "m.yaml:2: ", "above 0");
    refuses(HEAD "beam: {length_m: 1, patch_m: [0.9, 1.1]}\nparameters: {}\n", "m.yaml:2: ", "outside the beam");
    refuses(HEAD "beam: {length_m: 1, patch_m: [-0.1, 0.1]}\nparameters: {}\n", "m.yaml:2: ", "outside the beam");
    refuses(HEAD "beam: {length_m: 0.4573, patch_m: [25.35, 89.05]}\nparameters: {}\n",
            "m.yaml:2: ", "[0.02535, 0.08905]");
    refuses(HEAD "beam: {length_m: 0.4573, patch_m: [2.535, 8.905]}\nparameters: {}\n",
            "m.yaml:2: ", "[0.02535, 0.08905]");
    refuses(HEAD "beam: {length_m: 1, patch_m: [0.2, 0.1]}\nparameters: {}\n", "m.yaml:2: ", "empty");
    refuses(HEAD "beam: {length_m: 1, patch_m: [0.2, 0.2]}\nparameters: {}\n", "m.yaml:2: ", "empty");
    refuses(
        HEAD
        "beam:\n  length_m: 1\n  regions:\n    - {name: a, from_m: 0, to_m: 0.5}\n    - {name: b, from_m: 0.4, to_m: "
        "1}\nparameters: {}\n",
        "m.yaml:6: ", "overlaps region 'a'");
    refuses(HEAD "beam: {length_m: 1, regions: [{name: a, from_m: 0.5, to_m: 0.5}]}\nparameters: {}\n",
            "m.yaml:2: ", "empty");
    refuses(HEAD "beam: {length_m: 1, regions: [{name: a, from_m: 0.5}]}\nparameters: {}\n", "m.yaml:2: ", "to_m");
    refuses(HEAD "beam: {length_m: 1, regions: [{name: a b, from_m: 0.5, to_m: 1}]}\nparameters: {}\n",
            "m.yaml:2: ", "letters");
    refuses(HEAD "beam: {length_m: 1, patch_m: [0.1, 0.2], regions: []}\nparameters: {}\n", "m.yaml:2: ", "together");
    refuses(HEAD BEAM PARAMETERS "inputs:\n  f: {kind: point_force, at_m: 0.5}\n", "m.yaml:10: ", "outside the beam");
    refuses(HEAD BEAM PARAMETERS "inputs:\n  f: {kind: point_force, at_m: 25.4}\n",
            "m.yaml:10: ", "0.254 m may be meant");
    refuses(HEAD BEAM PARAMETERS "outputs:\n  f: {kind: velocity, at_m: -0.1}\n", "m.yaml:10: ", "outside the beam");
}

static void impossible_parameters(void **state)
{
    (void)state;
    static const struct {
        const char *text, *phrase;
    } cases[] = {
        {"{EI_beam_Nm2: -1, rho_beam_kgpm: 1}", "EI_beam_Nm2"},
        {"{EI_beam_Nm2: 0, rho_beam_kgpm: 1}", "larger than 0"},
        {"{EI_beam_Nm2: 1, rho_beam_kgpm: -0.093}", "rho_beam_kgpm"},
        {"{EI_beam_Nm2: 1, rho_beam_kgpm: .inf}", "finite"},
        {"{EI_beam_Nm2: 1, rho_beam_kgpm: 1, gamma_sNpm2: -1}", "gamma_sNpm2"},
        {"{EI_beam_Nm2: 1, rho_beam_kgpm: 1, cDI_beam_sNm2: -1}", "cDI_beam_sNm2"},
        {"{EI_beam_Nm2: {value: 1, min: 2, max: 1}, rho_beam_kgpm: 1}", "exchange"},
        {"{EI_beam_Nm2: {value: 1, min: 2, max: 3}, rho_beam_kgpm: 1}", "outside 2 … 3"},
        {"{EI_beam_Nm2: {value: 1, prior: 0}, rho_beam_kgpm: 1}", "prior"},
        {"{EI_beam_Nm2: {value: 1, prior: -0.1}, rho_beam_kgpm: 1}", "prior"},
        {"{EI_beam_Nm2: {value: 1, prior_value: 2}, rho_beam_kgpm: 1}", "without prior"},
        {"{EI_beam_Nm2: {value: 1, sd: -1}, rho_beam_kgpm: 1}", "sd"},
        {"{EI_beam_Nm2: 1, rho_beam_kgpm: 1, gamma_sNpm2: {value: 0, prior: 0.1}}", "prior"},
        {"{EI_beam_Nm2: 1}", "rho_beam_kgpm"},
        {"{}", "EI_beam_Nm2, rho_beam_kgpm"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[256];
        (void)snprintf(text, sizeof text, HEAD "beam: {length_m: 1}\nparameters: %s\n", cases[i].text);
        refuses(text, "m.yaml:3: ", cases[i].phrase);
    }
    refuses(HEAD
            "beam: {length_m: 1, patch_m: [0, 0.1]}\nparameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1, EI_patch_Nm2: 1, "
            "rho_patch_kgpm: 1, cDI_patch_sNm2: 1}\n",
            "m.yaml:3: ", "cDI_beam_sNm2"); /* damping of some regions only */
}

static void impossible_channels(void **state)
{
    (void)state;
    refuses(HEAD "beam: {length_m: 1}\nparameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1, Ks_V: 1}\noutputs: {p: {kind: "
                 "patch_strain}}\n",
            "m.yaml:4: ", "patch_m");
    refuses(HEAD BEAM PARAMETERS "inputs:\n  u: {kind: patch_moment}\n", "m.yaml:10: ", "KB_NmpV");
    refuses(HEAD BEAM PARAMETERS "inputs:\n  u: {kind: point_force}\n", "m.yaml:10: ", "at_m");
    refuses(HEAD BEAM PARAMETERS "inputs:\n  u: {at_m: 0.1}\n", "m.yaml:10: ", "kind");
    refuses(HEAD BEAM PARAMETERS "inputs:\n  u: {kind: point_forse, at_m: 0.1}\n",
            "m.yaml:10: ", "did you mean 'point_force'");
    refuses(HEAD BEAM PARAMETERS "outputs:\n  u: {kind: accelaration, at_m: 0.1}\n",
            "m.yaml:10: ", "did you mean 'acceleration'");
    refuses(HEAD BEAM PARAMETERS "outputs:\n  u: {kind: patch_strain, at_m: 0.1}\n", "m.yaml:10: ", "unknown key");
    refuses(HEAD BEAM PARAMETERS
            "inputs:\n  u: {kind: point_force, at_m: 0.1}\noutputs:\n  u: {kind: velocity, at_m: 0.1}\n",
            "m.yaml:12: ", "input and an output");
    refuses(HEAD
            "beam: {length_m: 1, patch_m: [0, 0.1]}\nparameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1, EI_patch_Nm2: 1, "
            "rho_patch_kgpm: 1}\noutputs: {p: {kind: patch_strain}}\n",
            "m.yaml:4: ", "Ks_V");
}

static void impossible_effects(void **state)
{
    (void)state;
    refuses(GOOD "effects:\n  - {kind: tip_mas}\n", "m.yaml:14: ", "did you mean 'tip_mass'");
    refuses(GOOD "effects:\n  - {mass_kg: 1}\n", "m.yaml:14: ", "kind");
    refuses(GOOD "effects:\n  - {kind: tip_mass, mass_kg: -1}\n", "m.yaml:14: ", "outside");
    refuses(GOOD "effects:\n  - kind: tip_mass\n    mass_kg: {value: 0.1, max: 100}\n",
            "m.yaml:15: ", "physical range");
    refuses(GOOD "effects:\n  - kind: point_mass\n    at_m: 0.5\n", "m.yaml:15: ", "outside the beam");
    refuses(GOOD "effects:\n  - kind: tip_mass\n    channel: piezo_V\n", "m.yaml:15: ", "not on a channel");
    refuses(GOOD "effects:\n  - kind: mains_hum\n    channel: hammer_N\n", "m.yaml:15: ", "needs an output");
    refuses(GOOD "effects:\n  - {kind: tip_mass}\n  - {kind: tip_mass}\n", "m.yaml:15: ", "already");
    refuses(GOOD "effects:\n  - {kind: mains_hum}\n  - {kind: mains_hum, channel: piezo_V}\n",
            "m.yaml:15: ", "already");
    refuses(
        HEAD
        "beam: {length_m: 1}\nparameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1}\neffects:\n  - {kind: sensor_highpass}\n",
        "m.yaml:5: ", "patch_strain output");
}

static void files_that_cannot_be_read(void **state)
{
    (void)state;
    struct model m;
    struct bf_error err = {0};
    assert_int_equal(model_read("/nowhere/at/all.yaml", &m, &err), BF_BAD_FILE);
    assert_contains(err.text, "/nowhere/at/all.yaml: ");
    assert_contains(err.text, ";");
    assert_int_equal(model_read("/tmp", &m, &err), BF_BAD_FILE);
    assert_contains(err.text, "directory");
    assert_null(m.path);
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
        cmocka_unit_test(not_a_model),
        cmocka_unit_test(not_yaml),
        cmocka_unit_test(binary_files),
        cmocka_unit_test(bombs),
        cmocka_unit_test(unknown_keys),
        cmocka_unit_test(keys_that_stand_twice),
        cmocka_unit_test(wrong_types),
        cmocka_unit_test(impossible_geometry),
        cmocka_unit_test(impossible_parameters),
        cmocka_unit_test(impossible_channels),
        cmocka_unit_test(impossible_effects),
        cmocka_unit_test(files_that_cannot_be_read),
    };
    return cmocka_run_group_tests_name("model_yaml", tests, NULL, NULL);
}
