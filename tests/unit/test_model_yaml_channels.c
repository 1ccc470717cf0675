/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Places and gains of channels in the model file: held or parameters, with a ruler's prior, printed anew, kept by an edit, refused. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model/model_yaml.h"

#define CHANNELS /* 8 lines, then the outputs */                                                                       \
    "format: beamfit-model/1\nbeam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"                                 \
    "parameters:\n  {EI_beam_Nm2: 0.495, EI_patch_Nm2: 1.05, rho_beam_kgpm: 0.09, rho_patch_kgpm: 0.3}\n"              \
    "inputs:\n  hammer_N: {kind: point_force, at_m: 0.1, gain: -1}\noutputs:\n"

static void reads(const char *text, struct model *model)
{
    struct bf_error err = {0};
    if (model_read_text("m.yaml", text, strlen(text), model, &err) != BF_OK)
        fail_msg("%s\n%s", err.text, text);
}

/* The parameter of this label; fails when there is none. */
static struct parameter_ref listed(const struct model *m, const char *label)
{
    struct parameter_ref *refs, found = {0};
    const size_t n = model_parameters(m, NULL, 0, &refs);
    for (size_t i = 0; i < n; i++)
        if (strcmp(refs[i].label, label) == 0)
            found = refs[i];
    free(refs);
    if (found.info == NULL)
        fail_msg("no parameter %s", label);
    return found;
}

static void assert_near(double a, double b)
{
    if (!(a - b < 1e-12 && b - a < 1e-12))
        fail_msg("%.17g is not %.17g", a, b);
}

/* A number is held, {value: ...} is a parameter; a ruler's sd is in metres, under prior_m or, before any fit, under sd. */
static void places_and_gains(void **state)
{
    (void)state;
    static const char *const priors[] = {"prior_m: 0.002", "sd: 0.002", "prior: 0.005", "sd: 0.0001, prior_m: 0.002"};
    for (size_t i = 0; i < sizeof priors / sizeof *priors; i++) {
        char text[1024];
        struct model m, again;
        (void)snprintf(text, sizeof text,
                       CHANNELS
                       "  tip_mps: {kind: velocity, at_m: {value: 0.4, %s}, gain: {value: 1.1, prior: 0.05}} # laser\n"
                       "effects: []\n",
                       priors[i]);
        reads(text, &m);
        assert_true(model_input_gain(&m, 0) < -0.5 && !m.inputs[0].own.lists_gain && !m.inputs[0].own.lists_at);
        const struct parameter_ref at = listed(&m, "tip_mps.at_m"), gain = listed(&m, "tip_mps.gain");
        assert_near(at.value, 0.4), assert_near(at.info->prior * at.info->prior_value, 0.002);
        assert_true(!at.info->fixed && at.info->max == 0.4573 && gain.info->prior == 0.05 && gain.info->logarithmic);
        const double value[] = {0.41, 1.05}, sd[] = {1e-4, 2e-3};
        const struct parameter_ref refs[] = {at, gain};
        model_set_parameters(&m, refs, 2, value, sd, NULL);
        assert_true(m.outputs[0].at_m == 0.41 && model_output_gain(&m, 0) == 1.05);
        char *edited = model_edit_text(m.document, strlen(m.document), &m), *printed = model_to_text(&m);
        assert_non_null(edited);
        assert_non_null(strstr(edited, "# laser"));
        for (int k = 0; k < 2; k++) { /* what a fit found is read back with the ruler's prior, however it was written */
            reads(k == 0 ? edited : printed, &again);
            const struct parameter_ref back = listed(&again, "tip_mps.at_m");
            assert_near(back.value, 0.41), assert_near(back.info->prior_value, 0.4);
            assert_near(back.info->prior * back.info->prior_value, 0.002), assert_near(back.info->sd, 1e-4);
            model_free(&again);
        }
        free(edited), free(printed);
        model_free(&m);
    }
}

/* A bound that the file states for a place stays, however the file is written; the end of the beam, which is the default, is not stated. */
static void a_place_keeps_its_bound(void **state)
{
    (void)state;
    static const struct {
        const char *keys;
        double max;
        bool stated;
    } cases[] = {{", max: 0.42", 0.42, true}, {"", 0.4573, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[1024];
        struct model m, again;
        (void)snprintf(text, sizeof text, CHANNELS "  tip_mps: {kind: velocity, at_m: {value: 0.4%s}}\neffects: []\n",
                       cases[i].keys);
        reads(text, &m);
        char *edited = model_edit_text(m.document, strlen(m.document), &m), *printed = model_to_text(&m);
        for (int k = 0; k < 2; k++) {
            reads(k == 0 ? edited : printed, &again);
            assert_near(listed(&again, "tip_mps.at_m").info->max, cases[i].max);
            model_free(&again);
        }
        assert_true((strstr(printed, "max:") != NULL) == cases[i].stated);
        free(edited), free(printed);
        model_free(&m);
    }
}

static void wrong_places_and_gains(void **state)
{
    (void)state;
    static const struct {
        const char *output, *message;
    } bad[] = {
        {"{kind: velocity, at_m: {value: 0.5}}", "outside the beam"},
        {"{kind: velocity, at_m: {value: 0.4, prior_m: -1}}", "the standard deviation of a place is -1"},
        {"{kind: velocity, at_m: {value: 0.4, prior_m: 1e308}}", "is 1e+308 m; write metres"},
        {"{kind: velocity, at_m: {value: 1e-320, sd: 0.01}}", "write metres"},
        {"{kind: velocity, at_m: {value: 0.4, prior_m: 0.001, sd: .inf}}", "sd is inf"},
        {"{kind: velocity, at_m: {value: 0.4, prior: 0}}", "prior is 0"},
        {"{kind: velocity, at_m: {value: 0, prior_m: 0.001}}", "at_m is 0 m with a standard deviation"},
        {"{kind: velocity, at_m: {prior_m: 0.001}}", "at_m has no value"},
        {"{kind: velocity, at_m: {value: 0.4, sigma: 0.001}}", "unknown key"},
        {"{kind: velocity, at_m: 0.4, gain: 0}", "gain is 0"},
        {"{kind: patch_strain, gain: 2}", "unknown key"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char text[1024];
        struct model m;
        struct bf_error err;
        (void)snprintf(text, sizeof text, CHANNELS "  tip_mps: %s\neffects: []\n", bad[i].output);
        assert_int_equal(model_read_text("m.yaml", text, strlen(text), &m, &err), BF_BAD_FILE);
        if (strncmp(err.text, "m.yaml:8: ", 10) != 0 || strstr(err.text, bad[i].message) == NULL)
            fail_msg("%s: %s", bad[i].output, err.text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(places_and_gains),
        cmocka_unit_test(a_place_keeps_its_bound),
        cmocka_unit_test(wrong_places_and_gains),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
