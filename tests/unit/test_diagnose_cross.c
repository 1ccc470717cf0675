/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Cross-validation over whole records. */
#include <signal.h>

#include "diagnose_rig.h"
#include "explain/probability.h"
#include "ground/ground.h"
#include "show/show.h"

static void assert_json_kind(const struct diagnosis *d, const char *kind)
{
    char *text = NULL, expected[64];
    size_t size = 0;
    struct bf_error err;
    FILE *out = open_memstream(&text, &size);
    assert_int_equal(json_print_and_free(diagnose_json(d, NULL, &(struct channel_factors){0}), out, &err), BF_OK);
    (void)fclose(out);
    (void)snprintf(expected, sizeof expected, "\"check_kind\": \"%s\"", kind);
    assert_non_null(strstr(text, expected));
    free(text);
}

static const char *const masses[] = {"tip_mass", "point_mass", NULL};

static void a_true_effect_is_confirmed(void **state)
{
    (void)state;
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 3, LONG, 0.01, masses);
    diagnose(b, 3, 0);
    const struct hypothesis *best = &b->d.hypotheses[0];
    assert_int_equal(b->d.verdict, VERDICT_MISSING);
    assert_string_equal(b->d.named[0], "tip_mass");
    assert_int_equal(b->d.check_kind, CHECK_CROSS);
    assert_int_equal(best->check.n_channels, 6);
    assert_true(best->check.noise_ratio > 0.95 && best->check.noise_ratio < 1.1);
    assert_int_equal(b->d.baseline.check.n_channels, 6);
    assert_true(b->d.baseline.check.noise_ratio > b->d.baseline.fitted.noise_ratio);
    assert_non_null(strstr(b->d.text, "left out in turn"));
    assert_null(strstr(b->d.text, "held out"));
    assert_json_kind(&b->d, "cross-validation");
    bench_free(b);
}

/* The same number as by hand: a fit to the second record, from the handbook's values, that predicts the first; and vice versa. */
static void two_records_predict_each_other(void **state)
{
    (void)state;
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 2, LONG, 0.01, masses);
    diagnose(b, 2, 0);
    const struct hypothesis *best = &b->d.hypotheses[0];
    double ratio[2];
    assert_int_equal(best->check.n_channels, 4);
    for (size_t out = 0; out < 2; out++) {
        struct model model = make("{kind: tip_mass, mass_kg: 0.0001}");
        struct refit_result fit;
        struct parameter_ref *refs;
        struct bf_error err;
        double sigma[4], nrmse;
        for (size_t c = 0; c < 4; c++)
            sigma[c] = b->d.noise[c].rms;
        const struct record *kept = &b->records[1 - out];
        const char *name = record_base_name(kept);
        const struct refit_options options = {.sigma = sigma + 2 * (1 - out)};
        assert_int_equal(refit_run(&model, kept, 1, &options, &fit, &err), BF_OK);
        const size_t n = model_parameters(&model, &name, 1, &refs);
        model_set_parameters(&model, refs, n, fit.value, NULL, &name);
        const struct fit_options predict = {.quiet = true, .sigma = sigma + 2 * out, .predict = {.quiet = true}};
        struct fit_channel_error *channels;
        size_t n_channels;
        assert_int_equal(fit_errors(&model, &b->records[out], 1, &predict, &channels, &n_channels, &err), BF_OK);
        fit_totals(channels, n_channels, &nrmse, &ratio[out]);
        free(channels);
        free(refs);
        refit_free(&fit);
        model_free(&model);
    }
    const double by_hand = sqrt(0.5 * (ratio[0] * ratio[0] + ratio[1] * ratio[1]));
    print_message("%g by hand, %g found, fitted %g\n", by_hand, best->check.noise_ratio, best->fitted.noise_ratio);
    assert_true(fabs(best->check.noise_ratio - by_hand) < 1e-3 * by_hand);
    bench_free(b);
}

/*
 * A mass elsewhere, short records, much noise: a wrong effect fits both, and neither record foretells the other as well. It is less sure than
 * it would be if nothing but the fitted records were asked.
 */
