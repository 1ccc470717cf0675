/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Cross-validation over whole records: small beams, recordings by the model itself plus noise, few effects looked at. */
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "beam_effect.h"
#include "dense.h"
#include "diagnose_work.h"
#include "progress.h"

enum { LONG = 800, SHORT = 160, MOST_RECORDS = 8, MOST_EFFECTS = 64 };
static const double dt_s = 1e-3;

static const char beam_text[] = "format: beamfit-model/1\n"
                                "beam: {length_m: 0.4, patch_m: [0.02, 0.08]}\n"
                                "parameters:\n"
                                "  EI_beam_Nm2: {value: 0.5}\n"
                                "  EI_patch_Nm2: {value: 0.8}\n"
                                "  rho_beam_kgpm: {value: 0.1, fixed: true}\n"
                                "  rho_patch_kgpm: {value: 0.4, fixed: true}\n"
                                "  cDI_beam_sNm2: {value: 2e-5}\n"
                                "  cDI_patch_sNm2: {value: 1e-5, fixed: true}\n"
                                "  gamma_sNpm2: {value: 0.02, fixed: true}\n"
                                "  Ks_V: {value: 40}\n"
                                "inputs: {hammer_N: {kind: point_force, at_m: 0.05}}\n"
                                "outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.39}}\n"
                                "effects: [%s]\n";

static struct model make(const char *effects)
{
    char text[2048];
    struct bf_error err;
    struct model model;
    const int n = snprintf(text, sizeof text, beam_text, effects);
    if (model_read_text("beam.yaml", text, (size_t)n, &model, &err))
        fail_msg("%s", err.text);
    return model;
}

static double gauss(uint64_t *seed)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++) {
        uint64_t z = (*seed += 0x9E3779B97F4A7C15u);
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
        sum += (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }
    return sum;
}

