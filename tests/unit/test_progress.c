/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "ground/ground.h"

/* What a child that draws a bar sends to its standard error, which is `fd`; the rest is read from `from`. */
static void drawn(int fd, int from, double fraction, char *text, size_t size)
{
    size_t n = 0;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        if (dup2(fd, STDERR_FILENO) < 0)
            _exit(1);
        struct progress *progress = progress_begin("fit");
        progress_update(progress, fraction, "stage 3 of 6");
        for (int i = 0; i < 1000; i++)
            progress_update(progress, fraction, "too often");
        progress_end(progress);
        _exit(0);
    }
    (void)close(fd);
    for (ssize_t got; n + 1 < size && (got = read(from, text + n, size - 1 - n)) > 0;)
        n += (size_t)got;
    text[n] = '\0';
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
}

static void on_terminal(double fraction, char *text, size_t size)
{
    int terminal = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0);
    int end = open(ptsname(terminal), O_RDWR | O_NOCTTY);
    assert_true(end >= 0);
    drawn(end, terminal, fraction, text, size);
    (void)close(terminal);
}

static void a_bar_on_a_terminal(void **state)
{
    (void)state;
    char text[4096];
    on_terminal(0.5, text, sizeof text);
    assert_non_null(strstr(text, "fit [############............]  50 %; stage 3 of 6"));
    assert_null(strstr(text, "too often")); /* ten times a second at most */
    size_t n = strlen(text);
    assert_true(n > 4 && strcmp(text + n - 4, "\r\033[K") == 0); /* the line is cleared */
}

static void fractions_outside_are_bounded(void **state)
{
    (void)state;
    char text[4096];
    on_terminal(7.0, text, sizeof text);
    assert_non_null(strstr(text, "100 %"));
    on_terminal(-1.0, text, sizeof text);
    assert_non_null(strstr(text, "  0 %"));
}

static void nothing_when_piped(void **state)
{
    (void)state;
    int ends[2];
    char text[64];
    assert_int_equal(pipe(ends), 0);
    drawn(ends[1], ends[0], 0.5, text, sizeof text);
    (void)close(ends[0]);
    assert_string_equal(text, "");
}

static void ctrl_c_is_a_flag_once(void **state)
{
    (void)state;
    assert_false(progress_interrupted());
    progress_catch_interrupts();
    assert_false(progress_interrupted());
    (void)raise(SIGINT);
    assert_true(progress_interrupted());
    progress_catch_interrupts();
    assert_false(progress_interrupted());
    (void)signal(SIGINT, SIG_DFL);
}

static void the_second_ctrl_c_ends_the_program(void **state)
{
    (void)state;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        progress_catch_interrupts();
        (void)raise(SIGINT);
        (void)raise(SIGINT);
        _exit(0);
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bar_on_a_terminal),
        cmocka_unit_test(fractions_outside_are_bounded),
        cmocka_unit_test(nothing_when_piped),
        cmocka_unit_test(ctrl_c_is_a_flag_once),
        cmocka_unit_test(the_second_ctrl_c_ends_the_program),
    };
    return cmocka_run_group_tests_name("progress", tests, NULL, NULL);
}
