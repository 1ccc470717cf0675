/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include "test_import.h"

/* Header of a file; decimal mark, X_Columns and separator differ. */
static void put_header(struct bytes *b, const char *separator, const char *mark, const char *x_columns)
{
    char text[400];
    const char *s = strcmp(separator, "Comma") == 0 ? "," : "\t";
    snprintf(text, sizeof text,
             "LabVIEW Measurement%s\nWriter_Version%s2\nReader_Version%s2\nSeparator%s%s\nDecimal_Separator%s%s\n"
             "Multi_Headings%sYes\nX_Columns%s%s\nTime_Pref%sAbsolute\nOperator%sME\nDate%s2026/03/04\n"
             "***End_of_Header***%s\n%s\n",
             s, s, s, s, separator, s, mark, s, s, x_columns, s, s, s, s, s);
    put_text(b, text);
}

static char *reads_lvm(const struct bytes *b, struct import_file *file)
{
    char *path = reads("x.lvm", b->data, b->n, file);
    assert_string_equal(import_format_name(file->format), "lvm");
    return path;
}

static void no_x_columns_and_decimal_commas(void **state)
{
    (void)state;
    static struct bytes b;
    put_header(&b, "Tab", ",", "No");
    put_text(&b, "Channels\t2\t\t\nSamples\t3\t3\t\nDate\t2026/03/04\t2026/03/04\t\nTime\t09:51:40,72\t09:51:40,72\t\n"
                 "Y_Unit_Label\tNewtons\tm/s^2\t\nX_Dimension\tTime\tTime\t\nX0\t5,0E-1\t5,0E-1\t\n"
                 "Delta_X\t3,906250E-5\t3,906250E-5\t\n***End_of_Header***\t\t\t\n"
                 "X_Value\tExcitation (Trigger)\tResponse\tComment\n"
                 "\t0,914018\t1,204792\n\t-0,5\t1,2E-3\n\t0,25\t1\tlast\n");
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    char *path = reads_lvm(&b, &file);
    assert_int_equal(file.n_channels, 2);
    makes(&file, &choice, &record);
    assert_int_equal(record.n, 3);
    assert_true(record.t0_s == 0.5 && record.dt_s == 1.0 / 25600);
    assert_true(record_column(&record, "Excitation_Trigger_N")[1] == -0.5);
    assert_true(record_column(&record, "Response_mps2")[1] == 1.2e-3);
    assert_string_equal(record_meta(&record, "operator"), "ME");
    record_free(&record);
    import_free(&file);
    free(path);
}

static void one_x_column_that_repeats_start_and_step(void **state)
{
    (void)state;
    static struct bytes b;
    put_header(&b, "Comma", ".", "One");
    put_text(&b, "Channels,2,,\nY_Unit_Label,Volts,g,\nX_Dimension,Time,Time,\nX0,0.0E+0,0.0E+0,\n"
                 "Delta_X,1.953125E-5,1.953125E-5,\n***End_of_Header***,,,\nX_Value,Voltage,Acceleration,Comment\n"
                 "0.000000,-0.035229,0.5\n1.953125E-5,-0.034882,0.6\n3.906250E-5,-0.034191,0.7\n");
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    char *path = reads_lvm(&b, &file);
    assert_int_equal(file.n_channels, 2); /* X_Value is no channel of its own */
    makes(&file, &choice, &record);
    assert_true(record.t0_s == 0 && record.dt_s == 1.0 / 51200);
    assert_true(record_column(&record, "Acceleration_g")[2] == 0.7);
    record_free(&record);
    import_free(&file);
    free(path);
}

/* An X column that disagrees with X0 and Delta_X is the truth. */
static void x_values_win_over_the_stated_step(void **state)
{
    (void)state;
    static struct bytes b;
    put_header(&b, "Tab", ".", "One");
    put_text(&b, "Channels\t1\t\nX_Dimension\tTime\t\nX0\t0.0E+0\t\nDelta_X\t1.000000\t\n***End_of_Header***\t\t\n"
                 "X_Value\ta\tComment\n0.000000\t1\n0.250000\t2\n0.500000\t3\tok\n0.750000\t4\n");
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    char *path = reads_lvm(&b, &file);
    makes(&file, &choice, &record);
    assert_true(record.dt_s == 0.25);
    assert_int_equal(record.n_columns, 1);
    record_free(&record);
    import_free(&file);
    free(path);
    memcpy(strstr(b.data, "0.500000"), "0.600000", 8);
    path = reads_lvm(&b, &file);
    makes_none(&file, &choice, BF_BAD_FILE, "x.lvm:21: channel 'X_Value', sample 3", "--rate HZ");
    import_free(&file);
    free(path);
}

