/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Saving model files. Properties, over many layouts of the same model: what is written reads back as exactly the model in
 * memory, and every line that states nothing changed stays byte for byte, comments included.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "saved_model.h"
#include "add_effect.h"

/* The same model in other layouts. */
static const char braces[] =
    "{format: beamfit-model/1, beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}, parameters: {EI_beam_Nm2: "
    "{value: "
    "0.495, prior: 0.03}, EI_patch_Nm2: {value: 1.05, max: 1e6}, rho_beam_kgpm: 0.0925, rho_patch_kgpm: {value: 0.3, "
    "sd: "
    "0.1}, cDI_beam_sNm2: 0.8e-5, cDI_patch_sNm2: 0.8e-5, Ks_V: 60}, inputs: {hammer_N: {kind: point_force, at_m: "
    "0.0254}}, outputs: {piezo_V: {kind: patch_strain}}, effects: [{kind: quadratic_drag, coefficient_Ns2pm3: {value: "
    "0.02}}, {kind: tip_mass, mass_kg: 0.002}, {kind: mains_hum, frequency_Hz: 50}]}";

static const char indented[] = "  format: beamfit-model/1\n"
                               "  effects:\n"
                               "  - kind: quadratic_drag\n"
                               "    coefficient_Ns2pm3:\n"
                               "      value: 0.02\n"
                               "  - kind: tip_mass\n"
                               "    mass_kg: 0.002\n"
                               "  - kind: mains_hum\n"
                               "    frequency_Hz: 50\n"
                               "  beam:\n"
                               "      length_m: 0.4573\n"
                               "      patch_m:\n"
                               "      - 0.02535\n"
                               "      - 0.08905\n"
                               "  outputs: {\"piezo_V\": {'kind': patch_strain}}\n"
                               "  inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}\n"
                               "  parameters:\n"
                               "   EI_beam_Nm2:\n"
                               "    value: 0.495\n"
                               "    prior: 0.03\n"
                               "   EI_patch_Nm2: {max: 1e6, value: 1.05}\n"
                               "   \"rho_beam_kgpm\": 0.0925\n"
                               "   rho_patch_kgpm: {sd: 0.1, value: 0.3}\n"
                               "   cDI_beam_sNm2: 0.8e-5\n"
                               "   cDI_patch_sNm2: 0.8e-5\n"
                               "   Ks_V: 60"; /* no newline */

static char *with_crlf(const char *text)
{
    char *out = malloc(2 * strlen(text) + 1), *to = out;
    for (; *text; text++) {
        if (*text == '\n')
            *to++ = '\r';
        *to++ = *text;
    }
    *to = '\0';
    return out;
}

static void save_and_compare(struct model *model)
{
    struct model back;
    free(save(model, &back));
    same_model(model, &back);
    model_free(&back);
}

static double noise(unsigned *seed)
{
    *seed = *seed * 1664525U + 1013904223U;
    return (double)(*seed >> 8) / 16777216.0;
}

static void set_all(struct model *m, unsigned *seed, bool with_sd)
{
    static const char *const records[] = {"train 1.csv", "b.csv"};
    struct parameter_ref *refs;
    size_t n = model_parameters(m, records, 2, &refs);
    double *value = calloc(n, sizeof *value), *sd = calloc(n, sizeof *sd);
    for (size_t i = 0; i < n; i++) {
        bool frequency = strcmp(refs[i].info->name, "frequency_Hz") == 0;
        value[i] = refs[i].value * (frequency ? 1.01 : 0.8 + 0.4 * noise(seed));
        sd[i] = with_sd ? 0.01 * fabs(value[i]) : 0.0;
    }
    model_set_parameters(m, refs, n, value, sd, records);
    free(refs);
    free(value);
    free(sd);
}

static void every_layout_reads_back(void **state)
{
    (void)state;
    char *crlf = with_crlf(pretty);
    const char *const layouts[] = {pretty, braces, indented, crlf};
    unsigned seed = 1;
    for (size_t i = 0; i < sizeof layouts / sizeof *layouts; i++) {
        struct model m;
        struct bf_error err = {0};
        reads(layouts[i], &m);
        for (int round = 0; round < 20; round++) {
            set_all(&m, &seed, round % 3 != 0);
            if (round == 5)
                add_fit_block(&m);
            m.Ks.fixed = round % 2 == 1;
            m.materials[0].EI.max = round % 4 == 1 ? 100.0 : (double)INFINITY;
            if (round == 8)
                assert_int_equal(add_effect(&m, "root_compliance", "", &err), BF_OK);
            if (round == 10)
                assert_int_equal(model_drop_effect(&m, "tip_mass", &err), BF_OK);
            if (round == 12)
                assert_int_equal(model_drop_effect(&m, "quadratic_drag", &err), BF_OK);
            if (round == 14) {
                assert_int_equal(model_drop_effect(&m, "root_compliance", &err), BF_OK);
                assert_int_equal(model_drop_effect(&m, "mains_hum", &err), BF_OK);
            }
            if (round == 16)
                assert_int_equal(add_effect(&m, "mains_hum", "piezo_V", &err), BF_OK);
            save_and_compare(&m);
            assert_memory_equal(m.document, layouts[i], 10); /* edited, not written anew */
        }
        model_free(&m);
    }
    free(crlf);
}

