/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include "ground/ground.h"
#include "test_files.h"

/* Lines of every length around the size of the buffer come back whole, from a file and from memory. */
static void lines_survive_the_buffer(void **state)
{
    (void)state;
    enum { LINES = 4000 };
    size_t n = 0, capacity = LINES * 1000 + 1;
    char *text = malloc(capacity), hex[65], expected[65];
    for (size_t i = 0; i < LINES; i++) {
        size_t length = i * 7919 % 997;
        memset(text + n, 'a' + (int)(i % 26), length);
        n += length;
        text[n++] = '\n';
    }
    char *path = temporary_file("lines", text, n);
    struct lines file, memory;
    struct bf_error err;
    assert_int_equal(lines_open(path, &file, &err), BF_OK);
    lines_from_memory("memory", text, n, &memory);
    const char *line, *same;
    size_t length, same_length;
    for (size_t i = 0; i < LINES; i++) {
        assert_int_equal(lines_next(&file, &line, &length, &err), BF_OK);
        assert_int_equal(lines_next(&memory, &same, &same_length, &err), BF_OK);
        assert_int_equal(length, i * 7919 % 997);
        assert_int_equal(same_length, length);
        assert_memory_equal(line, same, length);
        assert_int_equal(file.number, i + 1);
    }
    assert_int_equal(lines_next(&file, &line, &length, &err), BF_OK);
    assert_null(line);
    assert_int_equal(lines_next(&memory, &line, &length, &err), BF_OK);
    assert_null(line);
    hash_end(&file.hash, hex);
    hash_sha256_hex(text, n, expected);
    assert_string_equal(hex, expected);
    lines_close(&file);
    unlink(path);
    free(path);
    free(text);
}

static void line_ends_and_marks_are_taken_off(void **state)
{
    (void)state;
    static const char text[] = "\xef\xbb\xbfone\r\n\r\n\nlast";
    static const char *const expected[] = {"one", "", "", "last"};
    struct lines in;
    struct bf_error err;
    const char *line;
    size_t n;
    lines_from_memory("memory", text, sizeof text - 1, &in);
    for (size_t i = 0; i < 4; i++) {
        assert_int_equal(lines_next(&in, &line, &n, &err), BF_OK);
        assert_int_equal(n, strlen(expected[i]));
        assert_memory_equal(line, expected[i], n);
    }
    assert_int_equal(lines_next(&in, &line, &n, &err), BF_OK);
    assert_null(line);
}

static void what_is_no_text_is_refused(void **state)
{
    (void)state;
    struct lines in;
    struct bf_error err;
    const char *line;
    size_t n;
    lines_from_memory("m", "ok\na\0b\n", 7, &in);
    assert_int_equal(lines_next(&in, &line, &n, &err), BF_OK);
    assert_int_equal(lines_next(&in, &line, &n, &err), BF_BAD_FILE);
    assert_contains(err.text, "m:2: has a zero byte");
    lines_from_memory("m", "\xfe\xff\0a", 4, &in);
    assert_int_equal(lines_next(&in, &line, &n, &err), BF_BAD_FILE);
    assert_contains(err.text, "UTF-16");
}

static void a_whole_file_has_its_bytes_and_hash(void **state)
{
    (void)state;
    enum { N = 700001 }; /* more than one buffer */
    char *data = malloc(N), *got, hex[65], expected[65];
    size_t n;
    struct bf_error err;
    for (size_t i = 0; i < N; i++)
        data[i] = (char)(i * i >> 3);
    char *path = temporary_file("whole", data, N);
    assert_int_equal(lines_read_all(path, &got, &n, hex, &err), BF_OK);
    assert_int_equal(n, N);
    assert_memory_equal(got, data, N);
    assert_int_equal(got[n], 0);
    hash_sha256_hex(data, N, expected);
    assert_string_equal(hex, expected);
    free(got);
    assert_int_equal(lines_read_all("/nonexistent", &got, &n, hex, &err), BF_BAD_FILE);
    unlink(path);
    assert_int_equal(lines_read_all("/tmp", &got, &n, hex, &err), BF_BAD_FILE);
    free(path);
    free(data);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_survive_the_buffer),
        cmocka_unit_test(line_ends_and_marks_are_taken_off),
        cmocka_unit_test(what_is_no_text_is_refused),
        cmocka_unit_test(a_whole_file_has_its_bytes_and_hash),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
