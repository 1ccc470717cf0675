/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include "test_import.h"

/* A dataset 58 as the format's description has it, written here independently of the reader. */
struct dataset {
    int type; /* 2 real single, 4 real double, 5 complex single, 6 complex double */
    bool even, binary, big_endian, single_abscissa;
    int function, abscissa_kind, ordinate_kind;
    const char *unit;
};

enum { N = 7 };
static const double dt = 1.0 / 1024, start = 0.5;

static double real_part(size_t k)
{
    return (k % 2 ? -1 : 1) * (1.5 + (double)k * 0.25) * 1e-3;
}

static double imaginary_part(size_t k)
{
    return 100 - (double)k;
}

static double precise(const struct dataset *d, double x)
{
    return d->type == 2 || d->type == 5 ? (double)(float)x : x;
}

static void put_line(struct bytes *b, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put_line(struct bytes *b, const char *format, ...)
{
    char text[200];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    put_text(b, text);
    put_text(b, "\n");
}

/* IEEE numbers by hand: the byte order of the machine plays no part. */
static void put_float(struct bytes *b, double x, size_t size, bool big_endian)
{
    uint64_t bits = 0;
    float f = (float)x;
    uint32_t bits32;
    memcpy(&bits32, &f, sizeof bits32);
    if (size == 8)
        memcpy(&bits, &x, sizeof bits);
    else
        bits = bits32;
    for (size_t i = 0; i < size; i++) {
        char byte = (char)(bits >> 8 * (big_endian ? size - 1 - i : i) & 255);
        put_bytes(b, &byte, 1);
    }
}

/* Fortran's E13.5 and E20.12, as many as fit in 80 columns. */
static void put_values(struct bytes *b, const struct dataset *d)
{
    bool is_complex = d->type >= 5, is_double = d->type == 4 || d->type == 6;
    int columns = 0;
    for (size_t k = 0; k < N; k++) {
        double values[3] = {start + (double)k * dt, real_part(k), imaginary_part(k)};
        for (size_t i = d->even ? 1 : 0; i < (is_complex ? 3 : 2); i++) {
            bool narrow = i == 0 || !is_double;
            if (d->binary) {
                put_float(b, values[i], is_double && !(i == 0 && d->single_abscissa) ? 8 : 4, d->big_endian);
                continue;
            }
            char text[40];
            snprintf(text, sizeof text, narrow ? "%13.5E" : "%20.12E", values[i]);
            put_text(b, text);
            columns += narrow ? 13 : 20;
        }
        if (!d->binary && (columns > 80 - 20 * (is_complex ? 2 : 1) - (d->even ? 0 : 13) || k == N - 1)) {
            put_text(b, "\n");
            columns = 0;
        }
    }
}

static void put_dataset(struct bytes *b, const struct dataset *d)
{
    put_line(b, "%6d", -1);
    if (d->binary)
        put_line(b, "%6db%6d%6d%12d%12d%6d%6d%12d%12d", 58, d->big_endian ? 2 : 1, 2, 11, 12345, 0, 0, 0, 0);
    else
        put_line(b, "%6d", 58);
    put_line(b, "%-80s", "hammer hit 3");
    for (int i = 0; i < 4; i++)
        put_line(b, "%-80s", "NONE");
    put_line(b, "%5d%10d%5d%10d %-10s%10d%4d %-10s%10d%4d", d->function, 1, 0, 0, "NONE", 12, -3, "NONE", 1, 3);
    put_line(b, "%10d%10d%10d%13.5E%13.5E%13.5E", d->type, N, d->even, d->even ? start : 0.0, d->even ? dt : 0.0, 0.0);
    put_line(b, "%10d%5d%5d%5d %-20s %-20s", d->abscissa_kind, 0, 0, 0, "Time", "s");
    put_line(b, "%10d%5d%5d%5d %-20s %-20s", d->ordinate_kind, 0, 0, 0, "Acc", d->unit);
    put_line(b, "%10d%5d%5d%5d %-20s %-20s", 0, 0, 0, 0, "NONE", "NONE");
    put_line(b, "%10d%5d%5d%5d %-20s %-20s", 0, 0, 0, 0, "NONE", "NONE");
    put_values(b, d);
    put_line(b, "%s%6d", d->binary ? "\n" : "", -1);
}

static const struct dataset plain = {
    .type = 4, .even = true, .function = 1, .abscissa_kind = 17, .ordinate_kind = 12, .unit = "m/s^2"};

static void every_kind_of_values_is_read(void **state)
{
    (void)state;
    static const int types[] = {2, 4, 5, 6};
    for (int i = 0; i < 32; i++) {
        struct dataset d = plain;
        d.type = types[i % 4];
        d.even = i & 4;
        d.binary = i & 8;
        d.big_endian = i & 16;
        struct bytes *b = calloc(1, sizeof *b);
        struct import_file file;
        put_dataset(b, &d);
        char *path = reads("x.uff", b->data, b->n, &file);
        bool is_complex = d.type >= 5;
        assert_int_equal(file.n_channels, (d.even ? 0 : 1) + (is_complex ? 2 : 1));
        const struct import_channel *c =
            channel_named(&file, is_complex ? "acceleration_12-Z_re" : "acceleration_12-Z");
        assert_int_equal(c->n, N);
        for (size_t k = 0; k < N; k++) {
            assert_true(fabs(c->x[k] - precise(&d, real_part(k))) <= (d.binary ? 0 : 1e-9));
            if (is_complex)
                assert_true(channel_named(&file, "acceleration_12-Z_im")->x[k] == precise(&d, imaginary_part(k)));
        }
        assert_string_equal(c->unit, "m/s^2");
        assert_string_equal(c->about, "hammer hit 3");
        struct import_choice choice = no_choice();
        struct record record;
        makes(&file, &choice, &record);
        assert_true(fabs(record.dt_s / dt - 1) < (d.even ? 1e-15 : 1e-2)); /* E13.5 times: 5e-6 s of 1e-3 s */
        assert_true(fabs(record.t0_s - start) < 1e-5);
        record_free(&record);
        import_free(&file);
        free(path);
        free(b);
    }
}

/* Files exist with single and with double precision abscissae beside double values. */
static void an_uneven_binary_abscissa_may_be_single(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct dataset d = plain;
        d.type = i & 1 ? 6 : 4;
        d.binary = true;
        d.even = false;
        d.single_abscissa = true;
        d.big_endian = i & 2;
        struct bytes *b = calloc(1, sizeof *b);
        struct import_file file;
        put_dataset(b, &d);
        put_dataset(b, &plain); /* and the reader finds its way behind it */
        char *path = reads("x.uff", b->data, b->n, &file);
        const struct import_channel *t = channel_named(&file, "time");
        for (size_t k = 0; k < N; k++) {
            assert_true(t->x[k] == (double)(float)(start + (double)k * dt));
            assert_true(file.channels[1].x[k] == real_part(k));
        }
        assert_true(channel_named(&file, i & 1 ? "acceleration_12-Z" : "acceleration_12-Z_2")->n == N);
        import_free(&file);
        free(path);
        free(b);
    }
}

