/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "record/record.h"
#include "test_files.h"

static struct beam_live sample(uint32_t sequence, uint32_t step)
{
    return (struct beam_live){.sequence = sequence,
                              .step = step,
                              .input = 0.5F + (float)step,
                              .measured = 1.0F / 3.0F + (float)step,
                              .predicted = 0.25F * (float)step,
                              .residual = -0.125F,
                              .ratio = 1.5F,
                              .codes = 0x0FFF0ABC,
                              .status = 0xFEu << BEAM_LIVE_COUNTER};
}

/* Samples from..to−1 of a model that was put to rest at `origin`. */
static void add(struct recording *r, uint32_t from, uint32_t to, uint32_t origin)
{
    for (uint32_t s = from; s != to; s += r->prescale) {
        const struct beam_live live = sample(s, s - origin);
        recording_add(r, &live);
    }
}

static void a_whole_recording(void **state)
{
    (void)state;
    struct recording r;
    recording_begin(&r, 1000.0, 1);
    add(&r, 500, 600, 500);
    const struct recording_summary s = recording_summarise(&r);
    assert_int_equal(s.from, 0);
    assert_int_equal(s.n, 100);
    assert_int_equal(s.breaks, 0);
    assert_int_equal(s.lost, 0);
    assert_float_equal(s.noise_ratio, 1.5, 1e-6);
    recording_free(&r);
}

/* The longest of three stretches, at the beginning, in the middle and at the end. */
static void the_longest_stretch_is_found(void **state)
{
    (void)state;
    static const uint32_t cuts[3][2] = {{150, 180}, {30, 160}, {20, 60}},
                          longest[3][2] = {{0, 150}, {33, 127}, {61, 139}};
    for (int i = 0; i < 3; i++) {
        struct recording r;
        uint64_t lost;
        recording_begin(&r, 1000.0, 1);
        add(&r, 0, cuts[i][0], 0);
        add(&r, cuts[i][0] + 3, cuts[i][1], 0); /* 3 lost, then 1 */
        add(&r, cuts[i][1] + 1, 200, 0);
        const struct recording_summary s = recording_summarise(&r);
        assert_int_equal(s.breaks, 2);
        assert_int_equal(s.lost, 4);
        assert_int_equal(r.live[s.from].sequence, longest[i][0]);
        assert_int_equal(s.n, longest[i][1]);
        assert_int_equal(recording_between(&r, cuts[i][0] - 1, &lost), RECORDING_LOST);
        assert_int_equal(lost, 3);
        recording_free(&r);
    }
}

static void rest_and_another_model_are_holes(void **state)
{
    (void)state;
    struct recording r;
    uint64_t lost;
    recording_begin(&r, 1000.0, 1);
    add(&r, 0, 10, 0);
    add(&r, 10, 20, 10);
    assert_int_equal(recording_between(&r, 9, &lost), RECORDING_REST);
    assert_int_equal(lost, 0);
    for (size_t i = 15; i < 20; i++)
        r.live[i].status = 0xFFu << BEAM_LIVE_COUNTER;
    assert_int_equal(recording_between(&r, 14, &lost), RECORDING_MODEL);
    assert_int_equal(recording_summarise(&r).n, 10);
    assert_int_equal(recording_summarise(&r).breaks, 2);
    recording_free(&r);
}

static void prescaled_samples_are_whole_and_can_be_lost(void **state)
{
    (void)state;
    struct recording r;
    uint64_t lost;
    recording_begin(&r, 1000.0, 5);
    add(&r, 3, 53, 0);
    assert_int_equal(recording_summarise(&r).breaks, 0);
    add(&r, 63, 73, 0);
    assert_int_equal(recording_summarise(&r).breaks, 1);
    assert_int_equal(recording_summarise(&r).lost, 2);
    assert_int_equal(recording_between(&r, 9, &lost), RECORDING_LOST);
    const struct beam_live off = sample(74, 74); /* not a multiple behind the last */
    recording_add(&r, &off);
    assert_int_equal(recording_between(&r, 11, &lost), RECORDING_LOST);
    recording_free(&r);
}

/* Damaged or repeated samples never go back in time; the sequence may wrap. */
static void sequences_rise_and_wrap(void **state)
{
    (void)state;
    struct recording r;
    recording_begin(&r, 1000.0, 1);
    add(&r, 0xFFFFFFF0u, 0x10, 0xFFFFFF00u);
    assert_int_equal(r.n, 32);
    const struct beam_live old = sample(0xFFFFFFF5u, 0xF5);
    recording_add(&r, &old);
    assert_int_equal(r.n, 32);
    assert_int_equal(recording_summarise(&r).breaks, 0);
    recording_drop_before(&r, 0xFFFFFFFEu);
    assert_int_equal(r.n, 18);
    recording_drop_after(&r, 2);
    assert_int_equal(r.n, 5);
    assert_int_equal(r.live[4].sequence, 2);
    recording_drop_before(&r, 100);
    assert_int_equal(r.n, 0);
    recording_free(&r);
}

