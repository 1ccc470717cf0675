/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "ground/ground.h"

static uint64_t random_bits(void)
{
    static uint64_t x = 0x9e3779b97f4a7c15u;
    x ^= x << 13, x ^= x >> 7, x ^= x << 17;
    return x;
}

static bool parse(const char *text, double *x)
{
    return number_parse(text, text + strlen(text), '.', x);
}

/* Any double printed with any number of digits is read as the C library reads it. */
static void agrees_with_strtod(void **state)
{
    (void)state;
    static const char *const formats[] = {"%.*g", "%.*e", "%.*f"};
    for (int i = 0; i < 300000; i++) {
        uint64_t bits = random_bits();
        double value, got;
        memcpy(&value, &bits, sizeof value);
        if (i % 3 == 0)
            value = (double)(int64_t)(bits >> 20) * 1e-6;
        if (!isfinite(value) || (i % 3 == 2 && fabs(value) > 1e15))
            continue;
        char text[400];
        snprintf(text, sizeof text, formats[i % 3], (int)(random_bits() % 20), value);
        if (!parse(text, &got) || got != strtod(text, NULL))
            fail_msg("'%s' read as %.17g", text, got);
    }
}

static void reads_the_hard_cases(void **state)
{
    (void)state;
    static const char *const texts[] = {"0",
                                        "-0",
                                        "+1",
                                        ".5",
                                        "5.",
                                        "1e5",
                                        "1E-05",
                                        "1e+22",
                                        "1e23",
                                        "9007199254740993",
                                        "9007199254740992",
                                        "123456789012345678901234567890",
                                        "2.2250738585072011e-308",
                                        "4.9e-324",
                                        "1e-400",
                                        "1e400",
                                        "-1e400",
                                        "0e999999999",
                                        "1e-99999999999",
                                        "0.000000000000000000000000000000000000000000000001",
                                        "1.7976931348623159e308"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        double x;
        assert_true(parse(texts[i], &x));
        double expected = strtod(texts[i], NULL);
        assert_memory_equal(&x, &expected, sizeof x); /* the sign of zero too */
    }
}

static void refuses_what_is_no_decimal_number(void **state)
{
    (void)state;
    static const char *const texts[] = {"",     " ",   "-",  "+",   ".",   "-.",    "e5",  ".e5", "nan", "inf",
                                        "0x10", "1,5", "1e", "1e+", "1 2", "1.2.3", "--1", "1-",  "1d5", "1_000"};
    double x;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        assert_false(parse(texts[i], &x));
}

static void stops_at_the_end_it_is_given(void **state)
{
    (void)state;
    double x;
    const char *text = "12345", *after = number_scan(text, text + 3, '.', &x);
    assert_ptr_equal(after, text + 3);
    assert_true(x == 123);
    text = "1.5e+";
    assert_ptr_equal(number_scan(text, text + 5, '.', &x), text + 3); /* the exponent has no digits */
    text = "2,75;";
    assert_ptr_equal(number_scan(text, text + 5, ',', &x), text + 4);
    assert_true(x == 2.75);
    char *hugely = malloc(5000); /* without a NUL behind it */
    memset(hugely, '7', 5000);
    assert_null(number_scan(hugely, hugely + 5000, '.', &x));
    free(hugely);
}

static void counts_digits(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int significant, decimals;
    } cases[] = {{"0.0009765625", 7, 10}, {"3.998047", 7, 6}, {"0.0000", 0, 4}, {"-12.50", 4, 2},
                 {"1.953125E-5", 7, 11},  {"100", 3, 0},      {"2e3", 1, -3},   {"", 0, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct number_digits d = number_digits(cases[i].text, cases[i].text + strlen(cases[i].text), '.');
        assert_int_equal(d.significant, cases[i].significant);
        assert_int_equal(d.decimals, cases[i].decimals);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_strtod),
        cmocka_unit_test(reads_the_hard_cases),
        cmocka_unit_test(refuses_what_is_no_decimal_number),
        cmocka_unit_test(stops_at_the_end_it_is_given),
        cmocka_unit_test(counts_digits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
