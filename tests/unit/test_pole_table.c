/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lists of measured frequencies: read, refused, paired with the modes of a model, and what their ratios say. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include <unistd.h>
#include "compare/compare.h"
#include "test_files.h"

/* A cantilever's, up to a factor. */
static const double cantilever[] = {3.516, 22.034, 61.697, 120.902, 199.860, 298.556};
enum { MODES = sizeof cantilever / sizeof *cantilever };

static enum bf_status read_list(const char *text, struct frequency_list *out, struct bf_error *err)
{
    char *path = temporary_file("list.csv", text, strlen(text));
    const enum bf_status status = frequency_list_read(path, out, err);
    unlink(path);
    free(path);
    return status;
}

static void lists_are_read(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "# a rap\nfrequency_Hz, sd_Hz, damping\n3.5, 0.01, 0.002\n\n22\n61.7;0.1\n",
        "3.5 0.01 0.002\r\n22\r\n61.7 0.1\r\n",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct frequency_list list;
        struct bf_error err;
        if (read_list(texts[i], &list, &err) != BF_OK)
            fail_msg("%s", err.text);
        assert_int_equal(list.n, 3);
        assert_true(list.modes[0].frequency_Hz == 3.5 && list.modes[0].sd_Hz == 0.01 &&
                    list.modes[0].damping_ratio == 0.002);
        assert_true(list.modes[1].frequency_Hz == 22.0 && list.modes[1].sd_Hz == 0.0 &&
                    isnan(list.modes[1].damping_ratio));
        assert_true(list.modes[2].sd_Hz == 0.1);
        frequency_list_free(&list);
    }
}

static void columns_have_names(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "# a "
        "rap\nmode,freq_Hz,sd_Hz,damping_ratio,sd,shape_at_0.1_m,shape_at_0.3_m\n1,3.5,0.01,0.002,1e-4,0.2,1\n,22,,,,-"
        "0.5,\n"
        "3,61.7,-,0.01,0.001,,1\n",
        "shape_at_0.1_m; shape_at_0.3_m; damping_ratio; damping_sd; mode; frequency_Hz; sd_Hz\n"
        "0.2; 1; 0.002; 1e-4; 1; 3.5; 0.01\n-0.5;;;;;22;\n;1;0.01;0.001;3;61.7;-\n",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct frequency_list list, again;
        struct record record;
        struct bf_error err;
        if (read_list(texts[i], &list, &err) != BF_OK)
            fail_msg("%s", err.text);
        frequency_list_to_record(&list, NULL, &record);
        frequency_list_of_record(&record, &again);
        assert_int_equal(record.kind, RECORD_FREQUENCIES);
        assert_int_equal(again.n, 3);
        assert_memory_equal(again.modes, list.modes, sizeof list.modes[0]);
        assert_true(list.modes[0].mode == 1 && list.modes[1].mode == 0 && again.modes[2].mode == 3);
        assert_true(list.modes[0].damping_sd == 1e-4 && again.modes[2].damping_sd == 0.001);
        assert_true(list.modes[1].sd_Hz == 0.0 && isnan(again.modes[1].damping_ratio) && list.modes[2].sd_Hz == 0.0);
        assert_true(list.n_places == 2 && list.place_m[0] == 0.1 && list.place_m[1] == 0.3);
        assert_true(list.shape[1] == 1.0 && list.shape[2] == -0.5 && isnan(list.shape[3]) && isnan(list.shape[4]));
        assert_int_equal(strlen(record.sha256), 64);
        frequency_list_free(&list), frequency_list_free(&again), record_free(&record);
    }
}

