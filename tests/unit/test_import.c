/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include "test_import.h"
#include "record/import/import_units.h"

static const char table[] = "Time (ms),force [N],accel [g],piezo\n"
                            "10,1,0.5,0.1\n12,2,-0.5,0.2\n14,3,1.5,0.3\n16,4,2,0.4\n18,5,3,0.5\n20,6,4,0.6\n";

static char *reads_table(const char *text, struct import_file *file)
{
    return reads("table.csv", text, strlen(text), file);
}

static void recognises_formats_by_name(void **state)
{
    (void)state;
    static const char *const formats[] = {"uff", "mat", "lvm", "wav", "csv"};
    for (size_t i = 0; i < 5; i++)
        assert_string_equal(import_format_name(import_format_by_name(formats[i])), formats[i]);
    assert_string_equal(import_format_name(import_format_by_name("UFF")), "uff");
    assert_null(import_format_by_name("xls"));
}

static void all_channels_become_columns_and_time_seconds(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    char *path = reads_table(table, &file);
    makes(&file, &choice, &record);
    assert_int_equal(record.n, 6);
    assert_true(fabs(record.t0_s - 0.010) < 1e-17 && fabs(record.dt_s - 0.002) < 1e-18);
    assert_int_equal(record.n_columns, 3);
    assert_true(record_column(&record, "force_N")[5] == 6);
    assert_true(record_column(&record, "accel_g")[2] == 1.5); /* nothing is converted */
    assert_true(record_column(&record, "piezo")[0] == 0.1);
    assert_string_equal(record_meta(&record, "source"), path);
    assert_string_equal(record_meta(&record, "source_sha256"), file.sha256);
    assert_string_equal(record_meta(&record, "source_format"), "csv");
    assert_string_equal(record_meta(&record, "unit_accel_g"), "g");
    assert_contains(record_meta(&record, "time_from"), "'Time' in ms");
    assert_contains(record_meta(&record, "imported_by"), "beamfit import");
    assert_null(record_meta(&record, "excitation"));
    record_free(&record);
    import_free(&file);
    free(path);
}

static void channels_are_chosen_renamed_scaled_and_cut(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    const struct import_pick picks[] = {{"accel [g]", "accel_mps2"}, {"#2", "hammer_N"}, {"piezo", NULL}};
    const struct import_scale scales[] = {{"accel_mps2", 9.80665, "m/s^2", NULL}, {"piezo", -2, NULL, NULL}};
    choice.n_picks = 3;
    choice.picks = picks;
    choice.n_scales = 2;
    choice.scales = scales;
    choice.from_s = 0.012;
    choice.to_s = 0.0171;
    choice.free_decay = true;
    choice.free_from_s = 0.0135;
    choice.command = "beamfit import me";
    char *path = reads_table(table, &file);
    makes(&file, &choice, &record);
    assert_int_equal(record.n, 3);
    assert_true(fabs(record.t0_s - 0.012) < 1e-15);
    assert_string_equal(record.columns[0].name, "accel_mps2");
    assert_true(record.columns[0].x[1] == 1.5 * 9.80665);
    assert_true(record.columns[1].x[0] == 2 && record.columns[2].x[2] == -0.8);
    assert_string_equal(record_meta(&record, "unit_accel_mps2"), "m/s^2");
    assert_contains(record_meta(&record, "scale_accel_mps2"), "9.80665 applied to values in g");
    assert_string_equal(record_meta(&record, "excitation"), "free_decay");
    assert_string_equal(record_meta(&record, "free_from_s"), "0.0135");
    assert_string_equal(record_meta(&record, "imported_by"), "beamfit import me");
    record_free(&record);
    import_free(&file);
    free(path);
}

