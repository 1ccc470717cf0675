/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Comparing: what is noise, where a misfit is, what is solved for. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "compare_rig.h"
#include "show/compare_text.h"

static void a_true_model_leaves_the_noise(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    char text[1200];
    make_truth(&model, &record, 0.01, 2);
    struct comparison all = run(&model, &record, 1, 0);
    assert_int_equal(all.n_channels, 2);
    assert_true(all.n_modes == 4 && fabs(all.frequency_Hz[0] - 6.64605) < 1e-3);
    for (size_t i = 0; i < 2; i++) {
        const struct comparison_channel *c = &all.channels[i];
        double shares = 0.0;
        assert_true(fabs(c->nrmse - 0.01) < 5e-4);
        assert_true(fabs(c->noise_ratio - 1.0) < 0.05);
        assert_true(c->whiteness.p_value > 1e-3);
        assert_true(c->inputs[0].correlation.p_value > 1e-3);
        assert_true(isnan(c->inputs[0].coherence)); /* one hit: no averages */
        assert_true(fabs(c->scale - 1.0) < 0.01 && c->alignment > 0.999);
        assert_string_equal(c->warning, "");
        assert_int_equal(c->n_bands, 4);
        for (size_t b = 0; b < c->n_bands; b++) {
            shares += c->bands[b].share;
            assert_int_equal(c->bands[b].mode, b + 1);
            assert_true(fabs(c->bands[b].noise_ratio - 1.0) < 0.35);
        }
        assert_true(fabs(shares - 1.0) < 1e-12);
        compare_summary(&all, c, text, sizeof text);
        assert_contains(text, "nothing is left to explain");
    }
    const double total = sqrt(0.5 * (pow(all.channels[0].nrmse, 2.0) + pow(all.channels[1].nrmse, 2.0)));
    assert_true(fabs(all.nrmse - total) < 1e-15);
    assert_true(isnan(all.check_nrmse));
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static void misfit_is_found_where_it_is(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    char text[1200];
    make_truth(&model, &record, 0.002, 3);
    double *z = column(&record, "piezo_V");
    const double size = 0.3 * signal_rms(z, N);
    for (size_t i = 0; i < N; i++)
        z[i] += size * exp(-3.0 * (double)i * dt) * sin(2.0 * M_PI * 36.0 * (double)i * dt);
    struct comparison all = run(&model, &record, 1, 0);
    const struct comparison_channel *c = channel(&all, 0, "piezo_V");
    assert_true(c->bands[1].share > 0.95 && c->bands[1].mode == 2);
    assert_true(c->time_share[0] > 0.9);
    assert_true(c->whiteness.p_value < 1e-9);
    assert_true(c->noise_ratio > 20.0);
    compare_summary(&all, c, text, sizeof text);
    assert_contains(text, "mode 2");
    assert_contains(text, "first third");
    compare_summary(&all, c, text, 20); /* cut, not overrun */
    assert_int_equal(strlen(text), 19);
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static void a_missing_path_follows_the_input(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    char text[1200];
    make_truth(&model, &record, 0.002, 4);
    double *z = column(&record, "piezo_V");
    const double *u = column(&record, "hammer_N");
    for (size_t i = 9; i < N; i++)
        z[i] += 0.002 * u[i - 9];
    struct comparison all = run(&model, &record, 1, 0);
    const struct comparison_channel *c = channel(&all, 0, "piezo_V");
    assert_true(c->inputs[0].correlation.p_value < 1e-6);
    assert_true(labs(c->inputs[0].correlation.largest_lag - 9) <= 1);
    compare_summary(&all, c, text, sizeof text);
    assert_contains(text, "follows hammer_N");
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static void units_and_signs_are_questioned(void **state)
{
    (void)state;
    static const struct {
        double factor;
        const char *word;
    } cases[] = {{1000.0, "thousandths"},
                 {0.0011, "thousands"},
                 {-1.0, "other way round."},
                 {-950.0, "other way round, and as if it were in thousandths"},
                 {10.0, "decade"},
                 {1.6, ""},
                 {30.0, ""}};
    struct model model = read_model();
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct record record = hit_record("hit.csv");
        make_truth(&model, &record, 0.01, 5);
        double *z = column(&record, "tip_mps");
        for (size_t i = 0; i < N; i++)
            z[i] *= cases[k].factor;
        struct comparison all = run(&model, &record, 1, 0);
        const char *warning = channel(&all, 0, "tip_mps")->warning;
        if (cases[k].word[0] == '\0')
            assert_string_equal(warning, "");
        else
            assert_contains(warning, cases[k].word);
        assert_string_equal(channel(&all, 0, "piezo_V")->warning, "");
        compare_free(&all);
        record_free(&record);
    }
    model_free(&model);
}

static void held_out_records_have_their_own_total(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record records[3] = {hit_record("a.csv"), hit_record("b.csv"), hit_record("check.csv")};
    for (unsigned r = 0; r < 3; r++)
        make_truth(&model, &records[r], r == 2 ? 0.05 : 0.01, 10 + r);
    struct comparison all = run(&model, records, 3, 1);
    assert_int_equal(all.n_channels, 6);
    assert_true(fabs(all.nrmse - 0.01) < 5e-4 && fabs(all.check_nrmse - 0.05) < 3e-3);
    assert_false(all.channels[3].held_out);
    assert_true(all.channels[4].held_out && all.channels[4].record == 2);
    compare_free(&all);
    for (size_t r = 0; r < 3; r++)
        record_free(&records[r]);
    model_free(&model);
}

/* What a free decay can be is what the model leaves when it is compared with itself: the states are solved for. */
static void free_decay_states_are_solved(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("decay.csv");
    record_add_meta(&record, "excitation", "free_decay");
    record_add_meta(&record, "free_from_s", "0.25");
    struct comparison all = run(&model, &record, 1, 0);
    const struct comparison_channel *c = channel(&all, 0, "piezo_V");
    assert_true(c->n == N - 128 && fabs(c->t0_s - 0.25) < 1e-9);
    for (size_t i = 0; i < all.n_channels; i++) { /* measured := a free decay of the model */
        double *z = column(&record, all.channels[i].name);
        memcpy(z + 128, all.channels[i].predicted, (N - 128) * sizeof *z);
    }
    compare_free(&all);
    all = run(&model, &record, 1, 0);
    assert_true(all.nrmse < 1e-6);
    assert_int_equal(all.channels[0].n_inputs, 0);
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static void an_unknown_level_is_solved(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    make_truth(&model, &record, 0.01, 30);
    double *z[2] = {column(&record, "piezo_V"), column(&record, "tip_mps")};
    for (size_t i = 0; i < N; i++) {
        z[0][i] *= 3.7;
        z[1][i] *= 3.7;
    }
    struct comparison known = run(&model, &record, 1, 0);
    assert_true(known.nrmse > 0.5);
    compare_free(&known);
    record_add_meta(&record, "excitation", "unknown_level");
    struct comparison all = run(&model, &record, 1, 0);
    assert_true(fabs(all.level[0] - 3.7) < 0.01);
    assert_true(fabs(all.nrmse - 0.01) < 5e-4);
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

/* ---- An independent simulator's records, with its own answer as the model ---- */

static void other_peoples_truth(void **state)
{
    (void)state;
    char *yaml = shared_file("data/open/o0_clean/model.yaml"), *csv = shared_file("data/open/o0_clean/train4.csv");
    struct model model;
    struct record record;
    struct bf_error err;
    if (yaml == NULL || csv == NULL) {
        free(yaml);
        free(csv);
        skip();
        return;
    }
    assert_int_equal(model_read(yaml, &model, &err), BF_OK);
    assert_int_equal(record_read(csv, &record, &err), BF_OK);
    const double answer[9] = {0.4936302,    0.09200885, 6.29281e-06, 0.7837074, 0.4530721,
                              1.234549e-05, 0.01308902, 40.15837,    0.01787214}; /* of answer.txt */
    struct parameter_ref *refs;
    const char *name = record.path;
    const size_t n = model_parameters(&model, &name, 1, &refs);
    double *value = calloc(n, sizeof *value);
    for (size_t i = 0; i < n; i++)
        value[i] = i < 9 ? answer[i] : refs[i].value;
    model_set_parameters(&model, refs, n, value, NULL, &name);
    struct comparison all = run(&model, &record, 1, 0);
    assert_true(fabs(channel(&all, 0, "tip_mps")->noise_ratio - 1.0) < 0.03);
    compare_free(&all);
    free(value);
    free(refs);
    record_free(&record);
    model_free(&model);
    free(yaml);
    free(csv);
}

static void a_level_that_is_known_badly_lets_more_be_noise(void **state)
{
    (void)state;
    struct comparison_channel c = {.noise_ratio = 1.3, .noise = {.rms = 2.0, .rms_sd = 0.02}};
    assert_false(compare_channel_is_noise(&c));
    c.noise.rms_sd = 0.3;
    assert_true(compare_channel_is_noise(&c));
    c.noise_ratio = NAN;
    assert_false(compare_channel_is_noise(&c));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_level_that_is_known_badly_lets_more_be_noise),
        cmocka_unit_test(a_true_model_leaves_the_noise),
        cmocka_unit_test(misfit_is_found_where_it_is),
        cmocka_unit_test(a_missing_path_follows_the_input),
        cmocka_unit_test(units_and_signs_are_questioned),
        cmocka_unit_test(held_out_records_have_their_own_total),
        cmocka_unit_test(free_decay_states_are_solved),
        cmocka_unit_test(an_unknown_level_is_solved),
        cmocka_unit_test(other_peoples_truth),
    };
    return cmocka_run_group_tests_name("compare", tests, NULL, NULL);
}
