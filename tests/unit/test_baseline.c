/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Zero shifts that differ from record to record are taken off; what is one offset, a single record's or a motion of the beam stays. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "maths/maths.h"
#include "model_fixture.h"
#include "noise/noise.h"
#include "signals.h"

enum { SAMPLES = 4096, RATE_HZ = 512, HIT = 100, RECORDS = 3 };
static const double pi = 3.14159265358979323846, noise = 0.01;

/* The acceleration of a mode that a hit of two samples has set going: with the jump at the hit, so that nothing is left at 0 Hz. */
static double ringing(size_t k, double frequency_Hz, double zeta)
{
    const double omega = 2.0 * pi * frequency_Hz, dt_s = 1.0 / RATE_HZ, t_s = ((double)k - HIT) * dt_s;
    if (k < HIT)
        return 0.0;
    if (k == HIT)
        return 1.0 / dt_s / omega;
    return -exp(-zeta * omega * t_s) * sin(omega * t_s);
}

static double creeping(size_t k, double shift)
{
    return k < HIT ? 0.0 : shift * exp(-((double)k - HIT) / RATE_HZ / 5.0);
}

static struct record hit_with(double shift, double slow_drive, unsigned seed)
{
    static double u[SAMPLES], y[SAMPLES];
    struct record record = {.n = SAMPLES, .dt_s = 1.0 / RATE_HZ, .path = strdup("case.csv")};
    uint64_t dice = signal_seed(seed);
    (void)slow_drive; /* a hit has none */
    for (size_t k = 0; k < SAMPLES; k++) {
        u[k] = k == HIT || k == HIT + 1 ? 20.0 : 0.0;
        y[k] =
            ringing(k, 6.0, 0.004) + 0.5 * ringing(k, 41.0, 0.004) + creeping(k, shift) + noise * signal_normal(&dice);
    }
    record_add_column(&record, "hammer_N", u);
    record_add_column(&record, "accel_mps2", y);
    return record;
}

/*
 * Cut out of steady vibration: a drive of 11.3 Hz that does not end with the record, beside it a mode that dies away. The zero creeps, and the drive may have a
 * share of its own as slow as that.
 */
static struct record driven_with(double shift, double slow_drive, unsigned seed)
{
    static double u[SAMPLES], y[SAMPLES];
    struct record record = {.n = SAMPLES, .dt_s = 1.0 / RATE_HZ, .path = strdup("case.csv")};
    uint64_t dice = signal_seed(seed);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t_s = (double)k / RATE_HZ, slow = cos(2.0 * pi * t_s / 30.0);
        u[k] = 5.0 * sin(2.0 * pi * 11.3 * t_s + 0.4 * seed) + slow_drive * slow;
        y[k] = sin(2.0 * pi * 11.3 * t_s + 1.0) + 0.3 * exp(-0.4 * t_s) * cos(2.0 * pi * 6.0 * t_s) + shift * slow +
               noise * signal_normal(&dice);
    }
    record_add_column(&record, "hammer_N", u);
    record_add_column(&record, "accel_mps2", y);
    record_add_meta(&record, "initial_state", "free");
    return record;
}

/* A record with a zero shift, and what else is asked of it. */
struct rig {
    struct record (*make)(double shift, double slow_drive, unsigned seed);
    double slow_drive;
    const char *key, *mark; /* metadata; NULL: none */
};

/* How many shifts are found; what is left of record i against the same without its shift goes to left[i], over the noise. */
static size_t found_by(const struct rig *rig, const double shift[], size_t n, double left[])
{
    struct model model;
    struct record records[RECORDS], *all[RECORDS];
    struct baseline_list list;
    struct bf_error err;
    fixture_model(&model, "");
    for (size_t i = 0; i < n; i++) {
        records[i] = rig->make(shift[i], rig->slow_drive, (unsigned)i + 1);
        if (rig->mark != NULL)
            record_add_meta(&records[i], rig->key, rig->mark);
        all[i] = &records[i];
    }
    if (baselines_take_off(&model, all, n, &list, &err) != BF_OK)
        fail_msg("%s", err.text);
    const size_t found = list.n;
    baselines_free(&list);
    for (size_t i = 0; i < n; i++) {
        struct record bare = rig->make(0.0, rig->slow_drive, (unsigned)i + 1);
        double away[SAMPLES];
        for (size_t k = 0; k < SAMPLES; k++)
            away[k] = record_column(&records[i], "accel_mps2")[k] - record_column(&bare, "accel_mps2")[k];
        left[i] = root_mean_square(away, SAMPLES) / noise;
        record_free(&bare);
        record_free(&records[i]);
    }
    model_free(&model);
    return found;
}