static void an_overfitting_effect_is_less_sure(void **state)
{
    (void)state;
    static const char *const wrong[] = {"rotary_inertia", NULL};
    struct bench *b = bench_new("{kind: point_mass, mass_kg: 0.0003, at_m: 0.3}", 2, SHORT, 0.05, wrong);
    diagnose(b, 2, 0);
    const struct hypothesis *best = &b->d.hypotheses[0];
    assert_int_equal(best->n_effects, 1);
    assert_true(best->fitted.noise_ratio < 1.05);
    assert_true(best->check.noise_ratio > 1.15);
    assert_true(best->held_out_explained < 0.6 && best->explained > 0.95);
    const struct decision *one = &b->d.decisions[0];
    double fitted_only[FEATURES];
    memcpy(fitted_only, one->feature, sizeof fitted_only);
    fitted_only[FEATURE_REMAINS] = 0.0; /* they are at the noise */
    assert_true(one->feature[FEATURE_REMAINS] > 0.5);
    assert_true(one->probability < 0.85 && probability_of(fitted_only) > one->probability + 0.05);
    bench_free(b);
}

/* Standard errors with all records: where one would grow more than REFIT_WEAK times, the value stays; the others move. */
static void a_value_that_the_others_do_not_tell_is_kept(void **state)
{
    (void)state;
    struct bench *b = bench_new("", 1, LONG, 0.01, masses);
    struct refit_result fit;
    struct parameter_ref *refs;
    struct bf_error err;
    const double sigma[] = {1e-3, 1e-3};
    const char *name = record_base_name(b->records);
    b->given.Ks.value *= 1.05;
    b->given.materials[0].EI.value *= 1.001;
    const size_t n = model_parameters(&b->given, &name, 1, &refs);
    double *known_sd = calloc(n, sizeof *known_sd);
    for (size_t i = 0; i < n; i++)
        known_sd[i] = refs[i].role == ROLE_KS ? 1e-9 : HUGE_VAL;
    for (int kept = 0; kept < 2; kept++) {
        const struct refit_options options = {.sigma = sigma, .near = true, .known_sd = kept ? known_sd : NULL};
        assert_int_equal(refit_run(&b->given, b->records, 1, &options, &fit, &err), BF_OK);
        for (size_t i = 0; i < n; i++) {
            const bool moved = fabs(fit.value[i] / refs[i].value - 1.0) > 1e-9;
            if (refs[i].role == ROLE_KS)
                assert_int_equal(moved, kept == 0);
            else if (refs[i].role == ROLE_EI)
                assert_true(moved);
        }
        refit_free(&fit);
    }
    free(known_sd), free(refs);
    bench_free(b);
}

static void hide(struct record *record, const char *name)
{
    for (size_t c = 0; c < record->n_columns; c++)
        if (strcmp(record->columns[c].name, name) == 0) {
            free(record->columns[c].name);
            record->columns[c].name = strdup("unused");
        }
}

/* Each of two records has a channel that the other has not: neither tells what the other is predicted with. */
static void records_without_a_common_channel_are_not_left_out(void **state)
{
    (void)state;
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 2, LONG, 0.01, masses);
    hide(&b->records[0], b->given.outputs[0].name);
    hide(&b->records[1], b->given.outputs[1].name);
    diagnose(b, 2, 0);
    assert_int_equal(b->d.verdict, VERDICT_MISSING);
    assert_int_equal(b->d.check_kind, CHECK_NONE);
    assert_int_equal(b->d.hypotheses[0].check.n_channels, 0);
    assert_non_null(strstr(b->d.text, "Not cross-validated: "));
    assert_non_null(strstr(b->d.text, "piezo_V, whose gain is open, is in r1.csv alone. A second record"));
    bench_free(b);
}

