/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include "test_import.h"

static char *reads_text(const char *text, struct import_file *file)
{
    return reads("table.csv", text, strlen(text), file);
}

static void has(const struct import_file *file, const char *name, const char *unit, size_t n, const double x[])
{
    const struct import_channel *c = channel_named(file, name);
    assert_string_equal(c->unit, unit);
    assert_int_equal(c->n, n);
    for (size_t k = 0; k < n; k++)
        assert_true(c->x[k] == x[k]);
}

static const double t[] = {0, 0.5, 1}, a[] = {1.5, -2, 0.25}, b[] = {-1e-3, 3, 12};

/* One table in every form: separator, decimal mark, header, row of units, trailing separator, quotes, CR LF, comments. */
static void every_variant_gives_the_same_table(void **state)
{
    (void)state;
    static const char *const variants[] = {
        "t,a,b\n0,1.5,-1e-3\n0.5,-2,3\n1,0.25,12\n",
        "t;a;b\n0;1,5;-1e-3\n0,5;-2;3\n1;0,25;12\n",
        "t;a;b\n0;1.5;-1e-3\n0.5;-2;3\n1;0.25;12\n",
        "t\ta\tb\n0\t1.5\t-1e-3\n0.5\t-2\t3\n1\t0.25\t12\n",
        "t\ta\tb\n0\t1,5\t-1e-3\n0,5\t-2\t3\n1\t0,25\t12\n",
        "t a  b\n 0 1.5   -1e-3\n 0.5 -2 3\n 1  0.25 12\n",
        "t a b\n0 1,5 -1e-3\n0,5 -2 3\n1 0,25 12\n",
        "t, a, b\n0, 1.5, -1e-3\n0.5, -2, 3\n1, 0.25, 12\n",
        "t,a,b,\n0,1.5,-1e-3,\n0.5,-2,3,\n1,0.25,12,\n",
        "\"t\",\"a\",\"b\"\r\n\"0\",\"1.5\",\"-1e-3\"\r\n0.5,-2,3\r\n1,0.25,12\r\n",
        "\xef\xbb\xbft;a;b\n0;1,5;-1E-03\n0,5;-2;3\n1;0,25;12",
        "Scope X200\nSerial;4711\n\nt;a;b\n0;1,5;-1e-3\n0,5;-2;3\n1;0,25;12\n\n\n",
        "# made by hand\n% and another\nt,a,b\n0,1.5,-1e-3\n# in between\n0.5,-2,3\n1,0.25,12\n",
        "sep=;\nt;a;b\n0;1.5;-1e-3\n0.5;-2;3\n1;0.25;12\n",
    };
    for (size_t i = 0; i < sizeof variants / sizeof *variants; i++) {
        struct import_file file;
        char *path = reads_text(variants[i], &file);
        assert_int_equal(file.n_channels, 3);
        has(&file, "t", "", 3, t);
        has(&file, "a", "", 3, a);
        has(&file, "b", "", 3, b);
        import_free(&file);
        free(path);
    }
}

static void units_come_from_brackets_or_a_row(void **state)
{
    (void)state;
    static const char *const variants[] = {
        "Time (s),a [m/s^2],b (N)\n0,1.5,-1e-3\n0.5,-2,3\n1,0.25,12\n",
        "Time,a,b\ns,m/s^2,N\n0,1.5,-1e-3\n0.5,-2,3\n1,0.25,12\n",
        "Time;a;b\n[s];[m/s^2];[N]\n0;1,5;-1e-3\n0,5;-2;3\n1;0,25;12\n",
        "Time\ta\tb\n(s)\t(m/s^2)\t(N)\n0\t1.5\t-1e-3\n0.5\t-2\t3\n1\t0.25\t12\n",
    };
    for (size_t i = 0; i < sizeof variants / sizeof *variants; i++) {
        struct import_file file;
        char *path = reads_text(variants[i], &file);
        has(&file, "Time", "s", 3, t);
        has(&file, "a", "m/s^2", 3, a);
        has(&file, "b", "N", 3, b);
        import_free(&file);
        free(path);
    }
}

static void a_bracket_that_is_no_unit_stays_in_the_name(void **state)
{
    (void)state;
    struct import_file file;
    char *path = reads_text("t,Response (Trigger)\n0,1.5\n0.5,-2\n1,0.25\n", &file);
    has(&file, "Response (Trigger)", "", 3, a);
    import_free(&file);
    free(path);
}

static void without_a_header_channels_are_numbered(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    char *path = reads_text("0,1.5,-1e-3\n0.5,-2,3\n1,0.25,12\n", &file);
    has(&file, "channel_1", "", 3, t);
    has(&file, "channel_3", "", 3, b);
    makes(&file, &choice, &record); /* the first increases uniformly: time, with a warning */
    assert_int_equal(record.n_columns, 2);
    assert_true(record.dt_s == 0.5);
    record_free(&record);
    import_free(&file);
    free(path);
}