static void several_datasets_and_others_between(void **state)
{
    (void)state;
    struct bytes *b = calloc(1, sizeof *b);
    struct dataset force = plain, spectrum = plain;
    force.ordinate_kind = 13;
    force.unit = "NONE";
    spectrum.function = 4;
    spectrum.abscissa_kind = 18;
    spectrum.type = 6;
    put_line(b, "%6d", -1);
    put_line(b, "%6d", 151);
    put_line(b, "%-80s", "my beam");
    put_line(b, "NONE");
    put_line(b, "%6d", -1);
    put_line(b, "%6d", -1);
    put_line(b, "%6d", 164);
    put_line(b, "%10d%-20s%10d", 1, "SI: meter (newton)", 2);
    put_line(b, "%25.17E%25.17E%25.17E", 1.0, 1.0, 1.0);
    put_line(b, "%6d", -1);
    put_dataset(b, &plain);
    put_dataset(b, &force);
    put_dataset(b, &spectrum);
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    const struct import_pick pick = {"acceleration_12-Z_re", NULL};
    char *path = reads("x.unv", b->data, b->n, &file);
    assert_string_equal(import_format_name(file.format), "uff");
    assert_int_equal(file.n_channels, 4);
    assert_string_equal(channel_named(&file, "force_12-Z")->unit, "N"); /* dataset 164 says SI */
    assert_null(channel_named(&file, "acceleration_12-Z_re")->unusable);
    assert_true(channel_named(&file, "acceleration_12-Z_re")->over_frequency);
    makes(&file, &choice, &record); /* what is in time */
    assert_int_equal(record.n_columns, 2);
    assert_string_equal(record.columns[0].name, "acceleration_12_Z_mps2");
    assert_string_equal(record_meta(&record, "source_title"), "my beam");
    assert_string_equal(record_meta(&record, "source_units"), "SI: meter (newton)");
    record_free(&record);
    choice.n_picks = 1;
    choice.picks = &pick;
    makes_none(&file, &choice, BF_USAGE, "frequency response", "OUTPUT/INPUT_re");
    const struct import_pick parts[] = {{"acceleration_12-Z_re", "accel_mps2/hammer_N_re"},
                                        {"acceleration_12-Z_im", "accel_mps2/hammer_N_im"}};
    choice.n_picks = 2;
    choice.picks = parts;
    choice.averages = 5;
    makes(&file, &choice, &record);
    assert_true(record.over_frequency);
    assert_int_equal(record.n, N);
    assert_string_equal(record_meta(&record, "averages"), "5");
    assert_string_equal(record_meta(&record, "frequency_from"), "the file's start and step");
    record_free(&record);
    import_free(&file);
    free(path);
    free(b);
}

