/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "ground/ground.h"
#include "record/record.h"
#include "test_files.h"

/* Reads text as a record file. */
static enum bf_status read_text(const char *text, size_t n, struct record *record, struct bf_error *err)
{
    char *path = temporary_file("record.csv", text, n);
    enum bf_status status = record_read(path, record, err);
    unlink(path);
    free(path);
    return status;
}

/* The text must be refused with every one of the phrases in the message, and nothing left to free. */
static void refuses(const char *text, const char *line, const char *phrase1, const char *phrase2)
{
    struct record record;
    struct bf_error err = {0};
    assert_int_equal(read_text(text, strlen(text), &record, &err), BF_BAD_FILE);
    assert_int_equal(err.status, BF_BAD_FILE);
    assert_contains(err.text, line);
    assert_contains(err.text, phrase1);
    assert_contains(err.text, phrase2);
    assert_null(record.columns);
    assert_int_equal(record.n, 0);
}

static void accepts(const char *text, struct record *record)
{
    struct bf_error err = {0};
    if (read_text(text, strlen(text), record, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static void reads_a_plain_record(void **state)
{
    (void)state;
    const char *text = "# rig: B1, desk 4\n#\n# just a remark\n# excitation: unknown_level\ntime_s,hammer_N,piezo_V\n"
                       "0,1,-1e-3\n0.5,2.5,1.340617e-316\n1,-3,1e22\n# late: comment\n";
    struct record record;
    accepts(text, &record);
    assert_int_equal(record.n, 3);
    assert_int_equal(record.n_columns, 2);
    assert_string_equal(record.columns[1].name, "piezo_V");
    assert_true(record.t0_s == 0 && record.dt_s == 0.5);
    assert_true(record_column(&record, "hammer_N")[1] == 2.5);
    assert_true(record_column(&record, "piezo_V")[1] == 1.340617e-316);
    assert_true(record_column(&record, "piezo_V")[2] == 1e22);
    assert_null(record_column(&record, "time_s"));
    assert_string_equal(record_meta(&record, "rig"), "B1, desk 4");
    assert_string_equal(record_meta(&record, "excitation"), "unknown_level");
    assert_null(record_meta(&record, "late"));
    char hex[65];
    hash_sha256_hex(text, strlen(text), hex);
    assert_string_equal(record.sha256, hex);
    record_free(&record);
}

static void forgives_line_ends_marks_blanks_and_quotes(void **state)
{
    (void)state;
    struct record record;
    accepts("\xef\xbb\xbf \"time_s\" , 'a_V' ,b\r\n0, 1 ,\"2\"\r\n 1,\t3, 4\r\n2 ,5,6\r\n\r\n  \r\n\n", &record);
    assert_int_equal(record.n, 3);
    assert_string_equal(record.columns[0].name, "a_V");
    assert_true(record_column(&record, "b")[0] == 2 && record_column(&record, "b")[2] == 6);
    record_free(&record);
    accepts("time_s,x\n0,1\n1,2", &record); /* no newline at the end */
    assert_int_equal(record.n, 2);
    record_free(&record);
}

static void names_what_is_wrong_with_the_header(void **state)
{
    (void)state;
    refuses("", "", "empty", "header row");
    refuses("# only: this\n", ":1:", "no header row", "time_s");
    refuses("0,1\n1,2\n", ":1:", "column 1", "header row");
    refuses("t,x\n0,1\n1,2\n", ":1:", "'t'", "must be 'time_s'");
    refuses("x,time_s\n1,0\n2,1\n", ":1:", "column 1 'x'", "time_s");
    refuses("\ntime_s;x\n0;1\n1;2\n", ":2:", "';'", "beamfit import");
    refuses("time_s\tx\n0\t1\n", ":1:", "tabs", "beamfit import");
    refuses("time_s,x,x\n0,1,2\n", ":1:", "column 3 'x'", "twice");
    refuses("time_s,time_s\n0,1\n", ":1:", "column 2", "twice");
    refuses("time_s,,x\n0,1,2\n", ":1:", "column 2", "no name");
    refuses("time_s\n0\n1\n", ":1:", "no column but time_s", "add");
}

static void names_line_and_column_of_a_bad_number(void **state)
{
    (void)state;
    refuses("time_s,x,y\n0,1,2\n1,nan,2\n", ":3:", "column 2 'x'", "'nan' is not a finite number");
    refuses("time_s,x,y\n0,1,2\n1,1,-Inf\n", ":3:", "column 3 'y'", "'-Inf' is not a finite");
    refuses("time_s,x,y\n0,1,2\n1,--,2\n", ":3:", "column 2 'x'", "'--' is not a number");
    refuses("time_s,x,y\n0,1,N/A\n1,1,2\n", ":2:", "column 3 'y'", "'N/A' is not a number");
    refuses("time_s,x\n0,\"1,5\"\n1,1\n", ":2:", "column 2 'x'", "not a number");
    refuses("time_s,x\n0,'1.5 V'\n1,1\n", ":2:", "'1.5 V' is not a number", "repair");
    refuses("time_s,x\n0,0x10\n1,1\n", ":2:", "'0x10' is not a number", "column 2");
    refuses("time_s,x\n0,1e999\n1,1\n", ":2:", "too large", "column 2");
    refuses("time_s,x\nzero,1\n1,1\n", ":2:", "column 1 'time_s'", "'zero'");
    refuses("time_s,x,y\n0,1,2\n1,,2\n", ":3:", "column 2 'x'", "empty");
    refuses("time_s,x,y\n0,1,2\n1,1\n", ":3:", "column 3 'y' is missing", "2 of 3 cells");
    refuses("time_s,x,y\n0,1,2\n\n1,1,2,3\n", ":4:", "4 cells where the header names 3", "beamfit import");
    refuses("time_s,x,y\n0,1,2,\n1,1,2,\n", ":2:", "4 cells", "remove");
}

static void names_what_is_wrong_with_the_time(void **state)
{
    (void)state;
    refuses("time_s,x\n0,1\n", ":2:", "one sample", "two");
    refuses("time_s,x\n", ":1:", "no samples", "two");
    refuses("time_s,x\n0,1\n1,1\n1,1\n3,1\n", ":4:", "does not increase", "1 s after 1 s");
    refuses("time_s,x\n0,1\n1,1\n0.5,1\n3,1\n", ":4:", "does not increase", "time_s");
    refuses("time_s,x\n0,1\n.1,1\n.2,1\n.3,1\n.5,1\n.6,1\n.7,1\n", ":6:", "0.2 s here", "samples missing");
    refuses("time_s,x\n0.00,1\n0.10,1\n0.20,1\n0.25,1\n0.40,1\n0.50,1\n", ":5:", "not uniform", "--rate");
}

/* A jump of one sample anywhere is found where it is, even when time is printed to whole samples. */
static void finds_a_missing_sample_anywhere(void **state)
{
    (void)state;
    const size_t n = 400;
    for (size_t gap = 2; gap < n; gap += 7) {
        for (int coarse = 0; coarse < 2; coarse++) {
            char *text = NULL, line[40];
            size_t size;
            FILE *f = open_memstream(&text, &size);
            fprintf(f, "time_s,x\n");
            for (size_t k = 0; k < n; k++)
                fprintf(f, coarse ? "%.3f,1\n" : "%.9g,1\n", 0.001 * (double)(k < gap ? k : k + 1));
            fclose(f);
            snprintf(line, sizeof line, ":%zu:", gap + 2);
            refuses(text, line, "0.002 s here", "0.001 s elsewhere");
            free(text);
        }
    }
}

static void a_drifting_clock_is_not_uniform(void **state)
{
    (void)state;
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    fprintf(f, "time_s,x\n");
    for (int k = 0; k < 1000; k++)
        fprintf(f, "%.9f,1\n", 0.001 * k + 2e-9 * k * k);
    fclose(f);
    refuses(text, ":", "not uniform", "--rate");
    free(text);
}

/* The step of rounded times is exact when it is a round number or the inverse of one, for every way to print. */
static void recovers_the_step_of_rounded_times(void **state)
{
    (void)state;
    static const char *const formats[] = {"%.7g", "%.6f", "%.9g", "%.17g", "%.6e"};
    static const double steps[] = {1.0 / 1024, 1.0 / 256, 2e-4, 1.0 / 51200 * 16, 1.0 / 3200, 16384e-7, 0.0012345};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
        for (size_t j = 0; j < sizeof steps / sizeof *steps; j++) {
            char *text = NULL;
            size_t size;
            FILE *f = open_memstream(&text, &size);
            fprintf(f, "time_s,x\n");
            for (int k = 0; k < 4096; k++) {
                fprintf(f, formats[i], 0.25 + k * steps[j]);
                fprintf(f, ",1\n");
            }
            fclose(f);
            struct record record;
            accepts(text, &record);
            assert_true(fabs(record.dt_s - steps[j]) <= 1e-15 * steps[j]);
            assert_true(fabs(record.t0_s - 0.25) <= 1e-15);
            record_free(&record);
            free(text);
        }
}

/* A rate that is no round number: the step is the least squares one, good to the rounding of the times. */
static void estimates_an_odd_step(void **state)
{
    (void)state;
    const double step = 0.000977013849271;
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    fprintf(f, "time_s,x\n");
    for (int k = 0; k < 4096; k++)
        fprintf(f, "%.7g,1\n", k * step);
    fclose(f);
    struct record record;
    accepts(text, &record);
    assert_true(fabs(record.dt_s - step) * 4095 < 5e-7);
    record_free(&record);
    free(text);
}

static void ignores_the_locale(void **state)
{
    (void)state;
    struct record record;
    char *old = strdup(setlocale(LC_ALL, NULL));
    if (setlocale(LC_ALL, "de_DE.UTF-8") == NULL)
        print_message("SKIPPED: locale de_DE.UTF-8 is not installed; the rest runs in %s\n", old);
    accepts("time_s,x\n0,1.2345678901234567890123\n1,2.5e-300\n", &record);
    assert_true(record.columns[0].x[0] == 1.2345678901234567890123);
    assert_true(record.columns[0].x[1] == 2.5e-300);
    record_free(&record);
    setlocale(LC_ALL, old);
    free(old);
}

static void refuses_files_that_are_no_text(void **state)
{
    (void)state;
    struct record record;
    struct bf_error err;
    assert_int_equal(record_read("/nonexistent/a.csv", &record, &err), BF_BAD_FILE);
    assert_contains(err.text, "/nonexistent/a.csv: there is no such file");
    assert_int_equal(record_read("/tmp", &record, &err), BF_BAD_FILE);
    assert_contains(err.text, "is a directory");
    assert_int_equal(read_text("time_s,x\n0,1\n1,\0\n", 18, &record, &err), BF_BAD_FILE);
    assert_contains(err.text, ":3: has a zero byte");
    assert_int_equal(read_text("\xff\xfet\0i\0", 6, &record, &err), BF_BAD_FILE);
    assert_contains(err.text, "UTF-16");
    assert_int_equal(read_text("\x89PNG\r\n\x1a\n", 8, &record, &err), BF_BAD_FILE);
    assert_contains(err.text, ":1:");
    size_t n = 3 << 20;
    char *text = malloc(n);
    memset(text, 'a', n);
    assert_int_equal(read_text(text, n, &record, &err), BF_BAD_FILE);
    assert_contains(err.text, ":1: is longer than");
    free(text);
}

static void a_message_is_one_line_without_control_characters(void **state)
{
    (void)state;
    struct record record;
    struct bf_error err;
    const char *text = "time_s,x\n0,\x1b[31mred\x07\n";
    assert_int_equal(read_text(text, strlen(text), &record, &err), BF_BAD_FILE);
    for (const char *c = err.text; *c != '\0'; c++)
        assert_true((unsigned char)*c >= 0x20 && *c != 0x7f);
}

static void checks_the_metadata_it_acts_on(void **state)
{
    (void)state;
    struct record record;
    refuses("# excitation: free decay\ntime_s,x\n0,1\n1,2\n", ":1:", "'# excitation: free decay'", "free_decay");
    refuses("# beam: 1\n# baseline: kept\ntime_s,x\n0,1\n1,2\n", ":2:", "'# baseline: kept'", "write keep");
    refuses("# input_noise:\ntime_s,x\n0,1\n1,2\n", ":1:", "'# input_noise: '", "write keep");
    refuses("# a\n# free_from_s: soon\ntime_s,x\n0,1\n1,2\n", ":2:", "'# free_from_s: soon'", "seconds");
    refuses("# free_from_s: 1\ntime_s,x\n0,1\n1,2\n", "", "free_from_s", "before the last sample");
    accepts("# excitation: free_decay\n# free_from_s: 0.5\ntime_s,x\n0,1\n1,2\n", &record);
    assert_string_equal(record_meta(&record, "free_from_s"), "0.5");
    record_free(&record);
}

/* 17 digits bring every number back bit by bit; metadata and axis too. */
static void writing_and_reading_is_the_identity(void **state)
{
    (void)state;
    enum { N = 3000 };
    double x[N], y[N];
    uint64_t random = 88172645463325252u;
    for (int k = 0; k < N; k++) {
        random ^= random << 13, random ^= random >> 7, random ^= random << 17;
        x[k] = ldexp((double)random, (int)(random % 2000) - 1063) * (random & 4096 ? 1 : -1);
        y[k] = sin(0.01 * k);
        assert_true(isfinite(x[k]));
    }
    struct record record = {.n = N, .t0_s = -0.75, .dt_s = 1.0 / 4096}, back;
    record_add_column(&record, "x_V", x);
    record_add_column(&record, "y_mps2", y);
    record_add_meta(&record, "excitation", "free_decay");
    record_add_meta(&record, "source", "two\nlines");
    char *path = temporary_file("out.csv", "", 0);
    struct bf_error err;
    assert_int_equal(record_write(path, &record, 17, &err), BF_OK);
    assert_int_equal(record_read(path, &back, &err), BF_OK);
    assert_int_equal(back.n, N);
    assert_true(back.t0_s == record.t0_s && back.dt_s == record.dt_s);
    assert_memory_equal(record_column(&back, "x_V"), x, sizeof x);
    assert_memory_equal(record_column(&back, "y_mps2"), y, sizeof y);
    assert_string_equal(record_meta(&back, "source"), "two lines");
    assert_string_equal(record_meta(&back, "excitation"), "free_decay");
    char hex[65];
    assert_int_equal(hash_file(path, hex, &err), BF_OK);
    assert_string_equal(back.sha256, hex);
    record_free(&back);
    assert_int_equal(record_write(path, &record, 0, &err), BF_OK); /* 9 digits */
    assert_int_equal(record_read(path, &back, &err), BF_OK);
    assert_true(back.dt_s == record.dt_s);
    for (int k = 0; k < N; k++)
        assert_true(fabs(back.columns[0].x[k] - x[k]) <= 5.1e-9 * fabs(x[k]));
    record_free(&back);
    record_free(&record);
    unlink(path);
    free(path);
}

static void does_not_write_what_it_would_not_read(void **state)
{
    (void)state;
    double x[3] = {1, NAN, 2}, y[3] = {0};
    struct bf_error err;
    char *path = temporary_file("kept.csv", "kept", 4);
    struct record record = {.n = 3, .dt_s = 1};
    record_add_column(&record, "x", x);
    assert_int_equal(record_write(path, &record, 0, &err), BF_NUMERIC);
    assert_contains(err.text, "'x' is nan at 1 s");
    record_free(&record);
    static const char *const names[] = {"a,b", "", "a\nb", "\"a\"", "time_s"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        record = (struct record){.n = 3, .dt_s = 1};
        record_add_column(&record, names[i], y);
        assert_int_equal(record_write(path, &record, 0, &err), BF_BAD_FILE);
        record_free(&record);
    }
    record = (struct record){.n = 1, .dt_s = 1};
    assert_int_equal(record_write(path, &record, 0, &err), BF_NUMERIC);
    assert_file_is(path, "kept");
    unlink(path);
    free(path);
}

/* Recorders have a filter; what states one, or that there is none, keeps its own, and a frequency response is not bent by one. */
static void a_filter_that_is_not_stated_is_assumed_once(void **state)
{
    (void)state;
    struct record bare = {.n = 10, .dt_s = 1e-3}, none = bare, steady = bare;
    record_add_meta(&none, RECORD_FILTER, "none");
    record_add_meta(&steady, "excitation", RECORD_RESPONSE);
    assert_true(record_assume_filter(&bare));
    assert_string_equal(record_meta(&bare, RECORD_FILTER),
                        "Butterworth order 6 at 390 Hz, forward and backward (assumed)");
    assert_true(record_filter_is_assumed(&bare));
    assert_false(record_assume_filter(&bare));
    assert_false(record_assume_filter(&none));
    assert_string_equal(record_meta(&none, RECORD_FILTER), "none");
    assert_false(record_filter_is_assumed(&none));
    assert_false(record_assume_filter(&steady));
    assert_null(record_meta(&steady, RECORD_FILTER));
    record_free(&bare), record_free(&none), record_free(&steady);
}

static void reads_the_recordings_beside_the_project(void **state)
{
    (void)state;
    static const struct {
        const char *file;
        size_t n, columns;
        double dt_s;
    } files[] = {{"data/open/o0_clean/train1.csv", 4096, 2, 1.0 / 1024},
                 {"data/open/o0_clean/train4.csv", 4096, 3, 1.0 / 1024},
                 {"data/open/o7_viscoelastic/check2.csv", 4096, 3, 1.0 / 1024},
                 {"data/real/silverbox/SNLS80mV.csv", 131072, 2, 16384e-7},
                 {"data/real/uofsc_steel_cantilever/shaker_test1.csv", 63041, 3, 1.0 / 3200}};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        struct record record;
        struct bf_error err = {0};
        char *path = shared_file(files[i].file);
        if (path == NULL)
            skip();
        if (record_read(path, &record, &err) != BF_OK)
            fail_msg("%s", err.text);
        assert_int_equal(record.n, files[i].n);
        assert_int_equal(record.n_columns, files[i].columns);
        assert_true(fabs(record.dt_s / files[i].dt_s - 1) < 1e-15);
        assert_true(record.t0_s == 0);
        record_free(&record);
        free(path);
    }
}

/* The first sample at that time or after it, rounding aside; what is no free decay, or says no time that is in it, begins at 0. */
static void a_free_decay_begins_where_it_says(void **state)
{
    (void)state;
    static const double x[10] = {0};
    for (size_t sample = 1; sample < 10; sample++) {
        struct record record = {.n = 10, .t0_s = 1234.567, .dt_s = 1.0 / 30000.0};
        record_add_column(&record, "tip_m", x);
        record_set_free_from(&record, sample);
        assert_int_equal(record_free_from(&record), 0);
        record_add_meta(&record, "excitation", "free_decay");
        assert_true(record_is_free_decay(&record));
        assert_int_equal(record_free_from(&record), sample);
        record_free(&record);
    }
    static const char *const times[] = {"0.15", "0", "-1", "0.9", "1", "soon"};
    static const size_t first[] = {2, 0, 0, 9, 0, 0};
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        struct record record = {.n = 10, .dt_s = 0.1};
        record_add_column(&record, "tip_m", x);
        record_add_meta(&record, "excitation", "free_decay");
        record_add_meta(&record, "free_from_s", times[i]);
        assert_int_equal(record_free_from(&record), first[i]);
        record_free(&record);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_a_plain_record),
        cmocka_unit_test(forgives_line_ends_marks_blanks_and_quotes),
        cmocka_unit_test(names_what_is_wrong_with_the_header),
        cmocka_unit_test(names_line_and_column_of_a_bad_number),
        cmocka_unit_test(names_what_is_wrong_with_the_time),
        cmocka_unit_test(finds_a_missing_sample_anywhere),
        cmocka_unit_test(a_drifting_clock_is_not_uniform),
        cmocka_unit_test(recovers_the_step_of_rounded_times),
        cmocka_unit_test(estimates_an_odd_step),
        cmocka_unit_test(ignores_the_locale),
        cmocka_unit_test(refuses_files_that_are_no_text),
        cmocka_unit_test(a_message_is_one_line_without_control_characters),
        cmocka_unit_test(checks_the_metadata_it_acts_on),
        cmocka_unit_test(writing_and_reading_is_the_identity),
        cmocka_unit_test(does_not_write_what_it_would_not_read),
        cmocka_unit_test(a_filter_that_is_not_stated_is_assumed_once),
        cmocka_unit_test(a_free_decay_begins_where_it_says),
        cmocka_unit_test(reads_the_recordings_beside_the_project),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
