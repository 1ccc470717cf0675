/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "test_import.h"

/* A NumPy file of version 1 (2 with long_header) with this header and these bytes behind it. */
static void put_array(struct bytes *b, const char *header, bool long_header, const void *data, size_t n)
{
    const size_t length = strlen(header);
    const char version[2] = {long_header ? 2 : 1, 0};
    b->n = 0;
    put_bytes(b, "\x93NUMPY", 6);
    put_bytes(b, version, 2);
    for (size_t i = 0; i < (long_header ? 4U : 2U); i++)
        put_bytes(b, (const char[]){(char)(length >> (8 * i))}, 1);
    put_text(b, header);
    put_bytes(b, data, n);
}

static const double numbers[6] = {0.0, 1.5, 0.25, -2.0, 0.5, 3.25};

static void a_matrix_is_samples_by_channels(void **state)
{
    (void)state;
    static const char *const headers[] = {"{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }\n",
                                          "{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3), }\n"};
    struct bytes b;
    struct import_file file;
    for (size_t i = 0; i < 2; i++) { /* the second is the same numbers, each sample a column */
        put_array(&b, headers[i], i == 1, numbers, sizeof numbers);
        char *path = reads("x.npy", b.data, b.n, &file);
        assert_string_equal(import_format_name(file.format), "npy");
        assert_int_equal(file.n_channels, 2);
        for (size_t k = 0; k < 3; k++) {
            assert_true(file.channels[0].x[k] == numbers[2 * k]);
            assert_true(file.channels[1].x[k] == numbers[2 * k + 1]);
        }
        import_free(&file);
        free(path);
    }
}

static void every_kind_of_number_is_read(void **state)
{
    (void)state;
    static const struct {
        const char *descr;
        const char *bytes;
        size_t n;
        double first, second;
    } cases[] = {
        {"<i2", "\xfe\xff\x03\x00", 4, -2, 3},
        {">i2", "\xff\xfe\x00\x03", 4, -2, 3},
        {"|u1", "\xff\x03", 2, 255, 3},
        {"|i1", "\xff\x03", 2, -1, 3},
        {"|b1", "\x01\x00", 2, 1, 0},
        {"<u4", "\xff\xff\xff\xff\x01\0\0\0", 8, 4294967295.0, 1},
        {">f4", "\x3f\x80\0\0\xc0\0\0\0", 8, 1, -2},
        {"<i8", "\xff\xff\xff\xff\xff\xff\xff\xff\x02\0\0\0\0\0\0\0", 16, -1, 2},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char header[100];
        struct bytes b;
        struct import_file file;
        (void)snprintf(header, sizeof header, "{'descr': '%s', 'fortran_order': False, 'shape': (2,), }",
                       cases[i].descr);
        put_array(&b, header, false, cases[i].bytes, cases[i].n);
        char *path = reads("x.npy", b.data, b.n, &file);
        assert_int_equal(file.n_channels, 1);
        assert_int_equal(file.channels[0].n, 2);
        if (file.channels[0].x[0] != cases[i].first || file.channels[0].x[1] != cases[i].second)
            fail_msg("%s: %g %g", cases[i].descr, file.channels[0].x[0], file.channels[0].x[1]);
        import_free(&file);
        free(path);
    }
}

static void fields_keep_their_names_and_complex_ones_become_two(void **state)
{
    (void)state;
    static const char header[] = "{'descr': [('time', '<f8'), ('z', '<c16')], 'fortran_order': False, 'shape': (2,), }";
    struct bytes b;
    struct import_file file;
    put_array(&b, header, false, numbers, sizeof numbers);
    char *path = reads("x.npy", b.data, b.n, &file);
    assert_int_equal(file.n_channels, 3);
    assert_string_equal(file.channels[0].name, "time");
    assert_string_equal(file.channels[1].name, "z_re");
    assert_string_equal(file.channels[2].name, "z_im");
    assert_true(file.channels[0].x[1] == numbers[3] && file.channels[2].x[1] == numbers[5]);
    import_free(&file);
    free(path);
}

static void what_holds_no_numbers_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *header, *what, *to_do;
    } cases[] = {
        {"{'descr': '<U1', 'fortran_order': False, 'shape': (6,), }", "no array of numbers", "numpy.save"},
        {"{'descr': '|O', 'fortran_order': False, 'shape': (6,), }", "no array of numbers", "numpy.save"},
        {"{'descr': '<f2', 'fortran_order': False, 'shape': (6,), }", "no array of numbers", "float64"},
        {"{'descr': [('a', '<f8', (2,))], 'fortran_order': False, 'shape': (6,), }", "no array", "numpy.save"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2, 3), }", "3 dimensions", "matrix"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (), }", "0 dimensions", "vector"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (7,), }", "cut off", "again"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999, 2), }", "cut off", "again"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (0,), }", "empty", "again"},
        {"{'shape': (6,)}", "header", "again"},
    };
    struct bytes b;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        put_array(&b, cases[i].header, false, numbers, sizeof numbers);
        refuses("x.npy", b.data, b.n, cases[i].what, cases[i].to_do);
    }
    put_array(&b, cases[0].header, false, numbers, 0);
    refuses("x.npy", b.data, 20, "cut off in its header", "again");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_matrix_is_samples_by_channels),
        cmocka_unit_test(every_kind_of_number_is_read),
        cmocka_unit_test(fields_keep_their_names_and_complex_ones_become_two),
        cmocka_unit_test(what_holds_no_numbers_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