static size_t found_in(const double shift[], size_t n, double left[], const char *key, const char *mark)
{
    return found_by(&(struct rig){.make = hit_with, .key = key, .mark = mark}, shift, n, left);
}

static size_t found_in_motion(const double shift[], double slow_drive, double left[])
{
    return found_by(&(struct rig){.make = driven_with, .slow_drive = slow_drive}, shift, RECORDS, left);
}

static void a_shift_of_one_record_is_taken_off(void **state)
{
    (void)state;
    const double shift[RECORDS] = {0.0, -0.4, 0.15};
    double left[RECORDS];
    assert_int_equal(found_in(shift, RECORDS, left, "", NULL), 2);
    assert_true(left[0] < 1e-12);
    assert_true(left[1] < 1.5 &&
                left[2] < 1.5); /* of 25 and 10 times the noise; the beam's own share of so slow a series is among it */
}

static void one_offset_of_all_records_stays(void **state)
{
    (void)state;
    const double shift[RECORDS] = {0.3, 0.31, 0.29};
    double left[RECORDS];
    assert_int_equal(found_in(shift, RECORDS, left, "", NULL), 0);
    assert_true(left[0] > 10.0);
}

static void a_single_record_keeps_its_own(void **state)
{
    (void)state;
    const double shift[1] = {0.3};
    double left[1];
    assert_int_equal(found_in(shift, 1, left, "", NULL), 0);
}

static void a_beam_alone_has_none(void **state)
{
    (void)state;
    const double shift[RECORDS] = {0.0, 0.0, 0.0};
    double left[RECORDS];
    assert_int_equal(found_in(shift, RECORDS, left, "", NULL), 0);
}

static void a_zero_that_creeps_beside_a_steady_drive_is_taken_off(void **state)
{
    (void)state;
    const double shift[RECORDS] = {0.0, -0.4, 0.15};
    double left[RECORDS];
    assert_int_equal(found_in_motion(shift, 0.0, left), 2);
    assert_true(left[0] < 1e-12);
    assert_true(left[1] < 0.3 && left[2] < 0.3); /* of 30 and 11 times the noise */
}

/* The drive moves as slowly, and more so: the beam may follow. */
static void what_a_steady_drive_may_do_stays(void **state)
{
    (void)state;
    const double shift[RECORDS] = {0.05, -0.08, 0.06};
    double left[RECORDS];
    assert_int_equal(found_in_motion(shift, 0.0, left), 3);
    assert_int_equal(found_in_motion(shift, 1.0, left), 0);
}

/* A motion that began before the record has a mean of its own. */
static void what_began_in_motion_is_left_alone(void **state)
{
    (void)state;
    const double shift[RECORDS] = {0.0, -0.4, 0.15};
    double left[RECORDS];
    assert_int_equal(found_in(shift, RECORDS, left, "initial_state", "free"), 0);
}

static void what_the_record_states_counts(void **state)
{
    (void)state;
    const double shift[RECORDS] = {0.0, -0.4, 0.15};
    double left[RECORDS];
    assert_int_equal(found_in(shift, RECORDS, left, "baseline", "keep"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_shift_of_one_record_is_taken_off),
        cmocka_unit_test(one_offset_of_all_records_stays),
        cmocka_unit_test(a_single_record_keeps_its_own),
        cmocka_unit_test(a_beam_alone_has_none),
        cmocka_unit_test(a_zero_that_creeps_beside_a_steady_drive_is_taken_off),
        cmocka_unit_test(what_a_steady_drive_may_do_stays),
        cmocka_unit_test(what_began_in_motion_is_left_alone),
        cmocka_unit_test(what_the_record_states_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
