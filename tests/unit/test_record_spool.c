/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A record whose samples lie in a file is the record in memory: axis, samples, and what is said of a bad one. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>
#include "ground/ground.h"
#include "record/record.h"
#include "test_files.h"

enum { N = 10000, ROOM = 64 }; /* more than two blocks of times */

/* A record of N samples; the time of one of them is moved by so much. */
static char *make_text(size_t moved, double by_s)
{
    char *text = bf_alloc(N * ROOM + 256, 1), *end = text;
    end += sprintf(end, "# rig: B1\ntime_s,hammer_N,tip_mps\n");
    for (size_t k = 0; k < N; k++) {
        if (k == 70)
            end += sprintf(end, "\n# a remark\n");
        end += sprintf(end, "%.6f,%.9g,%.9g\n", 0.25 + (double)k / 1024.0 + (k == moved ? by_s : 0.0), 0.5 * (double)k,
                       1.0 / (double)(k + 1));
    }
    return text;
}

/* Both ways of reading. */
static enum bf_status read_both(const char *text, struct record *record, struct record_spool *spool,
                                struct bf_error err[2])
{
    char *path = temporary_file("long.csv", text, strlen(text));
    const enum bf_status one = record_read(path, record, &err[0]);
    const enum bf_status other = record_spool_read(path, path, spool, &err[1]);
    unlink(path);
    free(path);
    assert_int_equal(one, other);
    return one;
}

static void the_file_has_what_memory_has(void **state)
{
    (void)state;
    struct bf_error err[2];
    struct record record;
    struct record_spool spool;
    char *text = make_text(N, 0.0);
    double *x = bf_alloc(N, sizeof *x);
    assert_int_equal(read_both(text, &record, &spool, err), BF_OK);
    assert_true(spool.in_file);
    assert_int_equal(spool.record.n, N);
    assert_true(spool.record.t0_s == record.t0_s && spool.record.dt_s == record.dt_s);
    assert_string_equal(spool.record.sha256, record.sha256);
    assert_string_equal(record_meta(&spool.record, "rig"), "B1");
    for (size_t c = 0; c < 2; c++) {
        record_spool_take(&spool, c, 4095, 3000, x);
        assert_memory_equal(x, record.columns[c].x + 4095, 3000 * sizeof *x);
    }
    record_spool_take(&spool, 1, N - 10, 20, x); /* zeros behind the end */
    assert_memory_equal(x, record.columns[1].x + N - 10, 10 * sizeof *x);
    assert_true(x[10] == 0.0 && x[19] == 0.0);
    assert_false(record_spool_failed(&spool));
    assert_int_equal(record_spool_load(&spool, &err[1]), BF_OK);
    for (size_t c = 0; c < 2; c++)
        assert_memory_equal(spool.record.columns[c].x, record.columns[c].x, N * sizeof *x);
    record_spool_close(&spool);
    record_free(&record);
    free(text), free(x);
}

static void the_same_is_said_of_a_bad_one(void **state)
{
    (void)state;
    static const double moves[] = {0.02, -0.0009, 0.0004};
    for (size_t i = 0; i < sizeof moves / sizeof *moves; i++) {
        struct bf_error err[2];
        struct record record;
        struct record_spool spool;
        char *text = make_text(9000, moves[i]);
        assert_int_equal(read_both(text, &record, &spool, err), BF_BAD_FILE);
        assert_string_equal(err[0].text, err[1].text);
        assert_contains(err[0].text, ":900"); /* 9005 or 9006: two lines of remarks, two of the head */
        free(text);
    }
}

/* Over frequency, a list: what they become is in memory. */
static void what_is_converted_is_in_memory(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "# excitation: "
        "frequency_response\nfreq_Hz,tip_mps/hammer_N_re,tip_mps/hammer_N_im\n1,1,2\n2,2,3\n3,1,1\n4,0,1\n",
        "mode,freq_Hz,sd_Hz\n1,10,0.1\n2,60,0.2\n"};
    for (size_t i = 0; i < 2; i++) {
        struct bf_error err[2];
        struct record record;
        struct record_spool spool;
        const enum bf_status status = read_both(texts[i], &record, &spool, err);
        if (status != BF_OK) {
            assert_string_equal(err[0].text, err[1].text);
            continue;
        }
        assert_false(spool.in_file);
        assert_int_equal(spool.record.n, record.n);
        assert_int_equal(spool.record.kind, record.kind);
        for (size_t c = 0; c < record.n_columns; c++)
            assert_memory_equal(spool.record.columns[c].x, record.columns[c].x, record.n * sizeof(double));
        record_spool_close(&spool);
        record_free(&record);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_file_has_what_memory_has),
        cmocka_unit_test(the_same_is_said_of_a_bad_one),
        cmocka_unit_test(what_is_converted_is_in_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
