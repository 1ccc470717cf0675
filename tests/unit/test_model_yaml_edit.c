/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Saving model files. Properties, over many layouts of the same model: what is written reads back as exactly the model in
 * memory, and every line that states nothing changed stays byte for byte, comments included.
 */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "hash.h"
#include "model.h"
#include "test_files.h"

static const char pretty[] = "# a rig\n"
                             "format: beamfit-model/1\n"
                             "beam:\n"
                             "  length_m: 0.4573   # ruler\n"
                             "  patch_m: [0.02535, 0.08905]\n"
                             "parameters:   # all of them\n"
                             "  EI_beam_Nm2:   {value: 0.495, prior: 0.03}  # book\n"
                             "  EI_patch_Nm2:\n"
                             "    value: 1.050 # guess\n"
                             "    # not known well\n"
                             "    max: 1e6   # bound\n"
                             "  rho_beam_kgpm: 0.0925\n"
                             "  rho_patch_kgpm: {value: 0.300, sd: 0.1}\n"
                             "  # damping\n"
                             "  cDI_beam_sNm2: {value: 0.8e-5, }\n"
                             "  cDI_patch_sNm2: {\n"
                             "    value: 0.8e-5, # first\n"
                             "    min: 0 }       # second\n"
                             "  Ks_V: {value: 60.0}\n"
                             "x_operator: Ewa  # who\n"
                             "inputs:\n"
                             "  hammer_N: {kind: point_force, at_m: 0.0254}\n"
                             "outputs:\n"
                             "  piezo_V: {kind: patch_strain}\n"
                             "effects:\n"
                             "  - {kind: quadratic_drag, coefficient_Ns2pm3: {value: 0.02}}  # air\n"
                             "  # the tip\n"
                             "  - kind: tip_mass\n"
                             "    mass_kg: 0.002  # scale\n"
                             "  - {kind: mains_hum, frequency_Hz: 50}\n"
                             "# the end\n";

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

static void reads(const char *text, struct model *model)
{
    struct bf_error err = {0};
    if (model_read_text("m.yaml", text, strlen(text), model, &err) != BF_OK)
        fail_msg("%s\n%s", err.text, text);
}

