/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <matio.h>
#include "test_import.h"

enum { N = 6 };
static double t[N], a[N], matrix[2 * N], imaginary[N];
static float single[N];
static int16_t counts[N];

static void fill(void)
{
    for (int k = 0; k < N; k++) {
        t[k] = 0.25 + k * 0.001;
        a[k] = sin(k);
        matrix[k] = k * 10;
        matrix[N + k] = k * 100;
        imaginary[k] = -k;
        single[k] = (float)k / 8;
        counts[k] = (int16_t)(1000 * k - 2000);
    }
}

static matvar_t *variable(const char *name, enum matio_classes c, enum matio_types type, size_t rows, size_t columns,
                          void *data, int options)
{
    size_t dims[2] = {rows, columns};
    matvar_t *v = Mat_VarCreate(name, c, type, 2, dims, data, options);
    assert_non_null(v);
    return v;
}

static void put_variable(mat_t *mat, matvar_t *v)
{
    assert_int_equal(Mat_VarWrite(mat, v, MAT_COMPRESSION_NONE), 0);
    Mat_VarFree(v);
}

/* Vectors, a matrix, other types, a complex vector, a struct in a struct, a cell, and text. */
static char *write_mat(enum mat_ft version)
{
    char *path = temporary_file("x.mat", "", 0);
    mat_t *mat = Mat_CreateVer(path, NULL, version);
    assert_non_null(mat);
    struct mat_complex_split_t parts = {a, imaginary};
    double rate = 1000;
    put_variable(mat, variable("t", MAT_C_DOUBLE, MAT_T_DOUBLE, N, 1, t, 0));
    put_variable(mat, variable("acc", MAT_C_DOUBLE, MAT_T_DOUBLE, 1, N, a, 0));
    put_variable(mat, variable("m", MAT_C_DOUBLE, MAT_T_DOUBLE, N, 2, matrix, 0));
    put_variable(mat, variable("Fs", MAT_C_DOUBLE, MAT_T_DOUBLE, 1, 1, &rate, 0));
    put_variable(mat, variable("z", MAT_C_DOUBLE, MAT_T_DOUBLE, N, 1, &parts, MAT_F_COMPLEX));
    if (version != MAT_FT_MAT4) {
        put_variable(mat, variable("note", MAT_C_CHAR, MAT_T_UTF8, 1, 5, "hello", 0));
        const char *outer_fields[] = {"daq"}, *inner_fields[] = {"force", "raw"};
        size_t one[2] = {1, 1};
        matvar_t *outer = Mat_VarCreateStruct("run", 2, one, outer_fields, 1);
        matvar_t *inner = Mat_VarCreateStruct("daq", 2, one, inner_fields, 2);
        Mat_VarSetStructFieldByName(inner, "force", 0, variable("force", MAT_C_SINGLE, MAT_T_SINGLE, N, 1, single, 0));
        Mat_VarSetStructFieldByName(inner, "raw", 0, variable("raw", MAT_C_INT16, MAT_T_INT16, N, 1, counts, 0));
        Mat_VarSetStructFieldByName(outer, "daq", 0, inner);
        put_variable(mat, outer);
    }
    assert_int_equal(Mat_Close(mat), 0);
    return path;
}

