/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <signal.h>
#include <sys/mman.h>
#include "test_import.h"
#include "record/import/import_channel.h"
#include "record/import/import_isolated.h"

static enum bf_status good_reader(struct import_file *file, const char *data, size_t n,
                                  const struct import_reading *how, struct bf_error *err)
{
    (void)how;
    (void)err;
    for (size_t i = 0; i < 3; i++) {
        double *x = malloc((n + 200000 * i) * sizeof *x); /* more than a pipe holds */
        for (size_t k = 0; k < n + 200000 * i; k++)
            x[k] = k < n ? (double)data[k] : (double)(k * i);
        struct import_channel *c = import_add(file, "same", 4, x, n + 200000 * i);
        c->dt_s = 0.125;
        import_set_text(&c->unit, "V", 1);
        import_set_text(&c->about, "note", 4);
    }
    import_add_meta(file, "key", "value", 5);
    import_set_rate(file, 8, "here");
    return BF_OK;
}

static enum bf_status failing_reader(struct import_file *file, const char *data, size_t n,
                                     const struct import_reading *how, struct bf_error *err)
{
    (void)data;
    (void)n;
    (void)how;
    return bf_fail_at(err, file->path, 7, "nonsense");
}

static enum bf_status dying_reader(struct import_file *file, const char *data, size_t n,
                                   const struct import_reading *how, struct bf_error *err)
{
    (void)n;
    (void)how;
    if (data[0] == 'k')
        raise(SIGKILL);
    if (data[0] == 'e')
        _exit(0);
    return failing_reader(file, data, n, how, err);
}

/* The process cannot send all that it promised: half of it cannot be read. */
static enum bf_status half_reader(struct import_file *file, const char *data, size_t n,
                                  const struct import_reading *how, struct bf_error *err)
{
    (void)data;
    (void)n;
    (void)how;
    (void)err;
    const size_t size = 1 << 21;
    // cppcheck-suppress invalidFunctionArg
    char *memory = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED || mprotect(memory + size / 2, size / 2, PROT_NONE) != 0)
        _exit(0);
    import_add(file, "half", 4, (double *)(void *)memory, size / sizeof(double));
    return BF_OK;
}

static void everything_comes_back(void **state)
{
    (void)state;
    struct import_file file = {.path = "p"};
    struct bf_error err = {0};
    const struct import_reading how = {.format = NULL};
    assert_int_equal(import_isolated(good_reader, &file, "abc", 3, &how, &err), BF_OK);
    assert_int_equal(file.n_channels, 3);
    assert_string_equal(file.channels[0].name, "same");
    assert_string_equal(file.channels[1].name, "same_2");
    assert_string_equal(file.channels[2].unit, "V");
    assert_string_equal(file.channels[2].about, "note");
    assert_int_equal(file.channels[2].n, 400003);
    assert_true(file.channels[0].x[2] == 'c' && file.channels[2].x[400002] == 800004);
    assert_true(file.channels[1].dt_s == 0.125 && file.rate_Hz == 8);
    assert_string_equal(file.rate_from, "here");
    assert_string_equal(file.meta[0].key, "key");
    assert_string_equal(file.meta[0].value, "value");
    import_free(&file);
}

static void refused(import_reader *reader, const char *data, const char *phrase)
{
    struct import_file file = {.path = "some/file.mat"};
    struct bf_error err = {0};
    const struct import_reading how = {.format = NULL};
    assert_int_equal(import_isolated(reader, &file, data, strlen(data), &how, &err), BF_BAD_FILE);
    assert_contains(err.text, "some/file.mat");
    assert_contains(err.text, phrase);
    import_free(&file);
}

static void an_error_comes_back(void **state)
{
    (void)state;
    refused(failing_reader, "x", "some/file.mat:7: nonsense");
}

static void a_death_is_a_damaged_file(void **state)
{
    (void)state;
    refused(dying_reader, "kill", "Killed");
    refused(dying_reader, "exit", "damaged");
}

static void a_half_answer_is_a_damaged_file(void **state)
{
    (void)state;
    refused(half_reader, "abc", "damaged");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(everything_comes_back),
        cmocka_unit_test(an_error_comes_back),
        cmocka_unit_test(a_death_is_a_damaged_file),
        cmocka_unit_test(a_half_answer_is_a_damaged_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
