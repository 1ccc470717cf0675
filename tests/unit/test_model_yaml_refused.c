/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Reading model files: one test per way of being bad, each with line and remedy. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model_text.h"
#include "test_files.h"

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
    refuses(HEAD "a: 'it''''s'\n", "m.yaml:2: ", "in double quotes"); /* which libfyaml 0.7.12 would misread */
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
    refuses(GOOD "effects: [{kind: tip_mass, mass_kg: {value: 1, per_recrod: {}}}]\n",
            "m.yaml:13: ", "did you mean 'per_record'");
    refuses(
        HEAD BEAM
        "parameters: {EI_beam_Nm2: {value: 1, per_record: {}}, EI_patch_Nm2: 1, rho_beam_kgpm: 1, rho_patch_kgpm: 1}\n",
        "m.yaml:3: ", "per_record");
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
            "m.yaml:2: ", "89.05 mm are 0.08905 m");
    refuses(HEAD "beam: {length_m: 0.4573, patch_m: [2.535, 8.905]}\nparameters: {}\n",
            "m.yaml:2: ", "8.905 cm 0.08905 m");
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
            "m.yaml:10: ", "25.4 mm are 0.0254 m, 25.4 cm 0.254 m");
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
    refuses(GOOD "effects:\n  - kind: tip_mass\n    mass_kg: {value: 0.1, max: 1e4}\n",
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
        cmocka_unit_test(not_a_model),           cmocka_unit_test(not_yaml),
        cmocka_unit_test(binary_files),          cmocka_unit_test(bombs),
        cmocka_unit_test(unknown_keys),          cmocka_unit_test(keys_that_stand_twice),
        cmocka_unit_test(wrong_types),           cmocka_unit_test(impossible_geometry),
        cmocka_unit_test(impossible_parameters), cmocka_unit_test(impossible_channels),
        cmocka_unit_test(impossible_effects),    cmocka_unit_test(files_that_cannot_be_read),
    };
    return cmocka_run_group_tests_name("model_yaml_refused", tests, NULL, NULL);
}