static void what_is_no_list_is_refused_by_line(void **state)
{
    (void)state;
    static const struct {
        const char *text, *line, *says;
    } bad[] = {
        {"", ":1: ", "no frequency"},
        {"# only words\n", ":1: ", "no frequency"},
        {"22\n3.5\n", ":2: ", "ascending"},
        {"0\n", ":1: ", "above 0"},
        {"-1\n", ":1: ", "above 0"},
        {"nan\n", ":1: ", "no frequency"},
        {"3.5\n22, x\n", ":2: ", "not a mode"},
        {"f\ng\n3.5\n", ":2: ", "not a mode"},
        {"3.5, -0.1\n", ":1: ", "standard error"},
        {"3.5, 7\n", ":1: ", "standard error"},
        {"3.5, 0.1, 2\n", ":1: ", "between 0 and 1"},
        {"3.5, 0.1, 0.2, 9\n", ":1: ", "standard error 9 of the damping"},
        {"3.5, 0.1, 0.2, 0.1, 9\n", ":1: ", "not a mode"},
        {"mode,freq_Hz,colour\n1,3.5,2\n", ":1: ", "column 3 'colour'"},
        {"freq_Hz,sd_Hz,sd_Hz\n3.5,1,1\n", ":1: ", "each once"},
        {"mode,freq_Hz\n1.5,3.5\n", ":2: ", "1 for the lowest"},
        {"mode,freq_Hz\n1,\n", ":2: ", "above 0"},
        {"mode,freq_Hz\n1,3.5,7\n", ":2: ", "not a mode"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct frequency_list list;
        struct bf_error err = {0};
        if (read_list(bad[i].text, &list, &err) != BF_BAD_FILE)
            fail_msg("accepted: %s", bad[i].text);
        if (strstr(err.text, bad[i].line) == NULL || strstr(err.text, bad[i].says) == NULL)
            fail_msg("%s: %s", bad[i].text, err.text);
        assert_null(list.modes);
    }
}

/* Modes `of` the cantilever times `factor`, 0: 1.31 times the third, which is none of them. */
static struct pole_table table_of(double factor, const size_t of[], size_t n)
{
    struct measured_frequency modes[8];
    const struct frequency_list list = {.n = n, .modes = modes};
    struct pole_table table;
    for (size_t i = 0; i < n; i++)
        modes[i] = (struct measured_frequency){.frequency_Hz =
                                                   factor * (of[i] > 0 ? cantilever[of[i] - 1] : 1.31 * cantilever[2]),
                                               .damping_ratio = nan("")};
    pole_table_make(&list, cantilever, MODES, &table);
    for (size_t i = 0; i < n; i++)
        if (table.pairs[i].mode != of[i])
            fail_msg("factor %g: measured %zu is mode %zu, wanted %zu", factor, i, table.pairs[i].mode, of[i]);
    return table;
}

static void a_scale_is_told_from_a_mode_that_is_none(void **state)
{
    (void)state;
    static const size_t all[] = {1, 2, 3, 4, 5}, with_torsion[] = {1, 2, 3, 0, 4, 5},
                        without_second[] = {1, 3, 4, 5, 6};
    for (double factor = 0.7; factor < 1.45; factor += 0.1) {
        struct pole_table table = table_of(factor, all, 5);
        assert_true(fabs(table.factor / factor - 1.0) < 1e-12 && table.spread < 1e-12);
        assert_int_equal(strstr(table.text, "off by one factor") != NULL, fabs(factor - 1.0) > 0.02);
        pole_table_free(&table);
        table = table_of(factor, with_torsion, 6);
        assert_true(fabs(table.factor / factor - 1.0) < 1e-12);
        assert_non_null(strstr(table.text, "is no bending mode"));
        pole_table_free(&table);
    }
    struct pole_table table = table_of(0.97, without_second, 5);
    assert_null(strstr(table.text, "no bending mode"));
    pole_table_free(&table);
}

/* A mass in mid-span lowers every other mode: no scale. */
static void a_spread_is_no_scale(void **state)
{
    (void)state;
    struct measured_frequency modes[5];
    struct pole_table table;
    for (size_t i = 0; i < 5; i++)
        modes[i] =
            (struct measured_frequency){.frequency_Hz = cantilever[i] * (i % 2 ? 0.94 : 1.0), .damping_ratio = nan("")};
    const struct frequency_list list = {.n = 5, .modes = modes};
    pole_table_make(&list, cantilever, MODES, &table);
    assert_int_equal(table.n_pairs, 5);
    assert_true(table.spread > 0.02);
    assert_null(strstr(table.text, "off by one factor"));
    pole_table_free(&table);
}

/* The model's own shape scaled, another mode's, and one measured at a single place. */
static void shapes_are_compared(void **state)
{
    double x_m[3] = {0.0, 0.5, 1.0}, of_modes[6] = {0.0, 0.34, 1.0, 0.0, -0.71, 1.0};
    const struct modes modes = {.n = 2, .n_points = 3, .x_m = x_m, .shape = of_modes};
    struct measured_frequency measured[2] = {{.frequency_Hz = cantilever[0]}, {.frequency_Hz = cantilever[1]}};
    double shape[4] = {0.5 * 0.34, 0.5, 0.34, 1.0};
    const struct frequency_list list = {
        .n = 2, .modes = measured, .n_places = 2, .place_m = {0.5, 1.0}, .shape = shape};
    struct pole_table table;
    (void)state;
    pole_table_make(&list, cantilever, 2, &table);
    assert_true(isnan(table.pairs[0].mac));
    pole_table_shapes(&table, &list, &modes);
    assert_true(fabs(table.pairs[0].mac - 1.0) < 1e-12);
    const double both = 0.34 * -0.71 + 1.0, expected = both * both / ((0.34 * 0.34 + 1.0) * (0.71 * 0.71 + 1.0));
    assert_true(fabs(table.pairs[1].mac - expected) < 1e-12);
    shape[2] = nan("");
    pole_table_shapes(&table, &list, &modes);
    assert_true(isnan(table.pairs[1].mac));
    pole_table_free(&table);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_are_read),
        cmocka_unit_test(columns_have_names),
        cmocka_unit_test(shapes_are_compared),
        cmocka_unit_test(what_is_no_list_is_refused_by_line),
        cmocka_unit_test(a_scale_is_told_from_a_mode_that_is_none),
        cmocka_unit_test(a_spread_is_no_scale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
