/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The model with the values that were believed before any fit, and what is fitted again from it. */
#include "diagnose_rig.h"
#include "ground/ground.h"
#include "model/model_yaml.h"

static void a_prior_says_what_was_believed(void **state)
{
    (void)state;
    struct bf_error err;
    struct model model = make(""), given;
    struct parameter *EI = &model.materials[0].EI, *rho = &model.materials[0].rho;
    EI->prior = 0.03, EI->prior_value = 0.5, EI->value = 0.02;
    rho->prior = 0.03, rho->prior_value = 0.11; /* and it is held */
    model.Ks.value = 17.0;
    assert_int_equal(diagnose_as_given(&model, &given, &err), BF_OK);
    assert_true(given.materials[0].EI.value == 0.5);
    assert_true(given.materials[0].rho.value == rho->value);
    assert_true(given.Ks.value == 17.0);
    assert_true(EI->value == 0.02);
    model_free(&given);
    model_free(&model);
}

/* Fitted twice: the file keeps the value from before the first fit of what is open and has no prior, wherever it lies. */
static void a_fit_keeps_where_it_began(void **state)
{
    (void)state;
    struct bf_error err;
    struct model model = make(""), read, given;
    struct parameter_ref *refs;
    model.materials[0].rho.fixed = false, model.materials[0].rho.prior = 0.01, model.materials[0].rho.prior_value = 0.1;
    for (int fits = 1; fits <= 2; fits++) {
        const size_t n = model_parameters(&model, NULL, 0, &refs);
        double *value = bf_alloc(n, sizeof *value), *sd = bf_alloc(n, sizeof *sd);
        for (size_t i = 0; i < n; i++)
            value[i] = refs[i].value * (refs[i].info->fixed ? 1.0 : 1.5);
        model_set_parameters(&model, refs, n, value, sd, NULL);
        free(refs), free(value), free(sd);
    }
    char *text = model_to_text(&model);
    assert_int_equal(model_read_text("elsewhere.yaml", text, strlen(text), &read, &err), BF_OK);
    assert_non_null(strstr(text, "EI_beam_Nm2: {value: 1.125, start: 0.5}"));
    assert_null(strstr(text, "rho_beam_kgpm: {value: 0.225, start"));
    assert_int_equal(diagnose_as_given(&read, &given, &err), BF_OK);
    assert_true(given.materials[0].EI.value == 0.5 && given.Ks.value == 40.0 && given.materials[0].cDI.value == 2e-5);
    assert_true(given.materials[0].rho.value == 0.1); /* its prior tells */
    assert_true(given.gamma.value == 0.02);           /* it is held */
    free(text);
    model_free(&given), model_free(&read), model_free(&model);
}

/* A value from before the first fit is of the sign of the value, and an effect has none. */
static void a_start_that_says_nothing_is_refused(void **state)
{
    (void)state;
    static const char *const parameters[] = {"EI_beam_Nm2: {value: 0.5, start: 0.4}",
                                             "EI_beam_Nm2: {value: 0.5, start: -0.4}", "EI_beam_Nm2: {value: 0.5}"},
                             *const effects[] = {"", "", "{kind: tip_mass, mass_kg: {value: 0.01, start: 0.02}}"},
                             *const words[] = {NULL, "start -0.4", "start"};
    for (int i = 0; i < 3; i++) {
        char text[512];
        struct model model;
        struct bf_error err;
        const int n = snprintf(text, sizeof text,
                               "format: beamfit-model/1\nbeam: {length_m: 0.4}\nparameters:\n  %s\n  rho_beam_kgpm: "
                               "0.1\noutputs: {tip_m: {kind: displacement, at_m: 0.4}}\neffects: [%s]\n",
                               parameters[i], effects[i]);
        const enum bf_status status = model_read_text("m.yaml", text, (size_t)n, &model, &err);
        assert_int_equal(status, i == 0 ? BF_OK : BF_BAD_FILE);
        if (i == 0)
            model_free(&model);
        else
            assert_non_null(strstr(err.text, words[i]));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_prior_says_what_was_believed),
        cmocka_unit_test(a_fit_keeps_where_it_began),
        cmocka_unit_test(a_start_that_says_nothing_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
