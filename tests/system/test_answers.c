/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * One pass through the work of a person, and of a program that reads --json: the keys are those of the formats page, the
 * values agree with each other, and a fit of data that the model itself made finds the parameters that made it.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "ask.h"

static const json_t *member(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    if (value == NULL)
        fail_msg("key '%s' is missing", key);
    return value;
}

static double number(const json_t *object, const char *key)
{
    const json_t *value = member(object, key);
    if (!json_is_number(value))
        fail_msg("key '%s' is no number", key);
    return json_number_value(value);
}

static void close_to(double a, double b, double relative)
{
    if (!(fabs(a - b) <= relative * fabs(b)))
        fail_msg("%.9g is not %.9g within %g of it", a, b, relative);
}

/* A tap of 8 ms on the hammer channel, 4 s at 256 Hz, smooth enough for the band. */
static void write_tap(const char *dir)
{
    enum { N = 1024, LINE = 40 };
    char *text = malloc(N * LINE);
    assert_non_null(text);
    size_t n = (size_t)sprintf(text, "time_s,hammer_N\n");
    for (int k = 0; k < N; k++) {
        double x = (k / 256.0 - 0.1) / 0.008;
        n += (size_t)snprintf(text + n, LINE, "%.9g,%.9g\n", k / 256.0, 10.0 * exp(-0.5 * x * x));
    }
    write_file(dir, "tap.csv", text, n);
    free(text);
}

static void modes_of_the_paper(void **state)
{
    /* roots of the stepped beam's transfer matrix; the paper's facts print them as 6.64605 … 305.19956 */
    static const double exact_Hz[] = {6.6460576303, 38.3615456292, 95.5184281157, 178.7423073242, 305.1995522924};
    json_t *root = answer(*state, (const char *[]){"modes", "model.yaml", "--json", NULL});
    const json_t *modes = member(root, "modes");
    assert_true(json_array_size(modes) >= 5);
    for (size_t i = 0; i < 5; i++) {
        close_to(number(json_array_get(modes, i), "frequency_Hz"), exact_Hz[i], 1e-6);
        assert_true(number(json_array_get(modes, i), "damping_ratio") > 0);
    }
    const json_t *deployed = member(root, "deployed");
    assert_int_equal(number(deployed, "dimension"), 10);
    assert_true(json_is_string(member(deployed, "basis")));
    assert_true(json_array_size(member(deployed, "relative_error")) >= 2);
    json_decref(root);
}