static void each_channel_with_its_own_x(void **state)
{
    (void)state;
    static struct bytes b;
    put_header(&b, "Tab", ".", "Multi");
    put_text(&b, "Channels\t2\t\t\t\nSamples\t4\t\t2\t\nY_Unit_Label\tVolts\t\tg\t\nX_Dimension\tTime\t\tTime\t\n"
                 "X0\t0.0E+0\t\t0.0E+0\t\nDelta_X\t0.001000\t\t0.002000\t\n***End_of_Header***\t\t\t\t\n"
                 "X_Value\tfast\tX_Value\tslow\tComment\n0.000000\t1\t0.000000\t5\n0.001000\t2\t0.002000\t6\n"
                 "0.002000\t3\t\t\n0.003000\t4\t\t\n");
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    const struct import_pick slow = {"slow", NULL};
    char *path = reads_lvm(&b, &file);
    assert_int_equal(channel_named(&file, "fast")->n, 4);
    assert_int_equal(channel_named(&file, "slow")->n, 2);
    makes_none(&file, &choice, BF_USAGE, "different samples or time axes", "--channel");
    choice.n_picks = 1;
    choice.picks = &slow;
    makes(&file, &choice, &record);
    assert_int_equal(record.n, 2);
    assert_true(record.dt_s == 0.002);
    record_free(&record);
    import_free(&file);
    free(path);
}

static void put_segment(struct bytes *b, const char *x0, const char *values)
{
    put_text(b, "Channels\t1\t\nY_Unit_Label\tVolts\t\nX_Dimension\tTime\t\nX0\t");
    put_text(b, x0);
    put_text(b, "\t\nDelta_X\t0.100000\t\n***End_of_Header***\t\t\nX_Value\tv\tComment\n");
    put_text(b, values);
    put_text(b, "\n");
}

static void segments_that_continue_are_joined_and_others_are_not(void **state)
{
    (void)state;
    static struct bytes b;
    struct import_file file;
    put_header(&b, "Tab", ".", "No");
    put_segment(&b, "0.0E+0", "\t1\n\t2\n");
    put_segment(&b, "2.0E-1", "\t3\n\t4\n\t5\n");
    put_segment(&b, "5.0E-1", "\t6\n");
    put_segment(&b, "9.0E-1", "\t7\n\t8\n");
    char *path = reads_lvm(&b, &file);
    assert_int_equal(file.n_channels, 2);
    assert_int_equal(file.channels[0].n, 6);
    for (size_t k = 0; k < 6; k++)
        assert_true(file.channels[0].x[k] == (double)k + 1);
    assert_true(file.channels[1].x[0] == 7 && file.channels[1].t0_s == 0.9);
    assert_string_equal(file.channels[1].about, "segment 4");
    import_free(&file);
    free(path);
}

static void damage_is_named(void **state)
{
    (void)state;
    static struct bytes b;
    put_header(&b, "Tab", ".", "No");
    refuses("x.lvm", b.data, 60, "cut off", "export");
    put_segment(&b, "0.0E+0", "\t1\n\tx\n");
    refuses("x.lvm", b.data, b.n, "x.lvm:21: column 2: 'x' is not a number", "repair");
    char *path;
    struct import_file file;
    struct bf_error err;
    const struct import_reading lvm = {.format = import_format_by_name("lvm")};
    assert_int_equal(read_as("x.lvm", "a,b\n1,2\n", 8, &lvm, &file, &path, &err), BF_BAD_FILE);
    assert_contains(err.text, "--format csv");
    free(path);
}

static void any_damage_is_survived(void **state)
{
    (void)state;
    static struct bytes good;
    put_header(&good, "Tab", ".", "Multi");
    put_text(
        &good,
        "Channels\t2\t\t\t\nY_Unit_Label\tVolts\t\tg\t\nX0\t0.0E+0\t\t0.0E+0\t\nDelta_X\t0.001\t\t0.001\t\n"
        "***End_of_Header***\t\t\t\t\nX_Value\ta\tX_Value\tb\tComment\n0.000\t1\t0.000\t5\n0.001\t2\t0.001\t6\n\n");
    put_segment(&good, "0.0E+0", "\t1\n");
    survives_damage("damaged.lvm", &good, "lvm", 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_x_columns_and_decimal_commas),
        cmocka_unit_test(one_x_column_that_repeats_start_and_step),
        cmocka_unit_test(x_values_win_over_the_stated_step),
        cmocka_unit_test(each_channel_with_its_own_x),
        cmocka_unit_test(segments_that_continue_are_joined_and_others_are_not),
        cmocka_unit_test(damage_is_named),
        cmocka_unit_test(any_damage_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