/* Saves, reads back, and returns the new text; caller frees. */
static char *save(struct model *model, struct model *back)
{
    struct bf_error err = {0};
    char *path = temporary_file("saved.yaml", "", 0);
    if (model_write(path, model, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_int_equal(model_read(path, back, &err), BF_OK);
    assert_string_equal(back->sha256, model->sha256);
    FILE *f = fopen(path, "rb");
    char *text = calloc(1, 1 << 16);
    assert_true(fread(text, 1, (1 << 16) - 1, f) > 0);
    (void)fclose(f);
    unlink(path);
    free(path);
    return text;
}

static void same_parameter(const struct parameter *a, const struct parameter *b)
{
    assert_string_equal(a->name, b->name);
    assert_true(!(a->value < b->value) && !(a->value > b->value)); /* every bit, −0 aside */
    assert_true(a->prior == b->prior && a->prior_value == b->prior_value);
    assert_true(a->min == b->min && a->max == b->max);
    assert_true(a->fixed == b->fixed && a->logarithmic == b->logarithmic);
    assert_true(fabs(a->sd - b->sd) <= 1e-5 * a->sd); /* written with 6 digits */
}

static void same_model(const struct model *a, const struct model *b)
{
    assert_int_equal(a->n_materials, b->n_materials);
    for (size_t i = 0; i < a->n_materials; i++) {
        same_parameter(&a->materials[i].EI, &b->materials[i].EI);
        same_parameter(&a->materials[i].rho, &b->materials[i].rho);
        same_parameter(&a->materials[i].cDI, &b->materials[i].cDI);
    }
    same_parameter(&a->gamma, &b->gamma);
    same_parameter(&a->Ks, &b->Ks);
    same_parameter(&a->KB, &b->KB);
    assert_int_equal(a->n_effects, b->n_effects);
    for (size_t i = 0; i < a->n_effects; i++) {
        const struct model_effect *p = &a->effects[i], *q = &b->effects[i];
        assert_ptr_equal(p->effect, q->effect);
        assert_string_equal(p->channel, q->channel);
        for (int j = 0; j < p->effect->n_parameters; j++)
            same_parameter(&p->parameters[j], &q->parameters[j]);
        assert_int_equal(p->n_per_record, q->n_per_record);
        for (size_t k = 0; k < p->n_per_record; k++) {
            assert_string_equal(p->per_record[k].record, q->per_record[k].record);
            assert_true(p->per_record[k].value == q->per_record[k].value);
        }
    }
    assert_int_equal(a->n_inputs, b->n_inputs);
    assert_int_equal(a->n_outputs, b->n_outputs);
    assert_int_equal(a->n_regions, b->n_regions);
    assert_int_equal(a->fit.present, b->fit.present);
    assert_int_equal(a->fit.n_records, b->fit.n_records);
    assert_string_equal(a->fit.parent_sha256, b->fit.parent_sha256);
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

static void add_fit_block(struct model *m)
{
    struct fit_info *fit = &m->fit;
    fit->present = fit->converged = true;
    fit->nrmse = 0.00412345678;
    fit->noise_ratio = 1.01;
    fit->check_nrmse = 0.005;
    fit->n_records = 2;
    fit->records = calloc(2, sizeof *fit->records);
    for (size_t i = 0; i < 2; i++) {
        struct fit_record *record = &fit->records[i];
        record->file = strdup(i ? "dir with blank/it's: #2.csv" : "train1.csv");
        hash_sha256_hex("x", i, record->sha256);
        record->held_out = i == 1;
        record->n_channels = 1;
        record->channels = calloc(1, sizeof *record->channels);
        record->channels[0] = (struct fit_channel){.name = "piezo_V", .nrmse = 0.1, .noise_ratio = 1.5};
    }
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
                assert_int_equal(model_add_effect(&m, "root_compliance", "", &err), BF_OK);
            if (round == 10)
                assert_int_equal(model_drop_effect(&m, "tip_mass", &err), BF_OK);
            if (round == 12)
                assert_int_equal(model_drop_effect(&m, "quadratic_drag", &err), BF_OK);
            if (round == 14) {
                assert_int_equal(model_drop_effect(&m, "root_compliance", &err), BF_OK);
                assert_int_equal(model_drop_effect(&m, "mains_hum", &err), BF_OK);
            }
            if (round == 16)
                assert_int_equal(model_add_effect(&m, "mains_hum", "piezo_V", &err), BF_OK);
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
    assert_contains(text, "    max: 1e6   # bound\n    sd: "); /* a new line goes below the comment */
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
        assert_int_equal(model_add_effect(&m, "root_compliance", "", &err), BF_OK);
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
        assert_int_equal(model_add_effect(&back, "tip_mass", "", &err), BF_OK);
        assert_int_equal(model_add_effect(&back, "quadratic_drag", "", &err), BF_OK);
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

static void prior_centre_survives_two_fits(void **state)
{
    (void)state;
    struct model m, first, second;
    reads(pretty, &m);
    m.materials[0].EI.value = 0.47;
    free(save(&m, &first));
    assert_true(first.materials[0].EI.prior_value == 0.495);
    first.materials[0].EI.value = 0.46;
    char *text = save(&first, &second);
    assert_true(second.materials[0].EI.prior_value == 0.495 && second.materials[0].EI.value == 0.46);
    free(text);
    second.materials[0].EI.value = 0.495; /* back at the centre: the key goes */
    model_free(&first);
    text = save(&second, &first);
    assert_null(strstr(text, "prior_value"));
    free(text);
    model_free(&m);
    model_free(&first);
    model_free(&second);
}

static void a_place_once_freed_stays_free(void **state)
{
    (void)state;
    static const char bare[] =
        "format: beamfit-model/1\nbeam: {length_m: 1}\nparameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 1}\n"
        "effects: [{kind: point_mass, mass_kg: 0.1, at_m: 0.3}]\n";
    struct model m, back;
    struct bf_error err = {0};
    reads(pretty, &m);
    assert_int_equal(model_add_effect(&m, "point_mass", "", &err), BF_OK);
    free(save(&m, &back));
    assert_true(back.effects[3].parameters[1].fixed);
    back.effects[3].parameters[1].fixed = false;
    back.effects[3].parameters[0].fixed = true;
    model_free(&m);
    free(save(&back, &m));
    assert_true(!m.effects[3].parameters[1].fixed && m.effects[3].parameters[0].fixed);
    m.effects[3].parameters[1].fixed = true;
    model_free(&back);
    free(save(&m, &back));
    assert_true(back.effects[3].parameters[1].fixed);
    model_free(&m);
    model_free(&back);
    reads(bare, &m);
    m.effects[0].parameters[1].fixed = false;
    free(save(&m, &back));
    assert_true(!back.effects[0].parameters[1].fixed);
    model_free(&m);
    model_free(&back);
}

static void descent_is_recorded(void **state)
{
    (void)state;
    struct model a, b, c, d;
    struct bf_error err = {0};
    reads(pretty, &a);
    char grandparent[65];
    memcpy(grandparent, a.sha256, 65);
    a.Ks.value = 61.0;
    free(save(&a, &b));
    assert_string_equal(b.fit.parent_sha256, grandparent);
    assert_int_equal(model_add_effect(&b, "root_compliance", "", &err), BF_OK);
    free(save(&b, &c));
    assert_string_equal(c.fit.parent_sha256, a.sha256);
    assert_int_equal(c.fit.n_ancestors, 1);
    assert_string_equal(c.fit.ancestors[0], grandparent);
    assert_false(c.fit.present);
    add_fit_block(&c);
    free(save(&c, &d));
    assert_true(d.fit.present && d.fit.converged && d.fit.records[1].held_out);
    assert_string_equal(d.fit.records[1].file, "dir with blank/it's: #2.csv");
    assert_true(fabs(d.fit.nrmse - 0.00412345678) < 1e-8);
    assert_int_equal(d.fit.n_ancestors, 2);
    model_free(&a);
    model_free(&b);
    model_free(&c);
    model_free(&d);
}

static void a_model_made_in_memory_is_written_whole(void **state)
{
    (void)state;
    struct model m, back;
    reads(pretty, &m);
    free(m.document);
    m.document = NULL;
    m.sha256[0] = '\0';
    m.inputs[0].level_per_record = true;
    m.support = SUPPORT_PINNED_PINNED;
    char *text = save(&m, &back);
    same_model(&m, &back);
    assert_true(back.inputs[0].level_per_record);
    assert_int_equal(back.support, SUPPORT_PINNED_PINNED);
    assert_true(back.outputs[0].from_m == m.outputs[0].from_m);
    free(text);
    model_free(&m);
    model_free(&back);
}

static void changed_geometry_is_not_lost(void **state)
{
    (void)state;
    struct model m, back;
    reads(pretty, &m);
    m.inputs[0].at_m = 0.03; /* no editing in place for it: written anew */
    char *text = save(&m, &back);
    assert_true(back.inputs[0].at_m == 0.03);
    same_model(&m, &back);
    free(text);
    model_free(&m);
    model_free(&back);
}

static void an_invalid_model_is_not_written(void **state)
{
    (void)state;
    struct model m;
    struct bf_error err = {0};
    reads(pretty, &m);
    m.materials[0].rho.value = -1.0;
    char *path = temporary_file("kept.yaml", "old", 3);
    assert_int_equal(model_write(path, &m, &err), BF_NUMERIC);
    assert_contains(err.text, "rho_beam_kgpm");
    struct stat info;
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_size, 3);
    m.materials[0].rho.value = NAN;
    assert_int_equal(model_write(path, &m, &err), BF_NUMERIC);
    m.materials[0].rho.value = 1.0;
    assert_int_equal(model_write("/nowhere/at/all.yaml", &m, &err), BF_BAD_FILE);
    unlink(path);
    free(path);
    model_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_layout_reads_back),
        cmocka_unit_test(an_unchanged_model_keeps_every_line),
        cmocka_unit_test(a_fit_changes_values_only),
        cmocka_unit_test(add_and_drop_restore_the_text),
        cmocka_unit_test(the_last_effect_leaves_an_empty_list_and_returns),
        cmocka_unit_test(prior_centre_survives_two_fits),
        cmocka_unit_test(a_place_once_freed_stays_free),
        cmocka_unit_test(descent_is_recorded),
        cmocka_unit_test(a_model_made_in_memory_is_written_whole),
        cmocka_unit_test(changed_geometry_is_not_lost),
        cmocka_unit_test(an_invalid_model_is_not_written),
    };
    return cmocka_run_group_tests_name("model_yaml_edit", tests, NULL, NULL);
}