/* Lines of `old` that are in `new`, in order. */
static void keeps_lines(const char *old, const char *new, const char *const changed[], size_t n_changed)
{
    const char *place = new;
    for (const char *line = old; *line;) {
        size_t n = strcspn(line, "\n");
        n += line[n] != '\0';
        char text[256];
        (void)snprintf(text, sizeof text, "%.*s", (int)n, line);
        bool skip_line = false;
        for (size_t i = 0; i < n_changed; i++)
            skip_line = skip_line || strstr(text, changed[i]);
        const char *found = strstr(place, text);
        if (!skip_line && !found)
            fail_msg("lost '%s' from:\n%s", text, new);
        place = skip_line ? place : found + n;
        line += n;
    }
}

static void an_unchanged_model_keeps_every_line(void **state)
{
    (void)state;
    struct model m, back;
    reads(pretty, &m);
    char *text = save(&m, &back);
    keeps_lines(pretty, text, NULL, 0);
    assert_non_null(strstr(text, "\nfit:\n  parent_sha256: \"")); /* descends from the text that was read */
    free(text);
    model_free(&m);
    model_free(&back);
}

static void a_fit_changes_values_only(void **state)
{
    (void)state;
    struct model m, back;
    unsigned seed = 7;
    reads(pretty, &m);
    set_all(&m, &seed, true);
    char *text = save(&m, &back);
    static const char *const changed[] = {"value:", "rho_beam_kgpm", "mass_kg", "mains_hum", "min: 0"};
    keeps_lines(pretty, text, changed, 5);
    static const char *const comments[] = {"# book",   "# guess", "# not known well", "# first",
                                           "# second", "# air",   "# scale"};
    for (size_t i = 0; i < sizeof comments / sizeof *comments; i++)
        assert_contains(text, comments[i]);
    assert_contains(text, "prior_value: 0.495");
    assert_contains(text, "    max: 1e6   # bound\n    start: 1.05\n    sd: "); /* new lines go below the comment */
    free(text);
    model_free(&m);
    model_free(&back);
}

static void add_and_drop_restore_the_text(void **state)
{
    (void)state;
    char *crlf = with_crlf(pretty);
    const char *const layouts[] = {pretty, indented, crlf};
    for (size_t i = 0; i < 3; i++) {
        struct model m, with, without;
        struct bf_error err = {0};
        reads(layouts[i], &m);
        assert_int_equal(add_effect(&m, "root_compliance", "", &err), BF_OK);
        free(save(&m, &with));
        assert_int_equal(with.n_effects, 4);
        assert_int_equal(model_drop_effect(&with, "root_compliance", &err), BF_OK);
        char *text = save(&with, &without);
        static const char *const stale[] = {"sd: 0.1"}; /* errors of the last fit are gone */
        keeps_lines(layouts[i], text, stale, 1);
        assert_null(strstr(text, "root_compliance"));
        free(text);
        model_free(&m);
        model_free(&with);
        model_free(&without);
    }
    free(crlf);
}

static void the_last_effect_leaves_an_empty_list_and_returns(void **state)
{
    (void)state;
    static const char head[] =
        "format: beamfit-model/1\nbeam: {length_m: 1}\nparameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1}\n";
    static const char *const lists[] = {"",
                                        "effects: []\n",
                                        "effects:\n",
                                        "effects: [ ] # none\n",
                                        "effects: ~\n",
                                        "effects:\n- {kind: tip_mass}\n",
                                        "effects: [{kind: tip_mass}]\n",
                                        "effects:\n  - kind: tip_mass\n    # heavy\n    mass_kg: 0.1\nnotes: x\n"};
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
        char text[512];
        struct model m, back;
        struct bf_error err = {0};
        (void)snprintf(text, sizeof text, "%s%s", head, lists[i]);
        reads(text, &m);
        if (m.n_effects > 0)
            assert_int_equal(model_drop_effect(&m, "tip_mass", &err), BF_OK);
        char *empty = save(&m, &back);
        assert_int_equal(back.n_effects, 0);
        assert_null(strstr(empty, "tip_mass"));
        assert_int_equal(add_effect(&back, "tip_mass", "", &err), BF_OK);
        assert_int_equal(add_effect(&back, "quadratic_drag", "", &err), BF_OK);
        model_free(&m);
        char *full = save(&back, &m);
        same_model(&back, &m);
        assert_int_equal(m.n_effects, 2);
        free(empty);
        free(full);
        model_free(&m);
        model_free(&back);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_layout_reads_back),
        cmocka_unit_test(an_unchanged_model_keeps_every_line),
        cmocka_unit_test(a_fit_changes_values_only),
        cmocka_unit_test(add_and_drop_restore_the_text),
        cmocka_unit_test(the_last_effect_leaves_an_empty_list_and_returns),
    };
    return cmocka_run_group_tests_name("model_yaml_edit", tests, NULL, NULL);
}
