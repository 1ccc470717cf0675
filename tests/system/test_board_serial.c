/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The same commands through libserialport: tests/shim makes a pseudo terminal pass for a serial port. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>
#include "board_rig.h"

/* From here on every program started is under the shim. */
static int load_shim(void **state)
{
    (void)state;
    char program[1024], shim[1100], options[512];
    const char *asan = getenv("ASAN_OPTIONS");
    snprintf(program, sizeof program, "%s", getenv("BEAMFIT"));
    snprintf(shim, sizeof shim, "%s/shim/pty_serial.so", dirname(program));
    snprintf(options, sizeof options, "%s%sverify_asan_link_order=0", asan ? asan : "", asan ? ":" : "");
    return access(shim, R_OK) != 0 || setenv("ASAN_OPTIONS", options, 1) != 0 || setenv("LD_PRELOAD", shim, 1) != 0;
}

static void serial_name(const char *port, char name[64])
{
    assert_int_equal(strncmp(port, "/dev/pts/", 9), 0);
    snprintf(name, 64, "/dev/ttyPTY%.40s", port + 9);
}

static void every_command_works(void **state)
{
    struct board_rig *rig = *state;
    char port[64];
    serial_name(rig->board.port, port);
    board_run_expect(rig, port, 0, (const char *[]){"info", "--json", NULL});
    assert_true(board_answer_is(rig, "port", port));
    board_run_expect(rig, port, 0,
                     (const char *[]){"download", "a.img", "--key", "key", "--baud", "921600", "--json", NULL});
    assert_true(board_answer(rig, "stored") == 1.0);
    board_run_expect(rig, port, 0, (const char *[]){"upload", "-o", "back.img", "--baud", "921600", NULL});
    board_run_expect(rig, port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "run.csv", "--samples", "1000", "--settle", "0",
                                      "--chirp", "5:50:1:1", "--baud", "921600", "--json", NULL});
    assert_true(board_answer(rig, "prescale") == 1.0);
    assert_true(board_answer(rig, "samples") == 1000.0 && board_answer(rig, "gaps") == 0.0);
    run_beamfit(rig->dir, (const char *[]){"replay", "run.csv", "--image", "back.img", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    board_run_expect(rig, port, 0, (const char *[]){"monitor", "--seconds", "0.3", "--baud", "115200", NULL});
}

/* A real port has a rate: at the default, every fifth sample. */
static void the_rate_counts(void **state)
{
    struct board_rig *rig = *state;
    char port[64];
    serial_name(rig->board.port, port);
    board_run_expect(rig, port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "run.csv", "--samples", "100", "--settle", "0",
                                      "--json", NULL});
    assert_true(board_answer(rig, "prescale") == 6.0);
}

static void noise_and_cuts(void **state)
{
    struct board_rig *rig = *state;
    char port[64];
    line_start(&rig->line, rig->board.port, &(struct line_faults){.noise = 1e-3, .seed = 3});
    serial_name(rig->line.port, port);
    board_run_expect(rig, port, 0,
                     (const char *[]){"download", "a.img", "--key", "key", "--baud", "921600", "--json", NULL});
    assert_true(board_answer(rig, "stored") == 1.0);
    line_stop(&rig->line);
    line_start(&rig->line, rig->board.port, &(struct line_faults){.cut_after = 150000, .unplug = 1});
    serial_name(rig->line.port, port);
    board_run_expect(rig, port, 5,
                     (const char *[]){"record", "--key", "key", "-o", "cut.csv", "--seconds", "60", "--settle", "0",
                                      "--chirp", "5:50:1:1", "--baud", "921600", NULL});
    assert_non_null(strstr(rig->outcome.err, "the port is gone"));
    assert_true(file_exists(rig->dir, "cut.csv"));
}

static void no_such_port(void **state)
{
    struct board_rig *rig = *state;
    board_run_expect(rig, "/dev/ttyPTY987654", 5, (const char *[]){"info", NULL});
    assert_non_null(strstr(rig->outcome.err, "no such port"));
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, board_rig_setup, board_rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(every_command_works),
        CASE(the_rate_counts),
        CASE(noise_and_cuts),
        CASE(no_such_port),
    };
    return cmocka_run_group_tests_name("board: libserialport", tests, load_shim, NULL);
}