static void a_counter_or_a_frequency_is_not_taken_for_time(void **state)
{
    (void)state;
    static const char *const tables[] = {"1,5\n2,6\n3,4\n", "freq_hz,a\n0,1\n0.5,2\n1,3\n"};
    for (size_t i = 0; i < 2; i++) {
        struct import_file file;
        struct import_choice choice = no_choice();
        char *path = reads_text(tables[i], &file);
        makes_none(&file, &choice, BF_USAGE, "no time axis", "--rate HZ");
        import_free(&file);
        free(path);
    }
}

static void the_rate_may_be_stated_above(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        double rate_Hz;
    } cases[] = {{"# Sample rate: 1024 Hz\na\n1\n2\n3\n", 1024},
                 {"Sampling frequency;2,5 kHz\na;b\n1,5;2\n2;3\n3;4\n", 2500},
                 {"Sample Interval,4.0E-4\na,b\n1,2\n2,3\n3,4\n", 2500},
                 {"% sampling_rate = 100\n1 2\n3 4\n", 100},
                 {"# offset 3, fs = 500\n1 2\n3 4\n", 500},
                 {"dt [ms];0,5\nx;y\n1;2\n3;4\n", 2000},
                 {"Sample interval (ms),0.5\nx,y\n1,2\n3,4\n", 2000}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct import_file file;
        struct record record;
        struct import_choice choice = no_choice();
        char *path = reads_text(cases[i].text, &file);
        assert_true(fabs(file.rate_Hz - cases[i].rate_Hz) < 1e-9 * cases[i].rate_Hz);
        makes(&file, &choice, &record);
        assert_true(fabs(record.dt_s * cases[i].rate_Hz - 1) < 1e-12);
        record_free(&record);
        import_free(&file);
        free(path);
    }
}

static void the_form_can_be_forced(void **state)
{
    (void)state;
    struct import_file file;
    struct bf_error err;
    char *path;
    const struct import_reading comma = {.point = ','};
    assert_int_equal(read_as("x.csv", "1,5\n2,5\n4,0\n", 12, &comma, &file, &path, &err), BF_OK);
    assert_int_equal(file.n_channels, 1);
    assert_true(file.channels[0].x[0] == 1.5 && file.channels[0].x[2] == 4);
    import_free(&file);
    free(path);
    const struct import_reading semicolon = {.separator = ';', .point = '.'};
    assert_int_equal(read_as("x.csv", "1,5\n2,5\n", 8, &semicolon, &file, &path, &err), BF_BAD_FILE);
    assert_contains(err.text, "--separator");
    free(path);
}

static void missing_values_matter_only_where_they_are_chosen(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    const struct import_pick good = {"a", NULL};
    char *path = reads_text("t,a,b\n0,1,2\n1,2,\n2,3,NaN\n3,4,--\n4,5,6\n", &file);
    assert_true(isnan(channel_named(&file, "b")->x[1]));
    makes_none(&file, &choice, BF_BAD_FILE, ":3: channel 'b', sample 2", "--from");
    choice.n_picks = 1;
    choice.picks = &good;
    makes(&file, &choice, &record);
    assert_int_equal(record.n, 5);
    record_free(&record);
    import_free(&file);
    free(path);
}

static void damage_is_named_with_its_line(void **state)
{
    (void)state;
    static const struct {
        const char *text, *phrase1, *phrase2;
    } cases[] = {{"a,b\n1,2\n3,4\n5,x\n", ":4: column 2", "'x' is not a number"},
                 {"a,b\n1,2\n3,4\n5,6,7\n", ":4: has 3 cells", "have 2"},
                 {"a,b\n1,2\n3,4\n\n5\n", ":5: has 1 cells", "complete"},
                 {"only words\nand more\n", ":1: no row of numbers", "export"},
                 {"a,b\n1,2\n3,4\nmean,3\n", ":4: column 1", "remove the line"},
                 {"", "is empty", "export"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        refuses("bad.csv", cases[i].text, strlen(cases[i].text), cases[i].phrase1, cases[i].phrase2);
    refuses("bad.csv", "a\0b\n1,2\n", 8, "no kind of recording", "--format");
    refuses("bad.csv",
            "\xff\xfe"
            "1\n",
            4, "UTF-16", "iconv");
}

static void any_damage_is_survived(void **state)
{
    (void)state;
    static struct bytes good;
    put_text(&good, "# Sample rate: 2 Hz\nZeit [ms];Kraft (N);x\n0;1,5;-1e-3\n0,5;;3\n1;0,25;12\n");
    survives_damage("damaged.csv", &good, "csv", 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_variant_gives_the_same_table),
        cmocka_unit_test(units_come_from_brackets_or_a_row),
        cmocka_unit_test(a_bracket_that_is_no_unit_stays_in_the_name),
        cmocka_unit_test(without_a_header_channels_are_numbered),
        cmocka_unit_test(a_counter_or_a_frequency_is_not_taken_for_time),
        cmocka_unit_test(the_rate_may_be_stated_above),
        cmocka_unit_test(the_form_can_be_forced),
        cmocka_unit_test(missing_values_matter_only_where_they_are_chosen),
        cmocka_unit_test(damage_is_named_with_its_line),
        cmocka_unit_test(any_damage_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
