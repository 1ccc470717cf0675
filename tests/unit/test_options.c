/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Values of options: what is a number, and how a mistake is told. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>
#include "ground/ground.h"

static struct bf_error err;

static int clear(void **state)
{
    (void)state;
    memset(&err, 0, sizeof err);
    optind = 0; /* getopt starts anew */
    return 0;
}

static void a_count_is_whole_and_within_its_ends(void **state)
{
    static const char *const bad[] = {"", "1.5", "7x", "1", "65", "-3", "1e1", "99999999999999999999", "x"};
    long n = 0;
    (void)state;
    assert_int_equal(options_count("--steps", "2", 2, 64, &n, &err), BF_OK);
    assert_int_equal(n, 2);
    assert_int_equal(options_count("--steps", "64", 2, 64, &n, &err), BF_OK);
    assert_int_equal(n, 64);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(options_count("--steps", bad[i], 2, 64, &n, &err), BF_USAGE);
        assert_non_null(strstr(err.text, "--steps"));
        assert_non_null(strstr(err.text, "from 2 to 64"));
    }
}

static void a_positive_number_is_above_zero_and_at_most_so_much(void **state)
{
    static const char *const bad[] = {"0", "-1", "10.5", "nan", "inf", "", "2 s"};
    double x = 0.0;
    (void)state;
    assert_int_equal(options_positive("--time", "10", 10.0, &x, &err), BF_OK);
    assert_true(x == 10.0);
    assert_int_equal(options_positive("--time", "1e-3", 10.0, &x, &err), BF_OK);
    assert_true(x == 1e-3);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(options_positive("--time", bad[i], 10.0, &x, &err), BF_USAGE);
    assert_int_equal(options_positive("--time", "11", 10.0, &x, &err), BF_USAGE);
    assert_non_null(strstr(err.text, "at most 10"));
    assert_int_equal(options_positive("--time", "1e9", INFINITY, &x, &err), BF_OK);
    assert_int_equal(options_positive("--time", "0", INFINITY, &x, &err), BF_USAGE);
    assert_null(strstr(err.text, "at most"));
}

static void what_is_left_over_is_named(void **state)
{
    static const struct option options[] = {{"json", no_argument, NULL, 'j'}, {0}};
    char name[] = "info", json[] = "--json", word[] = "stray";
    char *good[] = {name, json, NULL}, *bad[] = {name, json, word, NULL};
    (void)state;
    assert_int_equal(options_next(2, good, ":", options, &err), 'j');
    assert_int_equal(options_next(2, good, ":", options, &err), -1);
    assert_int_equal(options_only(2, good, &err), BF_OK);
    optind = 0;
    assert_int_equal(options_next(3, bad, ":", options, &err), 'j');
    assert_int_equal(options_next(3, bad, ":", options, &err), -1);
    assert_int_equal(options_only(3, bad, &err), BF_USAGE);
    assert_string_equal(err.text, "'stray': info takes options only; see 'beamfit info --help'");
}

static void mistakes_name_the_option_and_the_command(void **state)
{
    static const struct option options[] = {{"port", required_argument, NULL, 'p'}, {0}};
    char name[] = "info", unknown[] = "--prot", short_one[] = "-x", port[] = "--port";
    char *unknown_words[] = {name, unknown, NULL}, *short_words[] = {name, short_one, NULL};
    char *missing[] = {name, port, NULL};
    (void)state;
    assert_int_equal(options_next(2, unknown_words, ":", options, &err), '?');
    assert_string_equal(err.text, "no such option '--prot'; see 'beamfit info --help'");
    optind = 0;
    assert_int_equal(options_next(2, short_words, ":", options, &err), '?');
    assert_string_equal(err.text, "no such option '-x'; see 'beamfit info --help'");
    optind = 0;
    assert_int_equal(options_next(2, missing, ":", options, &err), '?');
    assert_string_equal(err.text, "option '--port' needs a value; see 'beamfit info --help'");
    assert_int_equal(err.status, BF_USAGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_count_is_whole_and_within_its_ends, clear),
        cmocka_unit_test_setup(a_positive_number_is_above_zero_and_at_most_so_much, clear),
        cmocka_unit_test_setup(what_is_left_over_is_named, clear),
        cmocka_unit_test_setup(mistakes_name_the_option_and_the_command, clear),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
