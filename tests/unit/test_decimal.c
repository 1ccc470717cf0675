/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "comma_locale.h"
#include "ground/ground.h"

static void prints(double x, const char *wanted)
{
    char text[DECIMAL_TEXT];
    decimal_print(text, x);
    assert_string_equal(text, wanted);
}

static void as_a_person_writes(void **state)
{
    (void)state;
    prints(0.05, "0.05");
    prints(50.0, "50");
    prints(0.0, "0");
    prints(-60.0, "-60");
    prints(1.05, "1.05");
    prints(8.25e-6, "8.25e-6");
    prints(1e-5, "1.0e-5"); /* the point is for YAML 1.1 */
    prints(1e20, "1.0e+20");
    prints(0.00013, "0.00013");
    prints(123456789.0, "123456789");
    prints(0.1 + 0.2, "0.30000000000000004");
    prints(HUGE_VAL, ".inf");
    prints(-HUGE_VAL, "-.inf");
}

static void every_double_reads_back(void **state)
{
    (void)state;
    uint64_t bits = 88172645463325252U;
    for (int i = 0; i < 200000; i++) {
        bits ^= bits << 13; /* xorshift64 */
        bits ^= bits >> 7;
        bits ^= bits << 17;
        double x, back;
        char text[DECIMAL_TEXT];
        memcpy(&x, &bits, sizeof x);
        if (i % 2)
            x = (double)(bits >> 40) * 1e-3;
        if (!isfinite(x))
            continue;
        decimal_print(text, x);
        assert_true(strlen(text) < DECIMAL_TEXT - 1);
        assert_true(decimal_parse(text, &back));
        assert_memory_equal(&x, &back, sizeof x);
    }
}

static void rounded(void **state)
{
    (void)state;
    char text[DECIMAL_TEXT];
    decimal_print_rounded(text, 0.0123456789, 4);
    assert_string_equal(text, "0.01235");
    decimal_print_rounded(text, 99999.96, 3);
    assert_string_equal(text, "100000");
    decimal_print_rounded(text, HUGE_VAL, 3);
    assert_string_equal(text, ".inf");
}

static void what_is_no_number(void **state)
{
    (void)state;
    static const char *const bad[] = {"",     "-",   ".",   "1,5",   "1e",    "0x10", "nan",
                                      ".nan", "inf", "1 2", "1.2.3", "1e400", "--1",  "one"};
    double x;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        if (decimal_parse(bad[i], &x))
            fail_msg("'%s' was taken for %g", bad[i], x);
    assert_true(decimal_parse("-.inf", &x) && isinf(x) && x < 0);
    assert_true(decimal_parse("+.5e-3", &x) && !(fabs(x - 0.0005) > 0));
}

static void a_locale_with_commas(void **state)
{
    (void)state;
    double x;
    if (!comma_locale())
        skip();
    assert_string_equal(localeconv()->decimal_point, ",");
    prints(1.5, "1.5");
    assert_true(decimal_parse("1.5", &x) && !(fabs(x - 1.5) > 0));
    (void)setlocale(LC_ALL, "C");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(as_a_person_writes), cmocka_unit_test(every_double_reads_back), cmocka_unit_test(rounded),
        cmocka_unit_test(what_is_no_number),  cmocka_unit_test(a_locale_with_commas),
    };
    return cmocka_run_group_tests_name("decimal", tests, NULL, NULL);
}
