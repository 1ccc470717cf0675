/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The pseudo terminal's back end, and the messages of both. test_board_serial.c runs libserialport's. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "board/board.h"
#include "board/port.h"
#include "test_files.h"

struct pair {
    int board; /* the other end */
    struct port *port;
};

static int open_pair(void **state)
{
    struct pair *pair = calloc(1, sizeof *pair);
    struct bf_error err;
    *state = pair;
    pair->board = posix_openpt(O_RDWR | O_NOCTTY);
    return pair->board < 0 || grantpt(pair->board) != 0 || unlockpt(pair->board) != 0 ||
           port_open(ptsname(pair->board), PORT_BAUD, &pair->port, &err) != BF_OK;
}

static int close_pair(void **state)
{
    struct pair *pair = *state;
    port_close(pair->port);
    if (pair->board >= 0)
        close(pair->board);
    free(pair);
    return 0;
}

/* Every byte value: no line discipline changes, echoes or swallows one. */
static void all_bytes_pass_both_ways(void **state)
{
    struct pair *pair = *state;
    struct bf_error err;
    uint8_t sent[256], got[256];
    size_t n = 0, part;
    for (int i = 0; i < 256; i++)
        sent[i] = (uint8_t)i;
    assert_true(port_is_pty(pair->port));
    assert_int_equal(port_write(pair->port, sizeof sent, sent, 1000, &err), BF_OK);
    while (n < sizeof got) {
        const ssize_t some = read(pair->board, got + n, sizeof got - n);
        assert_true(some > 0);
        n += (size_t)some;
    }
    assert_memory_equal(got, sent, sizeof sent);
    memset(got, 0, sizeof got);
    assert_int_equal(write(pair->board, sent, sizeof sent), sizeof sent);
    for (n = 0; n < sizeof got; n += part)
        assert_int_equal(port_read(pair->port, sizeof got - n, got + n, &part, 1000, &err), BF_OK);
    assert_memory_equal(got, sent, sizeof sent);
}

static void silence_is_no_error(void **state)
{
    struct pair *pair = *state;
    struct bf_error err;
    uint8_t byte;
    size_t got = 7;
    assert_int_equal(port_read(pair->port, 1, &byte, &got, 20, &err), BF_OK);
    assert_int_equal(got, 0);
    assert_int_equal(port_read(pair->port, 1, &byte, &got, 0, &err), BF_OK);
    assert_int_equal(got, 0);
}

/* Far more than the kernel buffers, against a reader that takes little bites. */
static void a_slow_reader_gets_everything(void **state)
{
    struct pair *pair = *state;
    enum { SIZE = 100000 };
    struct bf_error err;
    uint8_t *sent = malloc(SIZE);
    for (size_t i = 0; i < SIZE; i++)
        sent[i] = (uint8_t)(i * 7 + i / 251);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        uint8_t bite[37];
        size_t n = 0;
        int wrong = 0;
        while (n < SIZE) {
            const ssize_t some = read(pair->board, bite, sizeof bite);
            if (some <= 0)
                _exit(2);
            wrong |= memcmp(bite, sent + n, (size_t)some) != 0;
            n += (size_t)some;
        }
        _exit(wrong);
    }
    assert_int_equal(port_write(pair->port, SIZE, sent, 60000, &err), BF_OK);
    int ended;
    assert_int_equal(waitpid(child, &ended, 0), child);
    assert_int_equal(ended, 0);
    free(sent);
}

static void a_reader_that_stopped_is_said(void **state)
{
    struct pair *pair = *state;
    enum { SIZE = 1 << 20 };
    struct bf_error err = {BF_OK, ""};
    uint8_t *sent = calloc(1, SIZE);
    assert_int_equal(port_write(pair->port, SIZE, sent, 50, &err), BF_DEVICE);
    assert_non_null(strstr(err.text, "takes no bytes"));
    free(sent);
}

