/* SPDX-License-Identifier: GPL-3.0-or-later */
/* An answer for the terminal: values in words, lines, tables, what is left out, what is too wide. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <math.h>
#include "show/answer_forms.h"
#include "show/show.h"

static void expect(const struct json *root, const struct answer_field fields[], const char *wanted)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    assert_int_equal(setenv("COLUMNS", "60", 1), 0);
    answer_print_text(out, root, fields);
    assert_int_equal(fclose(out), 0);
    assert_string_equal(text, wanted);
    free(text);
}

static void a_value_has_digits_an_error_and_a_unit(void **state)
{
    (void)state;
    static const struct answer_field fields[] = {
        ANSWER_ROW(NUMBER, "mass_kg", "", .unit = "kg", .digits = 4, .error = "sd"),
        ANSWER_ROW(NUMBER, "rate_Hz", "", .digits = -2),
        ANSWER_ROW(NUMBER, "error", "", .flags = ANSWER_PERCENT, .digits = 3),
        ANSWER_ROW(COUNT, "n", ""),
        ANSWER_ROW(NUMBER, "unknown", ""),
        ANSWER_ROW(NUMBERS, "parts", "", .flags = ANSWER_PERCENT, .digits = 2),
        ANSWER_SAY("{mass_kg}; {rate_Hz}; {error}; {n}; {unknown}; {parts}; {parts.1}"),
        {0},
    };
    struct json *root = json_new_object();
    json_put_number(root, "mass_kg", 0.123456);
    json_put_number(root, "sd", 0.00321);
    json_put_number(root, "rate_Hz", 512.0);
    json_put_number(root, "error", 0.04321);
    json_put_number(root, "n", 1234567.0);
    json_put_number(root, "unknown", nan(""));
    struct json *parts = json_put(root, "parts", json_new_array());
    json_push_number(parts, 0.25);
    json_push_number(parts, 0.75);
    expect(root, fields, "0.1235 ± 0.0032 kg; 512.00 Hz; 4.32 %; 1234567; -; 25, 75 %;\n75 %\n");
    json_discard(root);
}

static void what_is_not_there_is_left_out(void **state)
{
    (void)state;
    static const struct answer_field inner[] = {ANSWER_ROW(NUMBER, "f_Hz", ""), {0}};
    static const struct answer_field fields[] = {
        ANSWER_ROW(BOOL, "yes", ""),
        ANSWER_ROW(TEXT, "empty", ""),
        ANSWER_ROW(TEXTS, "none", "", .text = "title"),
        ANSWER_ROW(TEXTS, "two", "", .text = "\ntitle"),
        ANSWER_ROW_OF(OBJECT, "of", "", inner),
        ANSWER_SAY("a[ {empty}][{yes?} b][{yes!} c][{none?} d][{two?} e] {yes?so|not so} {two#}"),
        ANSWER_SAY("[{empty}]"),
        ANSWER_SAY("{n} {n#gap|gaps}, {one} {one#gap|gaps}[ at {of.f_Hz}][ not {of.g_Hz}]"),
        ANSWER_SAY("never", .flags = ANSWER_ALL),
        {0},
    };
    struct json *root = json_new_object();
    json_put_bool(root, "yes", true);
    json_put_text(root, "empty", "");
    (void)json_put(root, "none", json_new_array());
    struct json *two = json_put(root, "two", json_new_array());
    json_push_text(two, "first");
    json_push_text(two, "second?");
    json_put_number(root, "n", 2.0);
    json_put_number(root, "one", 1.0);
    json_put_number(json_put(root, "of", json_new_object()), "f_Hz", 6.5);
    expect(root, fields, "\ntitle\n- first.\n- second?\na b e so 2\n2 gaps, 1 gap at 6.5 Hz\n");
    json_discard(root);
}

static const struct answer_field channel_fields[] = {
    ANSWER_ROW(TEXT, "name", "", .text = "channel"),
    ANSWER_ROW(NUMBER, "nrmse", "", .flags = ANSWER_PERCENT, .digits = -1, .text = "error"),
    ANSWER_ROW(NUMBER, "never", "", .text = "never"),
    {0},
};
static const struct answer_field record_fields[] = {
    ANSWER_SAY("[{held_out?}held out:]", .flags = ANSWER_GROUP),
    ANSWER_ROW(TEXT, "file", "", .flags = ANSWER_BASE, .text = "record"),
    ANSWER_ROW_OF(LIST, "channels", "", channel_fields, .flags = ANSWER_TABLE),
    {0},
};

static void add_record(struct json *list, const char *file, bool held_out, const char *channel, double error)
{
    struct json *record = json_push(list, json_new_object());
    json_put_text(record, "file", file);
    json_put_bool(record, "held_out", held_out);
    struct json *one = json_push(json_put(record, "channels", json_new_array()), json_new_object());
    json_put_text(one, "name", channel);
    json_put_number(one, "nrmse", error);
    json_put_number(one, "never", nan(""));
}

static void lists_in_lists_are_rows(void **state)
{
    (void)state;
    static const struct answer_field fields[] = {
        ANSWER_ROW_OF(LIST, "records", "", record_fields, .flags = ANSWER_TABLE, .text = "All of them"),
        {0},
    };
    struct json *root = json_new_object(), *list = json_put(root, "records", json_new_array());
    add_record(list, "dir/a.csv", false, "piezo_V", 0.5);
    add_record(list, "other/long_name.csv", true, "tip_mps", 0.012);
    expect(root, fields,
           "All of them\n"
           "record         channel  error %\n"
           "a.csv          piezo_V     50.0\n"
           "\nheld out:\n"
           "long_name.csv  tip_mps      1.2\n");
    json_discard(root);
}

static void a_table_is_as_wide_as_the_terminal(void **state)
{
    (void)state;
    static const struct answer_field rows[] = {ANSWER_CELL("", "{@}"),
                                               ANSWER_CELL("", "{text}"),
                                               ANSWER_ROW(NUMBER, "value", "", .error = "sd", .text = "value"),
                                               {0}};
    static const struct answer_field fields[] = {
        ANSWER_ROW_OF(MAP, "all", "", rows, .flags = ANSWER_TABLE, .most = 2, .text = ""), {0}};
    struct json *root = json_new_object(), *map = json_put(root, "all", json_new_object());
    static const char *const names[] = {"a", "b", "c"};
    for (int i = 0; i < 3; i++) {
        struct json *one = json_put(map, names[i], json_new_object());
        json_put_text(one, "text", i == 0 ? "much too long a text for sixty columns of a terminal" : "short");
        json_put_number(one, "value", 10.0 * i);
        json_put_number(one, "sd", i);
    }
    expect(root, fields,
           "                                 value  standard error\n"
           "a  much too long a text for sixty columns of a terminal\n"
           "                                     0\n"
           "b  short                            10  ± 1             10 %\n"
           "(and 1 more; --all)\n");
    json_discard(root);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_value_has_digits_an_error_and_a_unit),
        cmocka_unit_test(what_is_not_there_is_left_out),
        cmocka_unit_test(lists_in_lists_are_rows),
        cmocka_unit_test(a_table_is_as_wide_as_the_terminal),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