static void predict(const struct model *model, const struct record *record, double noise, uint64_t seed)
{
    struct bf_error err;
    struct predictor *predictor;
    struct parameter_ref *refs;
    struct prediction y;
    const char *name = record_base_name(record);
    if (predictor_new(model, record, 1, NULL, &predictor, &err))
        fail_msg("%s", err.text);
    const size_t n = model_parameters(model, &name, 1, &refs);
    double *theta = calloc(n, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
    for (size_t c = 0; c < 2; c++) {
        const double sigma = noise * dense_norm(record->n, y.y + c * record->n) / sqrt((double)record->n);
        for (size_t k = 0; k < record->n; k++)
            record->columns[1 + c].x[k] = y.y[c * record->n + k] + sigma * gauss(&seed);
    }
    free(theta), free(refs);
    predictor_free(predictor);
}

/* A blow of this width and level, from rest, and what the model answers with noise (a share of each channel's rms). */
static struct record blow(const struct model *model, const char *name, size_t n, double width_s, double level,
                          double noise)
{
    double *force = calloc(n, sizeof *force), *nothing = calloc(n, sizeof *nothing);
    struct record record = {.n = n, .dt_s = dt_s, .path = strdup(name)};
    for (size_t k = 0; k < n; k++) {
        const double t = (double)k * dt_s - 0.01;
        force[k] = t > 0.0 && t < width_s ? level * 0.5 * (1.0 - cos(2.0 * M_PI * t / width_s)) : 0.0;
    }
    record_add_column(&record, "hammer_N", force);
    record_add_column(&record, "piezo_V", nothing);
    record_add_column(&record, "tip_mps", nothing);
    free(force), free(nothing);
    predict(model, &record, noise, (uint64_t)strlen(name) * 77u + (uint64_t)name[1]);
    return record;
}

/* Records of one beam: blows r0, r1 … of different width and level. */
struct bench {
    struct model truth, given;
    struct record records[MOST_RECORDS];
    size_t n;
    const char *without[MOST_EFFECTS];
    struct diagnose_options options;
    struct diagnosis d;
};

static bool listed(const char *id, const char *const ids[])
{
    for (size_t i = 0; ids[i] != NULL; i++)
        if (strcmp(ids[i], id) == 0)
            return true;
    return false;
}

/* Only the effects of `ids` are looked at. */
static struct bench *bench_new(const char *truth, size_t n, size_t rows, double noise, const char *const ids[])
{
    struct bench *b = calloc(1, sizeof *b);
    b->truth = make(truth), b->given = make("");
    b->n = n;
    for (size_t r = 0; r < n; r++) {
        const char name[] = {'r', (char)('0' + r), '.', 'c', 's', 'v', '\0'};
        b->records[r] = blow(&b->truth, name, rows, 0.004 + 0.004 * (double)r, r % 2 == 0 ? 1.0 : 10.0, noise);
    }
    for (int i = 0; i < beam_effects_count; i++)
        if (!listed(beam_effects[i]->id, ids))
            b->without[b->options.n_without++] = beam_effects[i]->id;
    b->options.without = b->without;
    b->options.quiet = true;
    b->options.threads = 2;
    b->options.predict.quiet = true;
    return b;
}

static void bench_free(struct bench *b)
{
    diagnose_free(&b->d);
    for (size_t r = 0; r < b->n; r++)
        record_free(&b->records[r]);
    model_free(&b->truth), model_free(&b->given);
    free(b);
}

static void diagnose(struct bench *b, size_t n_records, size_t n_checks)
{
    struct bf_error err;
    if (diagnose_run(&b->given, b->records, n_records, b->records + n_records, n_checks, &b->options, &b->d, &err))
        fail_msg("%s", err.text);
}

static void assert_json_kind(const struct diagnosis *d, const char *kind)
{
    char *text = NULL, expected[64];
    size_t size = 0;
    struct bf_error err;
    FILE *out = open_memstream(&text, &size);
    assert_int_equal(json_print_and_free(diagnose_json(d), out, &err), BF_OK);
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
        double sigma[4], chi2;
        for (size_t c = 0; c < 4; c++)
            sigma[c] = b->d.noise[c].rms;
        const struct record *kept = &b->records[1 - out];
        const char *name = record_base_name(kept);
        const struct refit_options options = {.sigma = sigma + 2 * (1 - out)};
        assert_int_equal(refit_run(&model, kept, 1, &options, &fit, &err), BF_OK);
        const size_t n = model_parameters(&model, &name, 1, &refs);
        model_set_parameters(&model, refs, n, fit.value, NULL, &name);
        assert_int_equal(refit_check(&model, &b->records[out], 1, sigma + 2 * out, NULL, &chi2, &ratio[out], &err),
                         BF_OK);
        free(refs);
        refit_free(&fit);
        model_free(&model);
    }
    const double by_hand = sqrt(0.5 * (ratio[0] * ratio[0] + ratio[1] * ratio[1]));
    print_message("%g by hand, %g found, fitted %g\n", by_hand, best->check.noise_ratio, best->fitted.noise_ratio);
    assert_true(fabs(best->check.noise_ratio - by_hand) < 1e-3 * by_hand);
    bench_free(b);
}

/* A mass elsewhere, short records, much noise: a wrong pair bends until both fit, and neither record foretells the other. */
static void an_overfitting_pair_is_refuted(void **state)
{
    (void)state;
    static const char *const wrong[] = {"point_spring", "rotary_inertia", NULL};
    struct bench *b = bench_new("{kind: point_mass, mass_kg: 0.002, at_m: 0.3}", 2, SHORT, 0.09, wrong);
    diagnose(b, 2, 0);
    const struct hypothesis *best = &b->d.hypotheses[0];
    assert_int_equal(best->n_effects, 2);
    assert_true(best->fitted.noise_ratio < 1.05);
    assert_true(best->check.noise_ratio > 1.2);
    assert_int_equal(b->d.verdict, VERDICT_UNKNOWN);
    assert_false(b->d.unconfirmed);
    assert_non_null(strstr(b->d.text, "not predicted from the others"));
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
    struct diagnose_work w = {.d = &b->d, .options = &b->options, .threads = 2, .n_tried = 10, .sigma = sigma};
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
        cmocka_unit_test(an_overfitting_pair_is_refuted),
        cmocka_unit_test(a_value_that_the_others_do_not_tell_is_kept),
        cmocka_unit_test(one_record_is_not_left_out),
        cmocka_unit_test(records_held_out_are_enough),
        cmocka_unit_test(many_records_are_left_out_in_groups),
        cmocka_unit_test(a_refit_that_failed_is_told),
        cmocka_unit_test(an_interrupt_leaves_what_is_known),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