static void a_record_keeps_every_bit(void **state)
{
    (void)state;
    struct recording r;
    struct record written, read;
    struct bf_error err;
    char *path = temporary_file("recording.csv", "", 0);
    recording_begin(&r, 1000.0, 1);
    add(&r, 4294967000u, 4294967100u, 4294967000u);
    const struct recording_summary s = recording_summarise(&r);
    assert_int_equal(recording_make_record(&r, &s, "drive_V", "piezo_V", 0, &written, &err), BF_OK);
    assert_int_equal(record_write(path, &written, RECORDING_DIGITS, &err), BF_OK);
    assert_int_equal(record_read(path, &read, &err), BF_OK);
    assert_int_equal(read.n, 100);
    assert_int_equal(read.n_columns, 11);
    assert_float_equal(read.dt_s, 1e-3, 1e-12);
    assert_true(read.t0_s == 0.0);
    assert_string_equal(record_meta(&read, "start"), "model at rest, step 0");
    for (size_t i = 0; i < read.n; i++) {
        assert_true((float)record_column(&read, "piezo_V")[i] == r.live[i].measured);
        assert_true((float)record_column(&read, "drive_V")[i] == r.live[i].input);
        assert_true((uint32_t)record_column(&read, "sequence")[i] == r.live[i].sequence);
        assert_true((uint32_t)record_column(&read, "status")[i] == r.live[i].status);
        assert_true((uint32_t)record_column(&read, "codes")[i] == r.live[i].codes);
    }
    unlink(path);
    free(path);
    record_free(&read);
    record_free(&written);
    recording_free(&r);
}

/* What the board measured late stands beside the input it belongs to; what it computed stands where it computed it. */
static void latency_is_undone(void **state)
{
    (void)state;
    struct recording r;
    struct record record;
    struct bf_error err;
    recording_begin(&r, 1000.0, 1);
    add(&r, 0, 50, 0);
    const struct recording_summary s = recording_summarise(&r);
    assert_int_equal(recording_make_record(&r, &s, "u", "y", 3, &record, &err), BF_OK);
    assert_int_equal(record.n, 47);
    assert_true((float)record_column(&record, "u")[10] == r.live[10].input);
    assert_true((float)record_column(&record, "y")[10] == r.live[13].measured);
    assert_true(record_column(&record, "step")[10] == 10.0);
    assert_true((float)record_column(&record, "predicted")[10] == r.live[10].predicted);
    record_free(&record);
    recording_free(&r);
}

static void a_late_start_is_said(void **state)
{
    (void)state;
    struct recording r;
    struct record record;
    struct bf_error err;
    recording_begin(&r, 1000.0, 1);
    add(&r, 100, 150, 0);
    struct recording_summary s = recording_summarise(&r);
    assert_int_equal(recording_make_record(&r, &s, "u", "y", 0, &record, &err), BF_OK);
    assert_string_equal(record_meta(&record, "start"), "in motion, step 100");
    assert_true(record.t0_s == 0.0);
    record_free(&record);
    recording_free(&r);
    recording_begin(&r, 1000.0, 5);
    add(&r, 103, 203, 100);
    s = recording_summarise(&r);
    assert_int_equal(recording_make_record(&r, &s, "u", "y", 0, &record, &err), BF_OK);
    assert_float_equal(record.t0_s, 3e-3, 1e-12);
    assert_float_equal(record.dt_s, 5e-3, 1e-12);
    record_free(&record);
    recording_free(&r);
}

static void too_little_is_no_record(void **state)
{
    (void)state;
    struct recording r;
    struct record record;
    struct bf_error err;
    recording_begin(&r, 1000.0, 1);
    for (uint32_t i = 0; i < 10; i++) {
        const struct recording_summary s = recording_summarise(&r);
        assert_true(s.n <= 1);
        assert_int_equal(recording_make_record(&r, &s, "u", "y", 0, &record, &err), BF_DEVICE);
        add(&r, 2 * i, 2 * i + 1, 0); /* every other one is lost */
    }
    recording_free(&r);
}

static void many_gaps_are_counted_not_listed(void **state)
{
    (void)state;
    struct recording r;
    struct record record;
    struct bf_error err;
    size_t named = 0;
    recording_begin(&r, 1000.0, 1);
    for (uint32_t i = 0; i < 500; i++)
        add(&r, 3 * i, 3 * i + 2, 0);
    const struct recording_summary s = recording_summarise(&r);
    assert_int_equal(s.breaks, 499);
    assert_int_equal(recording_make_record(&r, &s, "u", "y", 0, &record, &err), BF_OK);
    for (size_t i = 0; i < record.n_meta; i++)
        named += strcmp(record.meta[i].key, "gap") == 0;
    assert_int_equal(named, 101);
    assert_string_equal(record.meta[record.n_meta - 1].value, "and 399 more");
    record_free(&record);
    recording_free(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_whole_recording),
        cmocka_unit_test(the_longest_stretch_is_found),
        cmocka_unit_test(rest_and_another_model_are_holes),
        cmocka_unit_test(prescaled_samples_are_whole_and_can_be_lost),
        cmocka_unit_test(sequences_rise_and_wrap),
        cmocka_unit_test(a_record_keeps_every_bit),
        cmocka_unit_test(latency_is_undone),
        cmocka_unit_test(a_late_start_is_said),
        cmocka_unit_test(too_little_is_no_record),
        cmocka_unit_test(many_gaps_are_counted_not_listed),
    };
    return cmocka_run_group_tests_name("recording", tests, NULL, NULL);
}
