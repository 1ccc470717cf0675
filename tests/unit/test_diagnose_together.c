/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Held-out records that are quieter than the fitted ones: above the noise by the values, or by the physics. */
#include "diagnose_rig.h"

static const char *const nothing[] = {"tip_mass", NULL};

/* One noisy record is fitted, two quiet ones are held out; each set is of a beam with these effects. */
static struct bench *noisy_then_quiet(const char *fitted, const char *held_out)
{
    struct bench *b = bench_new(fitted, 1, LONG, 0.2, nothing);
    struct model other = make(held_out);
    b->records[1] = blow(&other, "q1.csv", LONG, 0.006, 10.0, 0.002);
    b->records[2] = blow(&other, "q2.csv", LONG, 0.004, 10.0, 0.002);
    b->n = 3;
    diagnose(b, 1, 2);
    model_free(&other);
    return b;
}

static void values_that_noise_has_left_open_are_no_misfit(void **state)
{
    (void)state;
    struct bench *b = noisy_then_quiet("", "");
    assert_true(b->d.baseline.fitted.noise_ratio < 1.05);
    assert_true(b->d.baseline.open_values);
    assert_true(b->d.baseline.check.noise_ratio < 1.05);
    assert_int_equal(b->d.verdict, VERDICT_COMPLETE);
    assert_non_null(strstr(b->d.text, "with values fitted to all records"));
    bench_free(b);
}

/* The quiet records are of a beam with a tip mass, which no values of the model do, and which the noisy one does not show. */
static void what_no_values_explain_is_a_misfit(void **state)
{
    (void)state;
    struct bench *b = noisy_then_quiet("", "{kind: tip_mass, mass_kg: 2e-4}");
    assert_true(b->d.baseline.fitted.noise_ratio < 1.05);
    assert_true(b->d.baseline.check.noise_ratio > 2.0);
    assert_false(b->d.baseline.open_values);
    assert_null(strstr(b->d.text, "with values fitted to all records"));
    bench_free(b);
}

static void what_predicts_the_held_out_is_not_asked(void **state)
{
    (void)state;
    struct bench *b = bench_new("", 3, LONG, 0.01, nothing);
    diagnose(b, 1, 2);
    assert_int_equal(b->d.verdict, VERDICT_COMPLETE);
    assert_false(b->d.baseline.open_values);
    assert_null(strstr(b->d.text, "with values fitted to all records"));
    bench_free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_that_noise_has_left_open_are_no_misfit),
        cmocka_unit_test(what_no_values_explain_is_a_misfit),
        cmocka_unit_test(what_predicts_the_held_out_is_not_asked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
