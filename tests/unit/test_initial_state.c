/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A record with an input that was cut out of a motion is found; a hit, a chirp from rest, a short or marked record is not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "model_fixture.h"
#include "noise/noise.h"
#include "signals.h"

enum { SAMPLES = 2048, RATE_HZ = 512 };
static const double pi = 3.14159265358979323846, noise = 0.002;

/* What a hammer and a piezo recorded, both made from time in seconds. */
static struct record record_of(double (*force)(double), double (*answer)(double), size_t n)
{
    static double u[SAMPLES], y[SAMPLES];
    struct record record = {.n = n, .dt_s = 1.0 / RATE_HZ, .path = strdup("case.csv")};
    uint64_t seed = signal_seed(3);
    for (size_t k = 0; k < n; k++) {
        const double t_s = (double)k / RATE_HZ;
        u[k] = force(t_s);
        y[k] = answer(t_s) + noise * signal_normal(&seed);
    }
    record_add_column(&record, "hammer_N", u);
    record_add_column(&record, "piezo_V", y);
    return record;
}

static double tone(double t_s)
{
    return 3.0 * sin(2.0 * pi * 12.0 * t_s + 0.4);
}
static double shifted_tone(double t_s)
{
    return 1.5 + sin(2.0 * pi * 12.0 * t_s - 1.1); /* about an offset */
}
static double building_up(double t_s)
{
    return (1.0 - exp(-t_s / 0.5)) * sin(2.0 * pi * 12.0 * t_s);
}
static double hit(double t_s)
{
    return t_s > 0.1 && t_s < 0.11 ? 20.0 : 0.0;
}
static double rings(double t_s)
{
    return t_s > 0.1 ? exp(-(t_s - 0.1) / 0.3) * sin(2.0 * pi * 14.0 * (t_s - 0.1)) : 0.0;
}
static double nothing(double t_s)
{
    (void)t_s;
    return 0.0;
}

/* Marked, and what the mark says afterwards. */
static void expect(struct record *record, bool wanted, const char *says)
{
    struct model model;
    struct bf_error err;
    bool found;
    fixture_model(&model, "");
    if (initial_state_find(&model, record, &found, &err) != BF_OK)
        fail_msg("%s", err.text);
    const char *mark = record_meta(record, "initial_state");
    assert_int_equal(found, wanted);
    if (says == NULL)
        assert_null(mark);
    else
        assert_string_equal(mark, says);
    assert_int_equal(record_state_is_free(record), says != NULL && strcmp(says, "free") == 0);
    model_free(&model);
    record_free(record);
}

static void steady_vibration_is_found(void **state)
{
    (void)state;
    struct record record = record_of(tone, shifted_tone, SAMPLES);
    expect(&record, true, "free");
}

static void what_began_at_rest_is_not(void **state)
{
    (void)state;
    double (*const cases[][2])(double) = {{hit, rings}, {tone, building_up}, {tone, nothing}, {hit, shifted_tone}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct record record = record_of(cases[i][0], cases[i][1], SAMPLES);
        expect(&record, false, NULL);
    }
}

/* Five periods do not tell what a mean period is. */
static void too_short_a_record_is_left_alone(void **state)
{
    (void)state;
    struct record record = record_of(tone, shifted_tone, RATE_HZ / 3);
    expect(&record, false, NULL);
}

static void what_the_record_states_counts(void **state)
{
    (void)state;
    static const char *const stated[] = {"rest", "free"};
    for (size_t i = 0; i < sizeof stated / sizeof *stated; i++) {
        struct record record = record_of(tone, shifted_tone, SAMPLES);
        record_add_meta(&record, "initial_state", stated[i]);
        expect(&record, false, stated[i]);
    }
    struct record record = record_of(tone, shifted_tone, SAMPLES);
    record_add_meta(&record, "excitation", "periodic");
    expect(&record, false, NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steady_vibration_is_found),
        cmocka_unit_test(what_began_at_rest_is_not),
        cmocka_unit_test(too_short_a_record_is_left_alone),
        cmocka_unit_test(what_the_record_states_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
