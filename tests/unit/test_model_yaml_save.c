/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What saved model files carry on: centres of priors, freed places, descent; models written whole; what is not written. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <sys/stat.h>
#include "saved_model.h"
#include "add_effect.h"

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
    assert_int_equal(add_effect(&m, "point_mass", "", &err), BF_OK);
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
    assert_int_equal(add_effect(&b, "root_compliance", "", &err), BF_OK);
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
        cmocka_unit_test(prior_centre_survives_two_fits),
        cmocka_unit_test(a_place_once_freed_stays_free),
        cmocka_unit_test(descent_is_recorded),
        cmocka_unit_test(a_model_made_in_memory_is_written_whole),
        cmocka_unit_test(changed_geometry_is_not_lost),
        cmocka_unit_test(an_invalid_model_is_not_written),
    };
    return cmocka_run_group_tests_name("model_yaml_save", tests, NULL, NULL);
}
