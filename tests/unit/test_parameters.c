/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "model/model.h"

static const char rig[] =
    "format: beamfit-model/1\n"
    "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
    "parameters: {EI_beam_Nm2: 1, rho_beam_kgpm: 2, cDI_beam_sNm2: 3e-5, EI_patch_Nm2: 4, rho_patch_kgpm: 5,\n"
    "  cDI_patch_sNm2: 6e-5, gamma_sNpm2: 7e-3, Ks_V: 8, KB_NmpV: 9}\n"
    "outputs: {piezo_V: {kind: patch_strain}, tip_m: {kind: displacement, at_m: 0.4}}\n"
    "effects:\n"
    "  - {kind: tip_mass, mass_kg: 0.01}\n"
    "  - {kind: mains_hum, channel: piezo_V, phase_rad: {value: 0.5, per_record: {b.csv: {value: 0.7, sd: 0.1}}}}\n"
    "  - {kind: mains_hum, channel: tip_m, frequency_Hz: {value: 60}}\n"
    "  - {kind: point_mass, mass_kg: 0.02, at_m: 0.2}\n";
static const char *const records[] = {"a.csv", "b.csv", "c.csv"};

static void read_rig(struct model *m)
{
    struct bf_error err = {0};
    if (model_read_text("rig", rig, strlen(rig), m, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static size_t find(const struct parameter_ref refs[], size_t n, const char *label)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(refs[i].label, label) == 0)
            return i;
    fail_msg("no parameter '%s'", label);
    return 0;
}

static void order_and_values(void **state)
{
    (void)state;
    static const struct {
        const char *label;
        enum parameter_role role;
        double value;
    } wanted[] = {
        {"EI_beam_Nm2", ROLE_EI, 1},       {"rho_beam_kgpm", ROLE_RHO, 2},
        {"cDI_beam_sNm2", ROLE_CDI, 3e-5}, {"EI_patch_Nm2", ROLE_EI, 4},
        {"rho_patch_kgpm", ROLE_RHO, 5},   {"cDI_patch_sNm2", ROLE_CDI, 6e-5},
        {"gamma_sNpm2", ROLE_GAMMA, 7e-3}, {"Ks_V", ROLE_KS, 8},
        {"KB_NmpV", ROLE_KB, 9},           {"tip_mass.mass_kg", ROLE_EFFECT, 0.01},
    };
    struct model m;
    struct parameter_ref *refs;
    read_rig(&m);
    size_t n = model_parameters(&m, NULL, 0, &refs);
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
        assert_string_equal(refs[i].label, wanted[i].label);
        assert_int_equal(refs[i].role, wanted[i].role);
        assert_int_equal(refs[i].record, -1);
        assert_true(!(fabs(refs[i].value - wanted[i].value) > 0.0));
        assert_string_equal(refs[i].info->name, i < 9 ? wanted[i].label : "mass_kg");
    }
    assert_int_equal(n, 9 + 1 + 2 + 2 + 2); /* phases have no value without a record */
    free(refs);
    model_free(&m);
}

static void one_phase_per_record(void **state)
{
    (void)state;
    struct model m;
    struct parameter_ref *refs;
    read_rig(&m);
    size_t n = model_parameters(&m, records, 3, &refs);
    assert_int_equal(n, 9 + 1 + (2 + 3) + (2 + 3) + 2);
    size_t a = find(refs, n, "mains_hum.1.phase_rad@a.csv"), b = find(refs, n, "mains_hum.1.phase_rad@b.csv");
    assert_true(refs[a].value == 0.5 && refs[b].value == 0.7);
    assert_true(refs[a].record == 0 && refs[b].record == 1 && refs[a].slot == refs[b].slot);
    assert_true(refs[find(refs, n, "mains_hum.2.phase_rad@c.csv")].owner == 2);
    free(refs);
    model_free(&m);
}

static void labels_are_unique(void **state)
{
    (void)state;
    struct model m;
    struct parameter_ref *refs;
    read_rig(&m);
    size_t n = model_parameters(&m, records, 3, &refs);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < i; j++)
            assert_string_not_equal(refs[i].label, refs[j].label);
    (void)find(refs, n, "at_m"); /* alone of its name: bare */
    free(refs);
    struct bf_error err = {0};
    assert_int_equal(model_drop_effect(&m, "point_mass", &err), BF_OK);
    n = model_parameters(&m, records, 3, &refs);
    (void)find(refs, n, "mass_kg"); /* now alone */
    free(refs);
    model_free(&m);
}

static void what_is_set_is_read(void **state)
{
    (void)state;
    struct model m;
    struct parameter_ref *refs, *again;
    read_rig(&m);
    size_t n = model_parameters(&m, records, 3, &refs);
    double *value = calloc(n, sizeof *value), *sd = calloc(n, sizeof *sd);
    for (size_t i = 0; i < n; i++) {
        value[i] = 100.0 + (double)i;
        sd[i] = 1.0 + (double)i;
    }
    model_set_parameters(&m, refs, n, value, sd, records);
    assert_int_equal(model_parameters(&m, records, 3, &again), n);
    for (size_t i = 0; i < n; i++) {
        assert_string_equal(again[i].label, refs[i].label);
        assert_true(!(fabs(again[i].value - value[i]) > 0.0));
        if (again[i].record < 0)
            assert_true(!(fabs(again[i].info->sd - sd[i]) > 0.0));
    }
    assert_int_equal(m.effects[1].n_per_record, 3);
    assert_true(m.effects[1].parameters[1].value == 0.5); /* the common value is untouched */
    model_set_parameters(&m, again, n, value, NULL, records);
    assert_int_equal(m.effects[1].n_per_record, 3); /* no second entry for a record */
    assert_true(m.Ks.sd > 0.0);                     /* no errors given: the old ones stay */
    free(refs);
    free(again);
    free(value);
    free(sd);
    model_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(order_and_values),
        cmocka_unit_test(one_phase_per_record),
        cmocka_unit_test(labels_are_unique),
        cmocka_unit_test(what_is_set_is_read),
    };
    return cmocka_run_group_tests_name("parameters", tests, NULL, NULL);
}
