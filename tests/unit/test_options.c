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
    static const char *const bad[] = {"", " 7", "1.5", "7x", "1", "65", "-3", "1e1", "99999999999999999999", "x"};
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
    static const struct option_row options[] = {{'j', 0, "json", NULL, NULL, "as JSON"}, {0}};
    char name[] = "info", json[] = "--json", word[] = "stray";
    char *good[] = {name, json, NULL}, *bad[] = {name, json, word, NULL};
    (void)state;
    assert_int_equal(options_next(2, good, options, &err), 'j');
    assert_int_equal(options_next(2, good, options, &err), -1);
    assert_int_equal(options_only(2, good, &err), BF_OK);
    optind = 0;
    assert_int_equal(options_next(3, bad, options, &err), 'j');
    assert_int_equal(options_next(3, bad, options, &err), -1);
    assert_int_equal(options_only(3, bad, &err), BF_USAGE);
    assert_string_equal(err.text, "'stray': info takes options only; see 'beamfit info --help'");
}

static void mistakes_name_the_option_and_the_command(void **state)
{
    static const struct option_row options[] = {{'p', 'p', "port", "PORT", NULL, "a port"},
                                                {.name = "MODEL", .what = "an argument"},
                                                {'c', 0, "check", NULL, NULL, "checked"},
                                                {'b', 0, "checked-by", "NAME", NULL, "by whom"},
                                                {0}};
    static const struct {
        char word[16];
        const char *said;
    } cases[] = {
        {"--prot", "no such option '--prot'; did you mean '--port'?"},
        {"--prot=7", "no such option '--prot=7'; did you mean '--port'?"},
        {"--chek", "no such option '--chek'; did you mean '--check'?"},
        {"--colour", "no such option '--colour'; see 'beamfit info --help'"},
        {"--che", "option '--che' can mean several; write it out, see 'beamfit info --help'"},
        {"--check=3", "option '--check' takes no value; see 'beamfit info --help'"},
        {"-x", "no such option '-x'; see 'beamfit info --help'"},
        {"--port", "option '--port' needs a value; see 'beamfit info --help'"},
        {"--por", "option '--por' needs a value; see 'beamfit info --help'"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char name[] = "info", word[16];
        char *words[] = {name, word, NULL};
        memcpy(word, cases[i].word, sizeof word);
        optind = 0;
        assert_int_equal(options_next(2, words, options, &err), '?');
        assert_string_equal(err.text, cases[i].said);
        assert_int_equal(err.status, BF_USAGE);
    }
}

/* --force is no business of the command: options_next() takes it, where the command has it. */
static void force_is_taken_care_of(void **state)
{
    static const struct option_row with[] = {
        {OPTION_FORCE, 0, "force", NULL, NULL, "replace"}, {'j', 0, "json", NULL, NULL, "as JSON"}, {0}};
    static const struct option_row *without = with + 1;
    char name[] = "add", force[] = "--force", json[] = "--json";
    char *words[] = {name, force, json, force, NULL};
    (void)state;
    assert_int_equal(options_next(4, words, with, &err), 'j');
    assert_int_equal(options_next(4, words, with, &err), -1);
    optind = 0;
    assert_int_equal(options_next(4, words, without, &err), '?');
}

static void a_choice_is_one_of_the_names(void **state)
{
    static const char *const names[] = {"held", "linear", "smooth"};
    size_t chosen = 9;
    (void)state;
    assert_int_equal(options_choice("--between", "linear", names, 3, &chosen, &err), BF_OK);
    assert_int_equal(chosen, 1);
    assert_int_equal(options_choice("--between", "lnear", names, 3, &chosen, &err), BF_USAGE);
    assert_string_equal(err.text, "--between 'lnear' is unknown; did you mean 'linear'?");
    assert_int_equal(options_choice("--between", "what", names, 3, &chosen, &err), BF_USAGE);
    assert_string_equal(err.text, "--between 'what' is unknown; give held, linear or smooth");
}

static void one_answer_on_standard_output(void **state)
{
    (void)state;
    static const struct option_row options[] = {{OPTION_ALL, 0, "all", NULL, NULL, "everything"}, OPTIONS_ANSWER, {0}};
    char name[] = "info", json[] = "--json", format[] = "--format", html[] = "html", all[] = "--all";
    char *words[] = {name, json, NULL}, *others[] = {name, all, format, html, NULL};
    assert_int_equal(options_one_answer("-", &err), BF_OK);
    assert_int_equal(options_format(), OPTIONS_TEXT);
    assert_false(options_all());
    optind = 1;
    assert_int_equal(options_next(2, words, options, &err), -1);
    assert_int_equal(options_format(), OPTIONS_AS_JSON);
    assert_int_equal(options_one_answer("file", &err), BF_OK);
    assert_int_equal(options_one_answer(NULL, &err), BF_OK);
    assert_int_equal(options_one_answer("-", &err), BF_USAGE);
    optind = 1;
    assert_int_equal(options_next(4, others, options, &err), -1);
    assert_int_equal(options_format(), OPTIONS_HTML);
    assert_true(options_all());
    assert_int_equal(options_one_answer("-", &err), BF_USAGE);
    assert_string_equal(err.text, "--json and -o - both want standard output; give a file to -o");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_count_is_whole_and_within_its_ends, clear),
        cmocka_unit_test_setup(a_positive_number_is_above_zero_and_at_most_so_much, clear),
        cmocka_unit_test_setup(what_is_left_over_is_named, clear),
        cmocka_unit_test_setup(force_is_taken_care_of, clear),
        cmocka_unit_test_setup(a_choice_is_one_of_the_names, clear),
        cmocka_unit_test_setup(one_answer_on_standard_output, clear),
        cmocka_unit_test_setup(mistakes_name_the_option_and_the_command, clear),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