/* Datasets that repeat the same times make one record. */
static void uneven_datasets_with_equal_times_fit_together(void **state)
{
    (void)state;
    struct bytes *b = calloc(1, sizeof *b);
    struct dataset d = plain, force = plain;
    struct import_file file;
    struct record record;
    struct import_choice choice = no_choice();
    d.even = force.even = false;
    force.ordinate_kind = 13;
    force.unit = "N";
    put_dataset(b, &d);
    put_dataset(b, &force);
    char *path = reads("x.uff", b->data, b->n, &file);
    makes(&file, &choice, &record);
    assert_int_equal(record.n_columns, 2);
    assert_non_null(record_column(&record, "force_12_Z_N"));
    record_free(&record);
    import_free(&file);
    free(path);
    free(b);
}

/* Numbers as Fortran writes them: D exponents, three digits without a letter, neighbours that touch. */
static void fortran_numbers_are_read(void **state)
{
    (void)state;
    struct bytes *b = calloc(1, sizeof *b);
    put_line(b, "%6d\n%6d", -1, 58);
    for (int i = 0; i < 5; i++)
        put_line(b, "NONE");
    put_line(b, "%5d%10d%5d%10d %-10s%10d%4d %-10s%10d%4d", 1, 1, 0, 0, "NONE", 0, 0, "NONE", 0, 0);
    put_line(b, "%10d%10d%10d%13s%13s%13.5E", 2, 5, 1, "0.00000D+00", "1.00000D-03", 0.0);
    for (int i = 0; i < 4; i++)
        put_line(b, "%10d%5d%5d%5d %-20s %-20s", i == 0 ? 17 : 0, 0, 0, 0, "NONE", "NONE");
    put_line(b, "  1.50000D+00 -2.50000-100-1.000000E+00-2.000000E+00  .25000E+01");
    put_line(b, "%6d", -1);
    struct import_file file;
    char *path = reads("x.uff", b->data, b->n, &file);
    const double expected[] = {1.5, -2.5e-100, -1, -2, 2.5};
    assert_int_equal(file.channels[0].n, 5);
    for (size_t k = 0; k < 5; k++)
        assert_true(file.channels[0].x[k] == expected[k]);
    assert_true(fabs(file.channels[0].dt_s - 1e-3) < 1e-18);
    import_free(&file);
    free(path);
    free(b);
}

static void carriage_returns_do_no_harm(void **state)
{
    (void)state;
    struct bytes *b = calloc(1, sizeof *b), *crlf = calloc(1, sizeof *crlf);
    struct import_file file;
    put_dataset(b, &plain);
    for (size_t i = 0; i < b->n; i++)
        put_bytes(crlf, b->data[i] == '\n' ? "\r\n" : &b->data[i], b->data[i] == '\n' ? 2 : 1);
    char *path = reads("x.uff", crlf->data, crlf->n, &file);
    assert_true(fabs(file.channels[0].x[N - 1] - real_part(N - 1)) < 1e-12);
    import_free(&file);
    free(path);
    free(crlf);
    free(b);
}

/* Cut off anywhere in its values, a file is refused; a binary one that went through a text transfer, too. */
static void cut_off_files_are_refused(void **state)
{
    (void)state;
    for (int binary = 0; binary < 2; binary++) {
        struct bytes *b = calloc(1, sizeof *b);
        struct dataset d = plain;
        d.binary = binary;
        put_dataset(b, &d);
        refuses("x.uff", b->data, b->n - 40, "dataset 58", "cut off");
        refuses("x.uff", b->data, 400, "header", "cut off");
        refuses("x.uff", b->data, 600, "dataset 58", ":");
        free(b);
    }
    refuses("x.uff", "    -1\n    58\n", 14, "header", "cut off");
    refuses("x.uff", "    -1\n  2411\n 1 1 1 1\n    -1\n", 31, "no channel", "exported");
    refuses("x.uff", "    -1\n    58b     1     3          11  1 0 0 0 0\n", 51, "float format 3", "export as text");
}

static void any_damage_is_survived(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct bytes *b = calloc(1, sizeof *b);
        struct dataset d = plain;
        d.binary = i;
        d.even = !i;
        put_dataset(b, &d);
        survives_damage("damaged.uff", b, "uff", 1);
        free(b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_values_is_read),
        cmocka_unit_test(an_uneven_binary_abscissa_may_be_single),
        cmocka_unit_test(several_datasets_and_others_between),
        cmocka_unit_test(uneven_datasets_with_equal_times_fit_together),
        cmocka_unit_test(fortran_numbers_are_read),
        cmocka_unit_test(carriage_returns_do_no_harm),
        cmocka_unit_test(cut_off_files_are_refused),
        cmocka_unit_test(any_damage_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
