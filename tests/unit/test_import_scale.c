/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "test_import.h"

static const double nothing = (double)NAN;

/* The first sample of column `column`, which is 1 in the file, with this scale; NAN: refused, with err. */
static double scaled(const char *unit, const char *column, const char *text, struct bf_error *err)
{
    char table[200], *path;
    struct import_file file;
    struct record record;
    struct import_scale scale = {.name = column};
    const struct import_pick pick = {"#1", column};
    if (import_scale_read(text, &scale, err) != BF_OK)
        return nothing;
    const int n = snprintf(table, sizeof table, "a%s\n1\n2\n3\n", unit);
    path = reads("x.csv", table, (size_t)n, &file);
    const struct import_choice choice = {.rate_Hz = 100,
                                         .from_s = nothing,
                                         .to_s = nothing,
                                         .free_from_s = nothing,
                                         .n_picks = 1,
                                         .picks = &pick,
                                         .n_scales = 1,
                                         .scales = &scale};
    double x = nothing;
    if (import_record(&file, &choice, &record, err) == BF_OK) {
        x = record.columns[0].x[0];
        record_free(&record);
    }
    import_free(&file);
    free(path);
    return x;
}

static void arithmetic_and_sensitivities_are_worth_what_they_say(void **state)
{
    (void)state;
    static const struct {
        const char *unit, *column, *text;
        double value;
    } cases[] = {
        {"", "hammer_N", "1/22.5", 1 / 22.5},
        {"", "accel_mps2", "9.81/0.1", 98.1},
        {"", "x_V", " ( 1 + 2 ) * 3 - 4 / 8 ", 8.5},
        {"", "x_V", "2 - 3 - 4", -5},
        {"", "x_V", "-2.5e-3", -2.5e-3},
        {" [V]", "accel_mps2", "100mV/g", 98.0665},
        {" [mV]", "accel_mps2", "100 mV/g", 0.0980665},
        {"", "accel_mps2", "100mV/g", 98.0665},
        {" [V]", "accel_g", "100mV/g", 10},
        {" [V]", "accel_mps2", "10mV/(m/s^2)", 100},
        {" [V]", "accel_mps2", "10mV/m/s^2", 100},
        {" [V]", "hammer_N", "22.5mV/N", 1 / 0.0225},
        {" [V]", "hammer_N", "50mV/lbf", 4.4482216152605 / 0.05},
        {" [V]", "tip_mps", "5mm/s/V", 0.005},
        {" [pC]", "hammer_N", "4pC/N", 0.25},
        {" [V]", "force", "22.5mV/N", 1 / 0.0225},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bf_error err = {.text = ""};
        const double x = scaled(cases[i].unit, cases[i].column, cases[i].text, &err);
        if (!(fabs(x / cases[i].value - 1) < 1e-12))
            fail_msg("%s of%s: %.12g, wanted %.12g; %s", cases[i].text, cases[i].unit, x, cases[i].value, err.text);
    }
}

static void what_cannot_be_meant_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *unit, *column, *text, *says;
    } cases[] = {
        {"", "x_V", "1/0", "not a number"},
        {"", "x_V", "", "not a number"},
        {"", "x_V", "(1", "not a number"},
        {"", "x_V", "2*", "not a number"},
        {"", "x_V", "1-1", "leaves nothing"},
        {"", "x_V", "3 volts", "no quotient"},
        {"", "x_V", "100mV/mV", "cable"},
        {"", "x_V", "2g/mps2", "cable"},
        {"", "accel_mps2", "-100mV/g", "gain: -1"},
        {"", "accel_mps2", "2*50mV/g", "one number"},
        {" [V]", "hammer_N", "100mV/g", "rename the column"},
        {" [g]", "accel_mps2", "100mV/g", "in its numbers already"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bf_error err = {.text = ""};
        assert_true(isnan(scaled(cases[i].unit, cases[i].column, cases[i].text, &err)));
        assert_int_equal(err.status, BF_USAGE);
        assert_contains(err.text, cases[i].says);
    }
}

static void brackets_without_end_are_no_endless_depth(void **state)
{
    (void)state;
    char text[4001];
    struct import_scale scale = {0};
    struct bf_error err;
    memset(text, '(', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    assert_int_equal(import_scale_read(text, &scale, &err), BF_USAGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arithmetic_and_sensitivities_are_worth_what_they_say),
        cmocka_unit_test(what_cannot_be_meant_is_refused),
        cmocka_unit_test(brackets_without_end_are_no_endless_depth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
