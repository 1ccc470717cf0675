/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model/model.h"
#include "add_effect.h"
#include "test_files.h"

static const char rig[] =
    "format: beamfit-model/1\n"
    "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
    "parameters: {EI_beam_Nm2: {value: 0.491, sd: 0.01}, rho_beam_kgpm: 0.093, EI_patch_Nm2: 0.793,\n"
    "  rho_patch_kgpm: 0.433, gamma_sNpm2: 0.013, Ks_V: 60}\n"
    "inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}\n"
    "outputs: {piezo_V: {kind: patch_strain}, tip_mps2: {kind: acceleration, at_m: 0.4}}\n"
    "effects: [{kind: mains_hum, channel: piezo_V, phase_rad: {value: 0, per_record: {a.csv: 1}}}]\n"
    "fit: {converged: true, nrmse: 0.1, records: [{file: a.csv, channels: [{name: piezo_V, nrmse: 0.1}]}]}\n";

static void read_rig(struct model *m)
{
    struct bf_error err = {0};
    if (model_read_text("rig.yaml", rig, strlen(rig), m, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static void a_copy_shares_nothing(void **state)
{
    (void)state;
    struct model a, b;
    struct bf_error err = {0};
    read_rig(&a);
    assert_int_equal(model_copy(&a, &b, &err), BF_OK);
    model_free(&a); /* the sanitizer watches what follows */
    assert_int_equal(model_check(&b, &err), BF_OK);
    assert_string_equal(b.fit.records[0].file, "a.csv");
    assert_string_equal(b.fit.records[0].channels[0].name, "piezo_V");
    assert_string_equal(b.effects[0].per_record[0].record, "a.csv");
    assert_string_equal(b.path, "rig.yaml");
    assert_non_null(b.document);
    assert_int_equal(b.n_regions, 3);
    model_free(&b);
    assert_null(b.regions);
    model_free(&b); /* a second time is harmless */
}

static void the_patch(void **state)
{
    (void)state;
    struct model m;
    double from, to;
    read_rig(&m);
    assert_true(model_patch(&m, &from, &to) && from == 0.02535 && to == 0.08905);
    struct beam_place place = model_place(&m);
    assert_true(place.length_m == 0.4573 && place.patch_from_m == 0.02535 && place.patch_to_m == 0.08905);
    (void)strcpy(m.regions[1].name, "glue"); /* no region of that name: the first patch channel's */
    m.outputs[0].from_m = 0.1;
    m.outputs[0].to_m = 0.2;
    assert_true(model_patch(&m, &from, &to) && from == 0.1 && to == 0.2);
    m.outputs[0].kind = OUTPUT_VELOCITY;
    assert_false(model_patch(&m, &from, &to));
    place = model_place(&m);
    assert_true(place.patch_from_m == 0.0 && place.patch_to_m == 0.0);
    model_free(&m);
}

static void effects_are_found_by_id(void **state)
{
    (void)state;
    struct bf_error err = {0};
    assert_true(beam_effects_count >= 15);
    for (int i = 0; i < beam_effects_count; i++)
        assert_ptr_equal(effect_by_id(beam_effects[i]->id), beam_effects[i]);
    assert_null(effect_by_id("gravity_waves"));
    assert_null(effect_find("tip_mas", &err));
    assert_int_equal(err.status, BF_USAGE);
    assert_contains(err.text, "did you mean 'tip_mass'");
}

/* Every effect of the catalogue starts inside its own range, on any beam. */
static void every_effect_can_be_added_and_dropped(void **state)
{
    (void)state;
    for (int i = 0; i < beam_effects_count; i++) {
        struct model m;
        struct bf_error err = {0};
        read_rig(&m);
        m.inputs = bf_grow(m.inputs, 2, sizeof *m.inputs);
        m.inputs[1] =
            (struct model_input){.name = "drive_V", .kind = INPUT_PATCH_MOMENT, .from_m = 0.02535, .to_m = 0.08905};
        m.n_inputs = 2;
        m.KB.value = 0.01;
        const char *id = beam_effects[i]->id;
        bool there = strcmp(id, "mains_hum") == 0;
        if (!there && add_effect(&m, id, "", &err) != BF_OK)
            fail_msg("%s: %s", id, err.text);
        const struct model_effect *added = &m.effects[m.n_effects - 1];
        for (int j = 0; j < added->effect->n_parameters; j++) {
            const struct parameter *p = &added->parameters[j];
            bool position = added->effect->parameters[j].role == BEAM_ROLE_PLACE;
            assert_true(p->value >= p->min && p->value <= p->max);
            assert_true(!position || (p->fixed && p->max <= 0.4573));
        }
        assert_int_equal(add_effect(&m, id, "", &err), BF_USAGE); /* a second time */
        assert_contains(err.text, "already");
        size_t n = m.n_effects;
        assert_int_equal(model_drop_effect(&m, id, &err), BF_OK);
        assert_int_equal(m.n_effects, n - 1);
        assert_int_equal(model_drop_effect(&m, id, &err), BF_USAGE);
        model_free(&m);
    }
}

static void adding_forgets_the_fit(void **state)
{
    (void)state;
    struct model m;
    struct bf_error err = {0};
    read_rig(&m);
    assert_true(m.fit.present && m.materials[0].EI.sd > 0.0);
    assert_int_equal(add_effect(&m, "tip_mass", "", &err), BF_OK);
    assert_false(m.fit.present);
    assert_int_equal(m.fit.n_records, 0);
    assert_true(m.materials[0].EI.sd == 0.0);
    model_free(&m);
}

static void a_refused_effect_leaves_the_model_alone(void **state)
{
    (void)state;
    struct model m;
    struct bf_error err = {0};
    read_rig(&m);
    assert_int_equal(add_effect(&m, "tip_mass", "piezo_V", &err), BF_USAGE);
    assert_int_equal(add_effect(&m, "drive_saturation", "", &err), BF_USAGE);
    assert_contains(err.text, "patch_moment");
    assert_int_equal(add_effect(&m, "tip_masss", "", &err), BF_USAGE);
    assert_int_equal(add_effect(&m, "sensor_lag", "tip_mps3", &err), BF_USAGE);
    assert_int_equal(m.n_effects, 1);
    assert_true(m.fit.present);
    model_free(&m);
}

static void two_uses_differ_in_place_or_channel(void **state)
{
    (void)state;
    struct model m;
    struct bf_error err = {0};
    read_rig(&m);
    assert_int_equal(add_effect(&m, "mains_hum", "tip_mps2", &err), BF_OK);
    assert_int_equal(add_effect(&m, "mains_hum", "tip_mps2", &err), BF_USAGE);
    assert_int_equal(model_append_effect(&m, "mains_hum", "piezo_V", &err), BF_OK);
    assert_int_equal(model_check(&m, &err), BF_BAD_FILE);
    m.effects[2].parameters[2].value = 60.0; /* another frequency */
    assert_int_equal(model_check(&m, &err), BF_OK);
    assert_int_equal(add_effect(&m, "point_mass", "", &err), BF_OK);
    assert_int_equal(model_append_effect(&m, "point_mass", "", &err), BF_OK);
    m.effects[4].parameters[1].value = 0.2;
    assert_int_equal(model_check(&m, &err), BF_OK);
    assert_int_equal(model_drop_effect(&m, "point_mass", &err), BF_OK); /* every use */
    assert_int_equal(m.n_effects, 3);
    model_free(&m);
}

static void spoil_1(struct model *m)
{
    m->regions[1].to_m = 0.2;
}
static void spoil_2(struct model *m)
{
    m->materials[1].EI.value = (double)NAN;
}
static void spoil_3(struct model *m)
{
    m->gamma.value = -1.0;
}
static void spoil_4(struct model *m)
{
    m->length_m = 1.0;
}
static void spoil_5(struct model *m)
{
    m->Ks.value = 0.0;
}
static void spoil_6(struct model *m)
{
    m->materials[0].EI.prior = 0.1;
    m->materials[0].EI.prior_value = 0.0;
}
static void spoil_7(struct model *m)
{
    m->effects[0].parameters[2].value = 1001.0;
}

static void check_sees_what_a_program_can_spoil(void **state)
{
    (void)state;
    static void (*const spoil[])(struct model *) = {spoil_1, spoil_2, spoil_3, spoil_4, spoil_5, spoil_6, spoil_7};
    static const char *const word[] = {"beam regions", "EI_patch_Nm2", "gamma_sNpm2",    "regions",
                                       "piezo_V",      "EI_beam_Nm2",  "effects, item 1"};
    for (size_t i = 0; i < sizeof spoil / sizeof *spoil; i++) {
        struct model m;
        struct bf_error err = {0};
        read_rig(&m);
        assert_int_equal(model_check(&m, &err), BF_OK);
        spoil[i](&m);
        assert_int_equal(model_check(&m, &err), BF_BAD_FILE);
        assert_contains(err.text, "rig.yaml: ");
        assert_contains(err.text, word[i]);
        model_free(&m);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_copy_shares_nothing),
        cmocka_unit_test(the_patch),
        cmocka_unit_test(effects_are_found_by_id),
        cmocka_unit_test(every_effect_can_be_added_and_dropped),
        cmocka_unit_test(adding_forgets_the_fit),
        cmocka_unit_test(a_refused_effect_leaves_the_model_alone),
        cmocka_unit_test(two_uses_differ_in_place_or_channel),
        cmocka_unit_test(check_sees_what_a_program_can_spoil),
    };
    return cmocka_run_group_tests_name("model", tests, NULL, NULL);
}