/* A velocity of known gain, though in one record alone, is predicted from what the other shows of the beam. */
static void a_known_sensor_in_one_record_alone_is_predicted(void **state)
{
    (void)state;
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 2, LONG, 0.01, masses);
    hide(&b->records[0], b->given.outputs[1].name);
    diagnose(b, 2, 0);
    assert_int_equal(b->d.verdict, VERDICT_MISSING);
    assert_int_equal(b->d.check_kind, CHECK_CROSS);
    assert_int_equal(b->d.hypotheses[0].check.n_channels, 3);
    bench_free(b);
}

static void one_record_is_not_left_out(void **state)
{
    (void)state;
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 1, LONG, 0.01, masses);
    diagnose(b, 1, 0);
    assert_int_equal(b->d.verdict, VERDICT_MISSING);
    assert_int_equal(b->d.check_kind, CHECK_NONE);
    assert_int_equal(b->d.hypotheses[0].check.n_channels, 0);
    assert_json_kind(&b->d, "none");
    bench_free(b);
}

static void records_held_out_are_enough(void **state)
{
    (void)state;
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 3, LONG, 0.01, masses);
    diagnose(b, 2, 1);
    assert_int_equal(b->d.check_kind, CHECK_RECORDS);
    assert_int_equal(b->d.hypotheses[0].check.n_channels, 2);
    assert_non_null(strstr(b->d.text, "held out"));
    assert_json_kind(&b->d, "records");
    bench_free(b);
}

/* Six groups of eight records; every channel has its error, each from a fit without its record. */
static void many_records_are_left_out_in_groups(void **state)
{
    (void)state;
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 8, LONG, 0.01, masses);
    diagnose(b, 8, 0);
    const struct hypothesis_errors *check = &b->d.hypotheses[0].check;
    assert_int_equal(b->d.verdict, VERDICT_MISSING);
    assert_int_equal(check->n_channels, 16);
    for (size_t c = 0; c < check->n_channels; c++)
        assert_true(check->ratio[c] > 0.85 && check->ratio[c] < 1.15);
    bench_free(b);
}

static void a_refit_that_failed_is_told(void **state)
{
    (void)state;
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 2, LONG, 0.01, masses);
    diagnose(b, 1, 0);
    b->d.hypotheses[0].cross_failed = true;
    char *text = diagnose_words(&b->d);
    assert_non_null(strstr(text, "Not cross-validated, because a refit without some of the records failed: tip_mass."));
    free(text);
    bench_free(b);
}

/* The last test: the interrupt stays. Nothing is named that was to be confirmed. */
static void an_interrupt_leaves_what_is_known(void **state)
{
    (void)state;
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 2, LONG, 0.01, masses);
    diagnose(b, 1, 0);
    double sigma[] = {b->d.noise[0].rms, b->d.noise[1].rms};
    struct diagnose_state w = {.d = &b->d, .options = &b->options, .threads = 2, .n_tried = 10, .sigma = sigma};
    b->d.n_records = 2;
    progress_catch_interrupts();
    (void)raise(SIGINT);
    diagnose_cross(&w, 1.0);
    assert_true(b->d.interrupted);
    assert_int_equal(b->d.verdict, VERDICT_UNKNOWN);
    assert_int_equal(b->d.n_named, 0);
    assert_int_equal(b->d.check_kind, CHECK_NONE);
    assert_false(b->d.hypotheses[0].cross_failed);
    b->d.n_records = 1;
    bench_free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_true_effect_is_confirmed),
        cmocka_unit_test(two_records_predict_each_other),
        cmocka_unit_test(an_overfitting_effect_is_less_sure),
        cmocka_unit_test(a_value_that_the_others_do_not_tell_is_kept),
        cmocka_unit_test(records_without_a_common_channel_are_not_left_out),
        cmocka_unit_test(a_known_sensor_in_one_record_alone_is_predicted),
        cmocka_unit_test(one_record_is_not_left_out),
        cmocka_unit_test(records_held_out_are_enough),
        cmocka_unit_test(many_records_are_left_out_in_groups),
        cmocka_unit_test(a_refit_that_failed_is_told),
        cmocka_unit_test(an_interrupt_leaves_what_is_known),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
