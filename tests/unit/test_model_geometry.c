/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The length and the edges of the patch in the model file: held or parameters, kept by an edit, printed anew, moved, refused. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model/model_yaml.h"
#include "model_text.h"

#define FREE_BEAM                                                                                                      \
    "beam:\n  length_m: {value: 0.4573, sd: 0.002}   # a ruler\n"                                                      \
    "  patch_m: [{value: 0.02535, prior_m: 0.0005}, 0.08905] # glued\n"
#define TIP                                                                                                            \
    "inputs:\n  hammer_N: {kind: point_force, at_m: 0.0254}\noutputs:\n  tip_m: {kind: displacement, at_m: 0.4573}\n " \
    " piezo_V: {kind: patch_strain}\n"

static const struct parameter_ref *listed(const struct parameter_ref refs[], size_t n, const char *label)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(refs[i].label, label) == 0)
            return &refs[i];
    return NULL;
}

static void near(double a, double b)
{
    if (!(fabs(a - b) < 1e-12))
        fail_msg("%.17g is not %.17g", a, b);
}

static void is_moved(const struct model *m)
{
    near(m->length_m, 0.46), near(m->regions[2].to_m, 0.46), near(m->outputs[0].at_m, 0.46);
    near(m->regions[0].to_m, 0.024), near(m->regions[1].from_m, 0.024), near(m->outputs[1].from_m, 0.024);
    near(m->regions[1].to_m, 0.08905), near(m->inputs[0].at_m, 0.0254);
    near(m->own.length.prior_value, 0.4573), near(m->own.length.prior * 0.4573, 0.002), near(m->own.length.sd, 1e-4);
}

static void a_fit_is_written_where_the_ruler_was(void **state)
{
    (void)state;
    struct model m, again;
    struct parameter_ref *refs;
    reads(HEAD FREE_BEAM PARAMETERS TIP, &m);
    assert_true(m.own.lists_length && m.own.lists_from && !m.own.lists_to);
    const size_t n = model_parameters(&m, NULL, 0, &refs);
    const struct parameter_ref *length = listed(refs, n, "length_m"), *from = listed(refs, n, "patch_from_m");
    assert_non_null(length), assert_non_null(from), assert_null(listed(refs, n, "patch_to_m"));
    assert_true(!length->info->fixed && !length->info->logarithmic);
    near(from->info->prior * from->info->prior_value, 0.0005);
    const struct parameter_ref both[] = {*length, *from};
    model_set_parameters(&m, both, 2, (const double[]){0.46, 0.024}, (const double[]){1e-4, 2e-4}, NULL);
    is_moved(&m);
    char *edited = model_edit_text(m.document, strlen(m.document), &m), *printed = model_to_text(&m);
    assert_non_null(edited);
    assert_true(strstr(edited, "# a ruler") && strstr(edited, "# glued"));
    for (int k = 0; k < 2; k++) {
        reads(k == 0 ? edited : printed, &again);
        is_moved(&again);
        model_free(&again);
    }
    free(edited), free(printed), free(refs);
    model_free(&m);
}

/* A shorter beam is written with bounds that can be read again, a longer one without one that it has not been given. */
static void bounds_of_places_follow_the_length(void **state)
{
    (void)state;
    static const double length_m[] = {0.4553, 0.46};
    for (int k = 0; k < 2; k++) {
        struct model m, again;
        struct parameter_ref *refs;
        reads(HEAD FREE_BEAM PARAMETERS TIP "effects:\n  - {kind: point_mass, mass_kg: 0.01, at_m: 0.3}\n"
                                            "  - {kind: point_damper, damping_Nspm: 1, at_m: {value: 0.2, max: 0.4}}\n",
              &m);
        const size_t n = model_parameters(&m, NULL, 0, &refs);
        const struct parameter_ref *length = listed(refs, n, "length_m");
        assert_non_null(length);
        model_set_parameters(&m, length, 1, &length_m[k], NULL, NULL);
        char *printed = model_to_text(&m);
        reads(printed, &again);
        near(again.length_m, length_m[k]), near(again.effects[0].parameters[1].max, length_m[k]);
        near(again.effects[1].parameters[1].max, 0.4);
        assert_null(strstr(printed, "max: 0.45"));
        free(printed), free(refs);
        model_free(&m), model_free(&again);
    }
}

static void a_number_is_held(void **state)
{
    (void)state;
    struct model m;
    struct parameter_ref *refs;
    reads(GOOD, &m);
    const size_t n = model_parameters(&m, NULL, 0, &refs);
    assert_null(listed(refs, n, "length_m"));
    assert_null(listed(refs, n, "patch_from_m"));
    free(refs), model_free(&m);
}

static void what_cannot_be(void **state)
{
    (void)state;
    struct model m, out;
    struct bf_error err;
    refuses(HEAD "beam: {length_m: {value: 0.4573, sd: -1}, patch_m: [0.02535, 0.08905]}\n" PARAMETERS CHANNELS,
            "m.yaml:2: ", "standard deviation");
    refuses(HEAD "beam: {length_m: {sd: 0.1}, patch_m: [0.02535, 0.08905]}\n" PARAMETERS CHANNELS,
            "m.yaml:2: ", "length_m has no value");
    refuses(HEAD "beam: {length_m: 0.4573, patch_m: [{value: 0.1, sd: 0.001}, 0.08905]}\n" PARAMETERS CHANNELS,
            "m.yaml:2: ", "is empty");
    refuses(HEAD "beam: {length_m: {value: 0.4573, sd: 0.001}, patch_m: [0.02535, 0.08905]}\n" PARAMETERS CHANNELS
                 "effects:\n  - {kind: point_mass, mass_kg: 0.01, at_m: 0.4573}\n",
            "m.yaml:14: ", "sits at the free end");
    reads(GOOD, &m);
    assert_int_equal(model_copy(&m, &out, &err), BF_OK);
    assert_int_equal(model_move(&m, (const double[MODEL_MOVES]){[MOVE_LENGTH] = -0.39}, &out, &err), BF_NUMERIC);
    assert_int_equal(model_move(&m, (const double[MODEL_MOVES]){[MOVE_FROM] = 0.07}, &out, &err), BF_NUMERIC);
    assert_int_equal(model_move(&m, (const double[MODEL_MOVES]){[MOVE_LENGTH] = -0.01}, &out, &err), BF_OK);
    near(out.length_m, 0.4473);
    model_free(&m), model_free(&out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_fit_is_written_where_the_ruler_was),
        cmocka_unit_test(bounds_of_places_follow_the_length),
        cmocka_unit_test(a_number_is_held),
        cmocka_unit_test(what_cannot_be),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