static void an_unplugged_port_fails_reads_and_writes(void **state)
{
    struct pair *pair = *state;
    struct bf_error err = {BF_OK, ""};
    uint8_t byte = 1;
    size_t got;
    close(pair->board);
    pair->board = -1;
    const int64_t from_ms = port_clock_ms();
    assert_int_equal(port_read(pair->port, 1, &byte, &got, 60000, &err), BF_DEVICE);
    assert_non_null(strstr(err.text, "the port is gone"));
    assert_int_equal(port_read(pair->port, 1, &byte, &got, 0, &err), BF_DEVICE);
    assert_int_equal(port_write(pair->port, 1, &byte, 60000, &err), BF_DEVICE);
    assert_non_null(strstr(err.text, "the port is gone"));
    assert_true(port_clock_ms() - from_ms < 50000); /* it did not wait the time out */
}

static void flushing_forgets_what_has_come(void **state)
{
    struct pair *pair = *state;
    struct bf_error err;
    uint8_t bytes[8];
    size_t got;
    assert_int_equal(write(pair->board, "old", 3), 3);
    assert_int_equal(port_flush(pair->port, &err), BF_OK);
    assert_int_equal(write(pair->board, "new", 3), 3);
    assert_int_equal(port_read(pair->port, sizeof bytes, bytes, &got, 1000, &err), BF_OK);
    assert_true(got >= 1 && bytes[0] == 'n');
}

static void two_programs_cannot_share_it(void **state)
{
    struct pair *pair = *state;
    struct port *second;
    struct bf_error err = {BF_OK, ""};
    assert_int_equal(port_open(port_path(pair->port), PORT_BAUD, &second, &err), BF_DEVICE);
    assert_null(second);
    assert_non_null(strstr(err.text, "another program uses the port"));
}

static void a_link_to_a_pseudo_terminal_will_do(void **state)
{
    struct pair *pair = *state;
    struct bf_error err;
    char *path = temporary_file("port", "", 0), name[64];
    strcpy(name, port_path(pair->port));
    port_close(pair->port);
    assert_int_equal(unlink(path), 0);
    assert_int_equal(symlink(name, path), 0);
    assert_int_equal(port_open(path, 921600, &pair->port, &err), BF_OK);
    assert_true(port_is_pty(pair->port));
    assert_int_equal(port_baud(pair->port), 921600);
    assert_string_equal(port_path(pair->port), path);
    unlink(path);
    free(path);
}

static void assert_not_opened(const char *path, const char *word)
{
    struct port *port;
    struct bf_error err = {BF_OK, ""};
    assert_int_equal(port_open(path, PORT_BAUD, &port, &err), BF_DEVICE);
    assert_null(port);
    assert_int_equal(strncmp(err.text, path, strlen(path)), 0);
    if (strstr(err.text, word) == NULL)
        fail_msg("'%s' is not in '%s'", word, err.text);
}

static void what_is_no_port_is_said(void **state)
{
    (void)state;
    char *file = temporary_file("port", "x", 1);
    assert_not_opened("/dev/ttyBeamfitNone", "there is no such port");
    assert_not_opened("/dev/pts/987654", "there is no such port");
    assert_not_opened("/dev/null", "is not a serial port");
    assert_not_opened("/tmp", "is not a serial port");
    assert_not_opened(file, "is not a serial port");
    unlink(file);
    free(file);
}

#define WITH_PAIR(f) cmocka_unit_test_setup_teardown(f, open_pair, close_pair)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH_PAIR(all_bytes_pass_both_ways),
        WITH_PAIR(silence_is_no_error),
        WITH_PAIR(a_slow_reader_gets_everything),
        WITH_PAIR(a_reader_that_stopped_is_said),
        WITH_PAIR(an_unplugged_port_fails_reads_and_writes),
        WITH_PAIR(flushing_forgets_what_has_come),
        WITH_PAIR(two_programs_cannot_share_it),
        WITH_PAIR(a_link_to_a_pseudo_terminal_will_do),
        cmocka_unit_test(what_is_no_port_is_said),
    };
    return cmocka_run_group_tests_name("port", tests, NULL, NULL);
}
