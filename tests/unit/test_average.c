/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Repeated hits of the truth simulator's beam as one frequency response: exact without noise, and its coherence is the noise that it has. */
#include "truth_hit.h"

#include <complex.h>
#include <stdio.h>

#include "signals.h"

enum { HITS = 5 };

/* Hits of other strength, at other times, of other length. noise: of each channel's largest value. */
static struct record hit(unsigned k, double at_m, double noise)
{
    struct truth_spec spec;
    char line[160];
    uint64_t seed = signal_seed(70 + k);
    truth_spec_default(&spec);
    spec.length_m = 0.35;
    spec.n_regions = 1;
    spec.region[0] = (struct truth_region){0, 0.35, 100.0, 1.21, 6e-4, 3e-6};
    spec.gamma_sNpm2 = 4.0;
    spec.sample_rate_Hz = 2048;
    spec.duration_s = 1.5 + 0.1 * k;
    spec.modes = 20;
    (void)snprintf(line, sizeof line, "input hammer_N point_force at_m=%.3f", at_m);
    say(&spec, line);
    say(&spec, "output accel_mps2 acceleration at_m=0.28");
    (void)snprintf(line, sizeof line, "signal hammer_N raised_cosine start_s=%.3f width_s=0.002 level=%u",
                   0.05 + 0.0133 * k, 40 + 10 * k);
    say(&spec, line);
    struct record record = hit_of(&spec);
    double *x = (double *)record_column(&record, "accel_mps2"), most = 0.0;
    for (size_t i = 0; i < record.n; i++)
        most = fmax(most, fabs(x[i]));
    for (size_t i = 0; i < record.n; i++)
        x[i] += noise * most * signal_normal(&seed);
    return record;
}

/* Of HITS hits, one of them elsewhere (HITS: none). */
static enum bf_status average_of(double noise, unsigned odd, struct record *out, struct average *average,
                                 struct bf_error *err)
{
    struct record records[HITS];
    const struct average_options how = {.to_Hz = 400.0, .window_s = 0.2};
    for (unsigned k = 0; k < HITS; k++)
        records[k] = hit(k, k == odd ? 0.27 : 0.30, noise);
    const enum bf_status status = record_average(records, HITS, &how, out, average, err);
    for (unsigned k = 0; k < HITS; k++)
        record_free(&records[k]);
    return status;
}

static struct record averaged(double noise)
{
    struct record out;
    struct average average;
    struct bf_error err;
    if (average_of(noise, HITS, &out, &average, &err) != BF_OK)
        fail_msg("%s", err.text);
    average_free(&average);
    return out;
}

static double complex line_of(const struct record *lines, size_t k)
{
    return CMPLX(record_column(lines, "accel_mps2/hammer_N_re")[k], record_column(lines, "accel_mps2/hammer_N_im")[k]);
}

/* Without noise every hit has the same response; the coherence of noisy ones tells how far theirs is from it. */
static void the_coherence_is_the_noise(void **state)
{
    (void)state;
    struct record clean = averaged(0.0), noisy = averaged(0.005);
    double told = 0.0, is = 0.0;
    assert_int_equal(clean.n, noisy.n);
    assert_string_equal(record_meta(&noisy, RECORD_AVERAGES), "5");
    for (size_t k = 1; k < clean.n; k++) {
        const double g = record_column(&noisy, "accel_mps2/hammer_N_coherence")[k];
        const double size = cabs(line_of(&noisy, k)), error = cabs(line_of(&noisy, k) - line_of(&clean, k));
        assert_true(1.0 - record_column(&clean, "accel_mps2/hammer_N_coherence")[k] < 1e-4);
        told += size * size * (1.0 - g) / (g * (HITS - 1)), is += error * error;
    }
    assert_true(is > 0.0 && fabs(told / is - 1.0) < 0.2); /* 586 lines, half of them independent: 6 % */
    record_free(&clean), record_free(&noisy);
}

/* The window's own damping is off again: what reads the lines predicts them (RECORD_WINDOW), so they must move with it. */
static void a_window_is_stated_and_taken_as_asked(void **state)
{
    (void)state;
    struct record out = averaged(0.0);
    double window_s;
    assert_true(out.over_frequency && record_meta_number(&out, RECORD_WINDOW, &window_s));
    assert_true(fabs(window_s - 0.2) < 1e-9);
    assert_true((double)(out.n - 1) * out.dt_s <= 400.0 && (double)out.n * out.dt_s > 400.0);
    struct record period;
    struct bf_error err;
    assert_int_equal(record_from_response(&out, &period, &err), BF_OK);
    assert_true(fabs(record_window_rate(&period) - 5.0) < 1e-6);
    record_free(&out), record_free(&period);
}

static void a_hit_elsewhere_stands_out(void **state)
{
    (void)state;
    struct record out;
    struct average average;
    struct bf_error err;
    assert_int_equal(average_of(0.001, 2, &out, &average, &err), BF_OK);
    assert_int_equal(average.n_outputs, 1);
    assert_true(average.agree[0].stands_out && average.agree[0].odd == 2);
    assert_true(average.agree[0].odd_nrmse > 10.0 * average.agree[0].others_nrmse);
    average_free(&average);
    record_free(&out);
}

static void expect_refusal(struct record records[], size_t n, const char *input, enum bf_status status,
                           const char *word)
{
    const struct average_options how = {.input = input};
    struct record out;
    struct average average;
    struct bf_error err;
    assert_int_equal(record_average(records, n, &how, &out, &average, &err), status);
    if (strstr(err.text, word) == NULL)
        fail_msg("'%s' says nothing of '%s'", err.text, word);
}

static void what_does_not_go_together_is_refused(void **state)
{
    (void)state;
    struct record records[2] = {hit(0, 0.30, 0.0), hit(1, 0.30, 0.0)};
    expect_refusal(records, 1, NULL, BF_USAGE, "2 to 64");
    expect_refusal(records, 2, "thumb_N", BF_USAGE, "thumb_N");
    expect_refusal(records, 2, "accel_mps2", BF_BAD_FILE, "measured answer");
    records[1].dt_s *= 0.5;
    expect_refusal(records, 2, NULL, BF_BAD_FILE, "4096 Hz");
    records[1].dt_s *= 2.0;
    record_add_meta(&records[1], "hammer_N.at_m", "0.2");
    expect_refusal(records, 2, NULL, BF_BAD_FILE, "hammer_N.at_m");
    record_add_meta(&records[0], "excitation", "free_decay");
    expect_refusal(records, 2, NULL, BF_BAD_FILE, "no hit");
    record_free(&records[0]), record_free(&records[1]);
    records[0] = hit(0, 0.30, 0.0), records[1] = hit(1, 0.30, 0.0);
    double *u = (double *)record_column(&records[1], "hammer_N");
    for (size_t i = 0; i < records[1].n; i++)
        u[i] = 0.0;
    expect_refusal(records, 2, NULL, BF_BAD_FILE, "no hit");
    record_free(&records[0]), record_free(&records[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_coherence_is_the_noise),
        cmocka_unit_test(a_window_is_stated_and_taken_as_asked),
        cmocka_unit_test(a_hit_elsewhere_stands_out),
        cmocka_unit_test(what_does_not_go_together_is_refused),
    };
    return cmocka_run_group_tests_name("average", tests, NULL, NULL);
}