static void reads_path(const char *path, struct import_file *file)
{
    static const struct import_reading find_out = {.format = NULL};
    struct bf_error err;
    if (import_read(path, &find_out, file, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_string_equal(import_format_name(file->format), "mat");
}

static void every_version_is_read(void **state)
{
    (void)state;
    static const enum mat_ft versions[] = {MAT_FT_MAT4, MAT_FT_MAT5, MAT_FT_MAT73};
    for (size_t i = 0; i < 3; i++) {
        struct import_file file;
        char *path = write_mat(versions[i]);
        reads_path(path, &file);
        assert_memory_equal(channel_named(&file, "t")->x, t, sizeof t);
        assert_memory_equal(channel_named(&file, "acc")->x, a, sizeof a);
        assert_memory_equal(channel_named(&file, "m_2")->x, matrix + N, N * sizeof(double));
        assert_memory_equal(channel_named(&file, "z_re")->x, a, sizeof a);
        assert_true(channel_named(&file, "z_im")->x[3] == -3);
        if (versions[i] != MAT_FT_MAT4)
            for (int k = 0; k < N; k++) {
                assert_true(channel_named(&file, "run.daq.force")->x[k] == k / 8.0);
                assert_true(channel_named(&file, "run.daq.raw")->x[k] == 1000.0 * k - 2000);
            }
        assert_true(file.rate_Hz == 1000);
        assert_string_equal(file.rate_from, "variable 'Fs'");
        import_free(&file);
        unlink(path);
        free(path);
    }
}

static void a_record_with_the_time_vector(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    const struct import_pick picks[] = {{"acc", "accel_mps2"}, {"run.daq.force", "hammer_N"}, {"m_1", NULL}};
    char *path = write_mat(MAT_FT_MAT5);
    reads_path(path, &file);
    choice.n_picks = 3;
    choice.picks = picks;
    makes(&file, &choice, &record);
    assert_int_equal(record.n, N);
    assert_true(fabs(record.t0_s - 0.25) < 1e-15 && fabs(record.dt_s - 0.001) < 1e-15);
    assert_true(record_column(&record, "hammer_N")[5] == 0.625);
    assert_true(record_column(&record, "m_1")[2] == 20);
    assert_contains(record_meta(&record, "time_from"), "'t' in s");
    record_free(&record);
    makes(&file,
          &(struct import_choice){.rate_Hz = 10,
                                  .from_s = (double)NAN,
                                  .to_s = (double)NAN,
                                  .free_from_s = (double)NAN,
                                  .n_picks = 1,
                                  .picks = picks},
          &record);
    assert_true(record.dt_s == 0.1 && record.t0_s == 0);
    record_free(&record);
    import_free(&file);
    unlink(path);
    free(path);
}

/* A matrix that lies down has its channels in rows; a lone rate gives the axis. */
static void rows_and_rates(void **state)
{
    (void)state;
    char *path = temporary_file("x.mat", "", 0);
    mat_t *mat = Mat_CreateVer(path, NULL, MAT_FT_MAT5);
    double rows[2 * N], dt = 0.004;
    for (int k = 0; k < N; k++) {
        rows[2 * k] = k;
        rows[2 * k + 1] = -k;
    }
    put_variable(mat, variable("y", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, N, rows, 0));
    put_variable(mat, variable("dt", MAT_C_DOUBLE, MAT_T_DOUBLE, 1, 1, &dt, 0));
    Mat_Close(mat);
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    reads_path(path, &file);
    makes(&file, &choice, &record);
    assert_int_equal(record.n_columns, 2);
    assert_int_equal(record.n, N);
    for (int k = 0; k < N; k++) {
        assert_true(record_column(&record, "y_1")[k] == k);
        assert_true(record_column(&record, "y_2")[k] == -k);
    }
    assert_true(fabs(record.dt_s - 0.004) < 1e-15);
    assert_contains(record_meta(&record, "time_from"), "variable 'dt'");
    record_free(&record);
    import_free(&file);
    unlink(path);
    free(path);
}

static void what_has_no_numbers_is_refused(void **state)
{
    (void)state;
    char *path = temporary_file("x.mat", "", 0);
    mat_t *mat = Mat_CreateVer(path, NULL, MAT_FT_MAT5);
    put_variable(mat, variable("note", MAT_C_CHAR, MAT_T_UTF8, 1, 5, "hello", 0));
    Mat_Close(mat);
    static const struct import_reading find_out = {.format = NULL};
    struct import_file file;
    struct bf_error err;
    assert_int_equal(import_read(path, &find_out, &file, &err), BF_BAD_FILE);
    assert_contains(err.text, "no numeric variable");
    unlink(path);
    free(path);
    refuses("x.mat", "MATLAB 5.0 MAT-file", 19, "no MATLAB file", "save");
    refuses("x.mat", "\x89HDF\r\n\x1a\n\0\0\0\0", 12, "no MATLAB file", "save");
}

/* Ten million rows in a file of some hundred bytes: zeros that nobody recorded. */
static void a_variable_larger_than_its_file_is_left_out(void **state)
{
    (void)state;
    enum { ROWS_AT = 128 + 8 + 16 + 8 }; /* header, tag of the matrix, its flags, tag of its dimensions */
    const uint32_t claimed = 10000000;
    char *path = temporary_file("x.mat", "", 0);
    mat_t *mat = Mat_CreateVer(path, NULL, MAT_FT_MAT5);
    put_variable(mat, variable("t", MAT_C_DOUBLE, MAT_T_DOUBLE, N, 1, t, 0));
    Mat_Close(mat);
    FILE *f = fopen(path, "r+b");
    uint32_t rows = 0;
    assert_non_null(f);
    assert_int_equal(fseek(f, ROWS_AT, SEEK_SET), 0);
    assert_int_equal(fread(&rows, sizeof rows, 1, f), 1);
    assert_int_equal(rows, N);
    assert_int_equal(fseek(f, ROWS_AT, SEEK_SET), 0);
    assert_int_equal(fwrite(&claimed, sizeof claimed, 1, f), 1);
    fclose(f);
    static const struct import_reading find_out = {.format = NULL};
    struct import_file file;
    struct bf_error err;
    assert_int_equal(import_read(path, &find_out, &file, &err), BF_BAD_FILE);
    assert_contains(err.text, "no numeric variable");
    unlink(path);
    free(path);
}

static void any_damage_is_survived(void **state)
{
    (void)state;
    static struct bytes good;
    char *path = write_mat(MAT_FT_MAT5);
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    good.n = fread(good.data, 1, sizeof good.data, f);
    fclose(f);
    unlink(path);
    free(path);
    survives_damage("damaged.mat", &good, "mat", 41);
}

int main(void)
{
    fill();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_version_is_read),
        cmocka_unit_test(a_record_with_the_time_vector),
        cmocka_unit_test(rows_and_rates),
        cmocka_unit_test(what_has_no_numbers_is_refused),
        cmocka_unit_test(a_variable_larger_than_its_file_is_left_out),
        cmocka_unit_test(any_damage_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
