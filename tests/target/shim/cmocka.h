/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * cmocka.h — as much of cmocka's interface as the unit tests of lib/ use, in one header, for a board without an operating
 * system. A failed assertion ends its test; the group's result is the number of failed tests.
 */
#ifndef TARGET_CMOCKA_H
#define TARGET_CMOCKA_H

#include <inttypes.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

struct CMUnitTest {
    const char *name;
    void (*test)(void **state);
    int (*setup)(void **state), (*teardown)(void **state);
};

__attribute__((noreturn)) void _fail(const char *file, int line);
int cmocka_run(const struct CMUnitTest tests[], int n, int (*setup)(void **state), int (*teardown)(void **state));

static inline void cmocka_must(int good, const char *what, const char *file, int line)
{
    if (!good) {
        printf("%s\n", what);
        _fail(file, line);
    }
}

static inline void cmocka_must_equal(intmax_t a, intmax_t b, const char *what, const char *file, int line)
{
    if (a != b) {
        printf("%ld and %ld: %s\n", (long)a, (long)b, what);
        _fail(file, line);
    }
}

#define CMOCKA_MUST(good, what)    cmocka_must((good) ? 1 : 0, what, __FILE__, __LINE__)
#define print_message              printf
#define print_error                printf
#define fail_msg(...)              (printf(__VA_ARGS__), _fail(__FILE__, __LINE__))
#define assert_true(c)             CMOCKA_MUST(c, #c)
#define assert_false(c)            CMOCKA_MUST(!(c), "not " #c)
#define assert_null(p)             CMOCKA_MUST((p) == NULL, #p " is not NULL")
#define assert_non_null(p)         CMOCKA_MUST((p) != NULL, #p " is NULL")
#define assert_ptr_equal(a, b)     CMOCKA_MUST((const void *)(a) == (const void *)(b), #a " is not " #b)
#define assert_int_equal(a, b)     cmocka_must_equal((intmax_t)(a), (intmax_t)(b), #a " is not " #b, __FILE__, __LINE__)
#define assert_int_not_equal(a, b) CMOCKA_MUST((intmax_t)(a) != (intmax_t)(b), #a " is " #b)
#define assert_in_range(x, least, most)                                                                                \
    CMOCKA_MUST((uintmax_t)(x) >= (uintmax_t)(least) && (uintmax_t)(x) <= (uintmax_t)(most), #x " out of range")
#define assert_string_equal(a, b)     CMOCKA_MUST(strcmp(a, b) == 0, #a " is not " #b)
#define assert_string_not_equal(a, b) CMOCKA_MUST(strcmp(a, b) != 0, #a " is " #b)
#define assert_memory_equal(a, b, n)  CMOCKA_MUST(memcmp(a, b, n) == 0, #a " is not " #b)

#define cmocka_unit_test(f)                                                                                            \
    {                                                                                                                  \
#f, f, NULL, NULL                                                                                              \
    }
#define cmocka_unit_test_setup(f, setup)                                                                               \
    {                                                                                                                  \
#f, f, setup, NULL                                                                                             \
    }
#define cmocka_unit_test_setup_teardown(f, setup, down)                                                                \
    {                                                                                                                  \
#f, f, setup, down                                                                                             \
    }
#define cmocka_run_group_tests(tests, setup, teardown)                                                                 \
    cmocka_run(tests, (int)(sizeof(tests) / sizeof *(tests)), setup, teardown)

#endif
