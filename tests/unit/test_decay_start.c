/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The beginning of a free decay that a recorder's filter has bent is left out; what swings freely from its first sample on stays whole. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "ground/ground.h"
#include "maths/maths.h"
#include "model_fixture.h"
#include "noise/noise.h"
#include "signals.h"

enum { SAMPLES = 2048, RATE_HZ = 1000, FINER = 16, TAPS = 24 * FINER, MODES = 4 };
static const double pi = 3.14159265358979323846;

/* Released at 0: four modes, the highest of which is 60 dB down after 0.2 s; nothing before. */
static double swing(double t_s)
{
    static const double frequency_Hz[MODES] = {11.0, 69.0, 193.0, 378.0}, zeta[MODES] = {0.004, 0.005, 0.008, 0.015},
                        amplitude[MODES] = {1.0, 0.7, 0.5, 0.3};
    double sum = 0.0;
    for (int m = 0; m < MODES && t_s >= 0.0; m++) {
        const double omega = 2.0 * pi * frequency_Hz[m];
        sum += amplitude[m] * exp(-zeta[m] * omega * t_s) * cos(omega * t_s + 0.7 * m);
    }
    return sum;
}

/* A low-pass of 0.4 of the rate without delay: a sinc under a Hann window; of it the part that the samples before the release do not know of is 0. */
static double filtered(double t_s)
{
    static double h[2 * TAPS + 1], sum;
    for (int j = -TAPS; j <= TAPS && !(sum > 0.0 && j == -TAPS); j++) {
        const double x = 0.8 * pi * j / FINER;
        h[TAPS + j] = (j == 0 ? 1.0 : sin(x) / x) * (0.5 + 0.5 * cos(pi * j / TAPS));
    }
    if (!(sum > 0.0))
        for (int j = 0; j <= 2 * TAPS; j++)
            sum += h[j];
    double y = 0.0;
    for (int j = -TAPS; j <= TAPS; j++)
        y += h[TAPS + j] * swing(t_s - (double)j / (FINER * RATE_HZ));
    return y / sum;
}

static struct record decay(double (*of_time)(double), unsigned seed, const char *excitation)
{
    static double y[SAMPLES];
    struct record record = {.n = SAMPLES, .dt_s = 1.0 / RATE_HZ, .t0_s = 0.25, .path = strdup("decay.csv")};
    uint64_t dice = signal_seed(seed);
    for (size_t k = 0; k < SAMPLES; k++)
        y[k] = of_time((double)k / RATE_HZ) + 0.002 * signal_normal(&dice);
    record_add_column(&record, "tip_mps", y);
    record_add_meta(&record, "excitation", excitation);
    return record;
}

/* Samples that are cut; the record says from when it is free. */
static size_t cut_of(const struct model *model, struct record *record)
{
    struct record *const records[] = {record};
    struct decay_start_list found;
    struct bf_error err;
    assert_int_equal(decay_starts_cut(model, records, 1, &found, &err), BF_OK);
    const size_t n = found.n > 0 ? found.all[0].n : 0;
    if (n > 0) {
        assert_int_equal(record_free_from(record), n);
        assert_string_equal(found.all[0].channel, "tip_mps");
        assert_true(found.all[0].times > 10.0);
    }
    decay_starts_free(&found);
    return n;
}

static void what_swings_freely_stays_whole(void **state)
{
    for (unsigned seed = 1; seed <= 40; seed++) {
        struct record record = decay(swing, seed, "free_decay");
        assert_int_equal(cut_of(*state, &record), 0);
        assert_null(record_meta(&record, "free_from_s"));
        record_free(&record);
    }
}

/* What is left then follows: nothing more is cut of it. */
static void what_a_filter_has_bent_is_cut(void **state)
{
    for (unsigned seed = 1; seed <= 10; seed++) {
        struct record record = decay(filtered, seed, "free_decay");
        const size_t n = cut_of(*state, &record);
        assert_true(n >= 3 && n <= 16);
        struct record rest = {.n = SAMPLES - n, .dt_s = record.dt_s, .path = strdup("rest.csv")};
        record_add_column(&rest, "tip_mps", record_column(&record, "tip_mps") + n);
        record_add_meta(&rest, "excitation", "free_decay");
        assert_int_equal(cut_of(*state, &rest), 0);
        record_free(&record), record_free(&rest);
    }
}

static void what_the_record_says_is_not_touched(void **state)
{
    struct record stated = decay(filtered, 1, "free_decay"), driven = decay(filtered, 1, "recorded");
    record_add_meta(&stated, "free_from_s", "0.25");
    assert_int_equal(cut_of(*state, &stated), 0);
    assert_string_equal(record_meta(&stated, "free_from_s"), "0.25");
    assert_int_equal(cut_of(*state, &driven), 0);
    record_free(&stated), record_free(&driven);
}

/* Too short to tell; and a channel that never moves. */
static void short_and_silent_records_are_left_alone(void **state)
{
    struct record record = decay(filtered, 1, "free_decay");
    record.n = 150;
    assert_int_equal(cut_of(*state, &record), 0);
    record.n = SAMPLES;
    memset(record.columns[0].x, 0, SAMPLES * sizeof(double));
    assert_int_equal(cut_of(*state, &record), 0);
    record_free(&record);
}

static int setup(void **state)
{
    static struct model model;
    fixture_model(&model, "");
    *state = &model;
    return 0;
}

static int teardown(void **state)
{
    model_free(*state);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_swings_freely_stays_whole),
        cmocka_unit_test(what_a_filter_has_bent_is_cut),
        cmocka_unit_test(what_the_record_says_is_not_touched),
        cmocka_unit_test(short_and_silent_records_are_left_alone),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