/* What import writes, record_read() reads: axis, columns, metadata. */
static void the_record_survives_its_file(void **state)
{
    (void)state;
    struct import_file file;
    struct record record, back;
    struct bf_error err;
    struct import_choice choice = no_choice();
    choice.unknown_level = true;
    char *path = reads_table(table, &file), *out = temporary_file("out.csv", "", 0);
    makes(&file, &choice, &record);
    assert_int_equal(record_write(out, &record, 17, &err), BF_OK);
    if (record_read(out, &back, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_true(fabs(back.t0_s - record.t0_s) < 1e-15 && back.dt_s == record.dt_s);
    assert_memory_equal(back.columns[1].x, record.columns[1].x, record.n * sizeof(double));
    assert_string_equal(record_meta(&back, "excitation"), "unknown_level");
    assert_string_equal(record_meta(&back, "source_sha256"), file.sha256);
    record_free(&record);
    record_free(&back);
    import_free(&file);
    unlink(out);
    free(out);
    free(path);
}

/* A record is a foreign CSV as well, and keeps its metadata. */
static void a_record_imports_as_itself(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    char *path =
        reads_table("# excitation: free_decay\n# rig: B1\ntime_s,piezo_V\n0,1\n0.0009765625,2\n0.001953125,3\n", &file);
    makes(&file, &choice, &record);
    assert_true(record.dt_s == 1.0 / 1024);
    assert_string_equal(record.columns[0].name, "piezo_V");
    assert_string_equal(record_meta(&record, "rig"), "B1");
    assert_string_equal(record_meta(&record, "excitation"), "free_decay");
    record_free(&record);
    import_free(&file);
    free(path);
}

static void foreign_words_under_our_keys_are_not_ours(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    char *path = reads_table("# excitation: shaker\n# free_from_s: 7\nt,x\n0,1\n1,2\n2,3\n", &file);
    makes(&file, &choice, &record);
    assert_null(record_meta(&record, "excitation"));
    assert_null(record_meta(&record, "free_from_s"));
    assert_string_equal(record_meta(&record, "source_excitation"), "shaker");
    assert_string_equal(record_meta(&record, "source_free_from_s"), "7");
    record_free(&record);
    import_free(&file);
    free(path);
}

static void the_rate_overrides_the_times(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    choice.rate_Hz = 50;
    char *path = reads_table(table, &file);
    makes(&file, &choice, &record);
    assert_true(record.t0_s == 0 && record.dt_s == 0.02);
    assert_int_equal(record.n_columns, 3); /* the wrong time is no column */
    assert_contains(record_meta(&record, "time_from"), "--rate 50 Hz");
    record_free(&record);
    choice.rate_Hz = 0;
    choice.time_unit = "us";
    makes(&file, &choice, &record);
    assert_true(fabs(record.dt_s - 2e-6) < 1e-20);
    record_free(&record);
    import_free(&file);
    free(path);
}

static void impossible_choices_say_what_to_do(void **state)
{
    (void)state;
    struct import_file file;
    struct import_choice choice = no_choice();
    const struct import_pick absent = {"speed", NULL}, twice[] = {{"force", NULL}, {"force", NULL}},
                             time = {"force", "time_s"}, comma = {"force", "a,b"};
    const struct import_scale lost = {"speed", 2, NULL, NULL};
    char *path = reads_table(table, &file);
    choice.n_picks = 1;
    choice.picks = &absent;
    makes_none(&file, &choice, BF_USAGE, "--channel speed", "it has Time, force, accel, piezo");
    choice.n_picks = 2;
    choice.picks = twice;
    makes_none(&file, &choice, BF_USAGE, "two channels would become column 'force_N'", "rename");
    choice.n_picks = 1;
    choice.picks = &time;
    makes_none(&file, &choice, BF_USAGE, "'time_s' cannot be the name", "letters");
    choice.picks = &comma;
    makes_none(&file, &choice, BF_USAGE, "'a,b' cannot be the name", "letters");
    choice = no_choice();
    choice.time = "clock";
    makes_none(&file, &choice, BF_USAGE, "--time clock", "no such channel");
    choice.time = "force";
    makes_none(&file, &choice, BF_USAGE, "is in N", "unit of time");
    choice = no_choice();
    choice.time_unit = "N";
    makes_none(&file, &choice, BF_USAGE, "--time-unit N", "ms");
    choice = no_choice();
    choice.from_s = 5;
    makes_none(&file, &choice, BF_USAGE, "--from and --to leave no two samples", "0.01 s to 0.02 s");
    choice = no_choice();
    choice.free_decay = true;
    choice.free_from_s = 1;
    makes_none(&file, &choice, BF_USAGE, "--free-from 1", "outside the record");
    choice = no_choice();
    choice.n_scales = 1;
    choice.scales = &lost;
    makes_none(&file, &choice, BF_USAGE, "--scale speed", "no such channel");
    import_free(&file);
    free(path);
}

static void two_times_must_be_told_apart(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    char *path = reads_table("time_listed,time_corrected,v\n0,0,1\n1,0.2,2\n2,0.4,3\n3,0.6,4\n", &file);
    makes_none(&file, &choice, BF_USAGE, "'time_listed' and 'time_corrected' both look like time", "--time");
    choice.time = "time_corrected";
    makes(&file, &choice, &record);
    assert_true(fabs(record.dt_s - 0.2) < 1e-15);
    assert_int_equal(record.n_columns, 1);
    record_free(&record);
    import_free(&file);
    free(path);
}

static void times_that_are_not_uniform_have_a_remedy(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    char *path = reads_table("# note\nt,v\n0,1\n0.1,2\n\n0.2,3\n0.35,4\n0.4,5\n", &file);
    makes_none(&file, &choice, BF_BAD_FILE, "table.csv:7: channel 't', sample 4", "--rate HZ");
    choice.rate_Hz = 10;
    makes(&file, &choice, &record);
    assert_int_equal(record.n, 5);
    record_free(&record);
    import_free(&file);
    free(path);
}

static void units_are_known_as_people_write_them(void **state)
{
    (void)state;
    static const struct {
        const char *text, *suffix, *SI;
        double factor;
    } cases[] = {{"V", "V", "V", 1},
                 {"Volts", "V", "V", 1},
                 {"mV", "mV", "V", 1e-3},
                 {"m/s^2", "mps2", "mps2", 1},
                 {"m/s\xc2\xb2", "mps2", "mps2", 1},
                 {"g", "g", "mps2", 9.80665},
                 {"Newtons", "N", "N", 1},
                 {"mN", "mN", "N", 1e-3},
                 {"ms", "ms", "s", 1e-3},
                 {"mm", "mm", "m", 1e-3},
                 {"m", "m", "m", 1}};
    struct import_unit unit;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        assert_true(import_unit(cases[i].text, &unit));
        assert_string_equal(unit.suffix, cases[i].suffix);
        assert_string_equal(unit.SI, cases[i].SI);
        assert_true(unit.factor == cases[i].factor);
    }
    assert_false(import_unit("MV", &unit)); /* mega is not milli */
    assert_false(import_unit("", &unit));
    assert_true(import_unit_of_name("accel_m_s2", &unit));
    assert_string_equal(unit.suffix, "mps2");
    assert_true(import_unit_of_name("tip_m", &unit));
    assert_string_equal(unit.suffix, "m");
    assert_false(import_unit_of_name("force", &unit));
    assert_false(import_unit_of_name("V", &unit));
}

static void columns_are_named_after_channel_and_unit(void **state)
{
    (void)state;
    static const struct {
        char *name, *unit;
        const char *column;
    } cases[] = {{"Force", "N", "Force_N"},
                 {"accel_m_s2", "m/s^2", "accel_m_s2"},
                 {"tip speed (left)", "m/s", "tip_speed_left_mps"},
                 {"Spannung", "", "Spannung"},
                 {"time_s", "", "time_s_channel"},
                 {"???", "V", "channel_V"},
                 {"data.acc{2}", "", "data_acc_2"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct import_channel c = {.name = cases[i].name, .unit = cases[i].unit};
        char *column = import_column_name(&c);
        assert_string_equal(column, cases[i].column);
        free(column);
    }
}

static void time_is_known_by_its_name_and_unit(void **state)
{
    (void)state;
    static const struct {
        char *name, *unit;
        double factor; /* 0: not time */
    } cases[] = {{"time_s", "", 1},
                 {"Time", "ms", 1e-3},
                 {"t", "", 1},
                 {"Zeit", "s", 1},
                 {"time_s_as_listed", "", 1},
                 {"T",
                  "\xc2\xb0"
                  "C",
                  0},
                 {"t_us", "", 1e-6},
                 {"data.t", "", 1},
                 {"tip_m", "", 0},
                 {"X_Value", "", 1},
                 {"elapsed time", "", 1},
                 {"temperature", "", 0},
                 {"t_room", "", 0},
                 {"", "s", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct import_channel c = {.name = cases[i].name, .unit = cases[i].unit};
        double factor;
        bool is_time = import_looks_like_time(&c, &factor);
        assert_int_equal(is_time, cases[i].factor > 0);
        if (is_time)
            assert_true(factor == cases[i].factor);
    }
}

static void imports_the_recordings_beside_the_project(void **state)
{
    (void)state;
    static const struct {
        const char *file, *time;
        struct import_pick pick;
        size_t n;
        double rate_Hz, free_from_s;
    } files[] = {
        {"data/real/iitd_pzt_cantilever/pzt_free_decay.csv",
         "time_s_corrected",
         {"pzt_voltage_V", "piezo_V"},
         50000,
         5000,
         1.175},
        {"data/real/uofsc_steel_cantilever/shaker_test1.csv", NULL, {"accel_m_s2", "accel_mps2"}, 63041, 3200, 0},
        {"data/real/silverbox/SNLS80mV.csv", NULL, {"V2_output_V", NULL}, 131072, 1e7 / 16384, 0},
        {"data/open/o0_clean/train1.csv", NULL, {"piezo_V", NULL}, 4096, 1024, 0}};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        static const struct import_reading find_out = {.format = NULL};
        struct import_file file;
        struct record record;
        struct bf_error err;
        struct import_choice choice = no_choice();
        char *path = shared_file(files[i].file);
        if (path == NULL)
            skip();
        if (import_read(path, &find_out, &file, &err) != BF_OK)
            fail_msg("%s", err.text);
        choice.time = files[i].time;
        choice.n_picks = 1;
        choice.picks = &files[i].pick;
        choice.free_decay = files[i].free_from_s > 0;
        choice.free_from_s = files[i].free_from_s;
        makes(&file, &choice, &record);
        assert_int_equal(record.n, files[i].n);
        assert_true(fabs(record.dt_s * files[i].rate_Hz - 1) < 1e-14);
        record_free(&record);
        import_free(&file);
        free(path);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(recognises_formats_by_name),
        cmocka_unit_test(all_channels_become_columns_and_time_seconds),
        cmocka_unit_test(channels_are_chosen_renamed_scaled_and_cut),
        cmocka_unit_test(the_record_survives_its_file),
        cmocka_unit_test(a_record_imports_as_itself),
        cmocka_unit_test(foreign_words_under_our_keys_are_not_ours),
        cmocka_unit_test(the_rate_overrides_the_times),
        cmocka_unit_test(impossible_choices_say_what_to_do),
        cmocka_unit_test(two_times_must_be_told_apart),
        cmocka_unit_test(times_that_are_not_uniform_have_a_remedy),
        cmocka_unit_test(units_are_known_as_people_write_them),
        cmocka_unit_test(columns_are_named_after_channel_and_unit),
        cmocka_unit_test(time_is_known_by_its_name_and_unit),
        cmocka_unit_test(imports_the_recordings_beside_the_project),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