static void simulated_data_fit_to_their_own_parameters(void **state)
{
    struct rig *rig = *state;
    write_tap(rig->dir);
    run_beamfit(rig->dir, (const char *[]){"simulate", "model.yaml", "--input", "tap.csv", "-o", "clean.csv", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    /* a converter of 20 mV steps: rms 6 mV on a signal of 5 V */
    run_program(rig->dir,
                (const char *[]){"awk", "-F,", "-v", "OFS=,",
                                 "/^[0-9]/ {$3 = 0.02 * int($3 / 0.02 + 1000000.5) - 20000} 1", "clean.csv", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    write_text(rig->dir, "hit.csv", rig->outcome.out);
    rig_model_with(rig, 13, "  Ks_V: {value: 4000}");
    json_t *root = answer(rig, (const char *[]){"fit", "model.yaml", "hit.csv", "-o", "fitted.yaml", "--json", NULL});
    assert_true(json_is_true(member(root, "converged")));
    assert_true(number(root, "nrmse") < 2e-3);
    assert_true(number(root, "seconds") >= 0);
    assert_true(number(root, "evaluations") >= 1);
    assert_true(json_is_array(member(root, "null_directions")));
    const json_t *Ks = member(member(root, "parameters"), "Ks_V");
    assert_true(json_is_boolean(member(Ks, "identifiable")));
    assert_int_equal(json_array_size(member(Ks, "ci95")), 2);
    close_to(number(Ks, "value"), 4682.342, 2e-3);
    const json_t *record = json_array_get(member(root, "records"), 0);
    assert_non_null(strstr(json_string_value(member(record, "file")), "hit.csv"));
    const json_t *channel = json_array_get(member(record, "channels"), 0);
    assert_string_equal(json_string_value(member(channel, "name")), "piezo_V");
    close_to(number(channel, "nrmse"), number(root, "nrmse"), 1e-6); /* one channel: the total is the channel */

    json_t *again = answer(rig, (const char *[]){"compare", "fitted.yaml", "hit.csv", "--json", NULL});
    assert_true(number(again, "nrmse") < 2e-3);
    number(again, "noise_ratio");
    channel = json_array_get(member(json_array_get(member(again, "records"), 0), "channels"), 0);
    double share = 0;
    size_t i;
    json_t *band;
    json_array_foreach(member(channel, "bands"), i, band)
    {
        assert_true(number(band, "to_Hz") > number(band, "from_Hz"));
        share += number(band, "share");
    }
    close_to(share, 1.0, 0.01);
    json_decref(root);
    json_decref(again);
}

static void compare_says_no_with_status_1(void **state)
{
    struct rig *rig = *state;
    run_beamfit(rig->dir, (const char *[]){"compare", "model.yaml", "record.csv", "--max-nrmse", "0.01", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 1);
    run_beamfit(rig->dir, (const char *[]){"compare", "model.yaml", "record.csv", "--max-nrmse", "1e9", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
}

static void init_makes_a_model_that_works(void **state)
{
    struct rig *rig = *state;
    run_beamfit(rig->dir, (const char *[]){"init", "-o", "new.yaml", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    json_decref(answer(rig, (const char *[]){"modes", "new.yaml", "--json", NULL}));
}

static void add_then_drop_is_where_we_were(void **state)
{
    struct rig *rig = *state;
    json_t *before = answer(rig, (const char *[]){"modes", "model.yaml", "--json", NULL});
    run_beamfit(rig->dir, (const char *[]){"add", "model.yaml", "tip_mass", "mass_kg=0.004", "-o", "tip.yaml", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    json_t *with = answer(rig, (const char *[]){"modes", "tip.yaml", "--json", NULL});
    run_beamfit(rig->dir, (const char *[]){"drop", "tip.yaml", "tip_mass", "-o", "back.yaml", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    json_t *after = answer(rig, (const char *[]){"modes", "back.yaml", "--json", NULL});
    double f[3];
    const json_t *roots[3] = {before, with, after};
    for (int i = 0; i < 3; i++)
        f[i] = number(json_array_get(member(roots[i], "modes"), 0), "frequency_Hz");
    assert_true(f[1] < 0.97 * f[0]); /* 4 g at the tip of a 50 g beam */
    close_to(f[2], f[0], 1e-12);
    json_decref(before);
    json_decref(with);
    json_decref(after);
}

static void every_effect_of_the_catalogue_can_be_added(void **state)
{
    struct rig *rig = *state;
    rig_model_with(rig, 14, "  KB_NmpV: {value: 0.01}\ninputs:\n  drive_V: {kind: patch_moment}");
    run_beamfit(rig->dir, (const char *[]){"effects", "--json", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    json_t *root = json_loads(rig->outcome.out, 0, NULL);
    assert_non_null(root);
    const json_t *list = json_is_object(root) ? member(root, "effects") : root;
    assert_true(json_array_size(list) >= 15);
    size_t i;
    json_t *effect;
    json_array_foreach(list, i, effect)
    {
        const char *id = json_string_value(member(effect, "id"));
        run_beamfit(rig->dir, (const char *[]){"add", "model.yaml", id, "--at", "0.3", "-o", "new.yaml", NULL},
                    &rig->outcome);
        if (rig->outcome.status != 0) /* an effect without a place may refuse --at, and is added without */
            run_beamfit(rig->dir, (const char *[]){"add", "model.yaml", id, "-o", "new.yaml", NULL}, &rig->outcome);
        if (rig->outcome.status != 0)
            fail_msg("add %s: %s", id, rig->outcome.err);
    }
    json_decref(root);
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(modes_of_the_paper),
        CASE(simulated_data_fit_to_their_own_parameters),
        CASE(compare_says_no_with_status_1),
        CASE(init_makes_a_model_that_works),
        CASE(add_then_drop_is_where_we_were),
        CASE(every_effect_of_the_catalogue_can_be_added),
    };
    return cmocka_run_group_tests_name("answers", tests, NULL, NULL);
}
