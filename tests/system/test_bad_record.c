/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Bad records, one test per pathology; see refuse_everywhere() in rig.h for what each asserts. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

static void record_with(struct rig *rig, const char *header, int samples, int at_sample, const char *line)
{
    char text[RIG_RECORD_TEXT];
    rig_make_record(text, header, samples, at_sample, line, 1.0);
    write_text(rig->dir, "record.csv", text);
}

static void missing_column(void **state)
{
    record_with(*state, "time_s,other_N,piezo_V", RIG_SAMPLES, -1, "");
    refuse_everywhere(*state, "record.csv", "hammer_N");
}

static void nan_in_a_column(void **state)
{
    record_with(*state, "time_s,hammer_N,piezo_V", RIG_SAMPLES, 10, "0.0390625,0,NaN");
    refuse_everywhere(*state, "record.csv:12", "piezo_V");
}

static void infinity_in_a_column(void **state)
{
    record_with(*state, "time_s,hammer_N,piezo_V", RIG_SAMPLES, 10, "0.0390625,inf,0");
    refuse_everywhere(*state, "record.csv:12", "hammer_N");
}

static void text_in_numbers(void **state)
{
    record_with(*state, "time_s,hammer_N,piezo_V", RIG_SAMPLES, 3, "0.01171875,0.0x,1.5");
    refuse_everywhere(*state, "record.csv:5", "0.0x");
}

static void a_field_too_few(void **state)
{
    record_with(*state, "time_s,hammer_N,piezo_V", RIG_SAMPLES, 3, "0.01171875,0");
    refuse_everywhere(*state, "record.csv:5", "");
}

static void a_field_too_many(void **state)
{
    record_with(*state, "time_s,hammer_N,piezo_V", RIG_SAMPLES, 3, "0.01171875,0,0,0");
    refuse_everywhere(*state, "record.csv:5", "");
}

static void no_header(void **state)
{
    record_with(*state, "0,0,0", RIG_SAMPLES, -1, "");
    refuse_everywhere(*state, "record.csv:1", "header");
}

static void a_column_twice(void **state)
{
    record_with(*state, "time_s,piezo_V,piezo_V", RIG_SAMPLES, -1, "");
    refuse_everywhere(*state, "record.csv:1", "piezo_V");
}

static void one_sample(void **state)
{
    record_with(*state, "time_s,hammer_N,piezo_V", 1, -1, "");
    refuse_everywhere(*state, "record.csv:2", "sample");
}

static void no_sample(void **state)
{
    record_with(*state, "time_s,hammer_N,piezo_V", 0, -1, "");
    refuse_everywhere(*state, "record.csv:1", "sample");
}

static void a_gap_in_time(void **state)
{
    record_with(*state, "time_s,hammer_N,piezo_V", RIG_SAMPLES, 20, "0.0801,0,0");
    refuse_everywhere(*state, "record.csv:22", "time_s");
}

static void time_backwards(void **state)
{
    record_with(*state, "time_s,hammer_N,piezo_V", RIG_SAMPLES, 20, "0.01,0,0");
    refuse_everywhere(*state, "record.csv:22", "time_s");
}

static void empty_record(void **state)
{
    write_text(((struct rig *)*state)->dir, "record.csv", "");
    refuse_everywhere(*state, "record.csv", "empty");
}

static void binary_record(void **state)
{
    unsigned char bytes[4096];
    for (size_t i = 0; i < sizeof bytes; i++)
        bytes[i] = (unsigned char)(i * 167 + i / 256 * 31);
    write_file(((struct rig *)*state)->dir, "record.csv", bytes, sizeof bytes);
    refuse_everywhere(*state, "record.csv:1", "");
}

static void no_such_record(void **state)
{
    run_program(((struct rig *)*state)->dir, (const char *[]){"rm", "record.csv", NULL},
                &((struct rig *)*state)->outcome);
    refuse_everywhere(*state, "record.csv", "no such file");
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(missing_column),  CASE(nan_in_a_column), CASE(infinity_in_a_column),
        CASE(text_in_numbers), CASE(a_field_too_few), CASE(a_field_too_many),
        CASE(no_header),       CASE(a_column_twice),  CASE(one_sample),
        CASE(no_sample),       CASE(a_gap_in_time),   CASE(time_backwards),
        CASE(empty_record),    CASE(binary_record),   CASE(no_such_record),
    };
    return cmocka_run_group_tests_name("bad record", tests, NULL, NULL);
}
