/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The board on this machine as a program: its command line, its key, its flash, its power. */
#include <fcntl.h>
#include <libgen.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>
#include "board.h"

enum { MOST = 24, FLASH = 3 * 8192 };

static char dir[64];
static struct outcome outcome;

static int set_up(void **state)
{
    (void)state;
    make_directory(dir);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    remove_directory(dir);
    return 0;
}

/* board_host, beside the program that BEAMFIT names. */
static void run(const char *const arguments[])
{
    static char path[1024], copy[1024];
    const char *argv[MOST] = {path};
    const char *program = getenv("BEAMFIT");
    if (!program || snprintf(copy, sizeof copy, "%s", program) >= (int)sizeof copy)
        fail_msg("BEAMFIT names no program");
    snprintf(path, sizeof path, "%.1000s/board_host", dirname(copy));
    for (int i = 0; arguments[i]; i++)
        argv[i + 1] = arguments[i];
    run_program(dir, argv, &outcome);
}

#define RUN(...) run((const char *const[]){__VA_ARGS__, NULL})

static void test_command_line(void **state)
{
    (void)state;
    RUN("--help");
    assert_int_equal(outcome.status, 0);
    assert_non_null(strstr(outcome.out, "--power-cut"));
    assert_non_null(strstr(outcome.out, "it misses none"));
    RUN("--nonsense");
    assert_int_equal(outcome.status, 2);
    RUN("further");
    assert_int_equal(outcome.status, 2);
    RUN("--plant", "x", "--replay", "y");
    assert_int_equal(outcome.status, 2);
    static const char *const wrong[][2] = {{"--sample-Hz", "0"},
                                           {"--sample-Hz", "nan"},
                                           {"--ticks", "-"},
                                           {"--device", "12"},
                                           {"--device", "zz6f6172645f686f73745f31"},
                                           {"--plant", "nowhere"},
                                           {"--replay", "nowhere"},
                                           {"--key", "nowhere"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        RUN(wrong[i][0], wrong[i][1]);
        assert_int_equal(outcome.status, 1);
        assert_int_equal(strncmp(outcome.err, "board_host: ", 12), 0);
    }
}

static void test_key_file(void **state)
{
    char path[128];
    (void)state;
    write_text(dir, "key", "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f\n");
    snprintf(path, sizeof path, "%s/key", dir);
    chmod(path, 0640);
    RUN("--key", "key", "--virtual", "--ticks", "10");
    assert_int_equal(outcome.status, 1);
    assert_non_null(strstr(outcome.err, "chmod 600"));
    chmod(path, 0600);
    RUN("--key", "key", "--virtual", "--ticks", "10");
    assert_int_equal(outcome.status, 0);
    assert_non_null(strstr(outcome.out, "port: /dev/pts/"));
    assert_non_null(strstr(outcome.out, "\nREADY\n"));
    write_text(dir, "key", "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1g\n");
    RUN("--key", "key", "--virtual", "--ticks", "10");
    assert_int_equal(outcome.status, 1);
}

static void test_replay_ends(void **state)
{
    (void)state;
    write_text(dir, "codes", "2048\n2050\n4095\n0\n");
    RUN("--replay", "codes", "--virtual");
    assert_int_equal(outcome.status, 0);
    write_text(dir, "codes", "2048\n4096\n");
    RUN("--replay", "codes", "--virtual");
    assert_int_equal(outcome.status, 0); /* ends before what is no code */
}

static void read_flash(uint8_t bytes[FLASH])
{
    char path[128];
    snprintf(path, sizeof path, "%s/flash", dir);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fread(bytes, 1, FLASH, file), FLASH);
    fclose(file);
}

/* Power-ons are cleared bits of slot 2, which outlive the program; a cut power-on dies in the middle of its word. */
static void test_flash_outlives_it(void **state)
{
    static uint8_t flash[FLASH];
    uint32_t word;
    (void)state;
    for (uint32_t boots = 1; boots <= 3; boots++) {
        RUN("--nvm", "flash", "--virtual", "--ticks", "5");
        assert_int_equal(outcome.status, 0);
        read_flash(flash);
        memcpy(&word, flash + 2 * 8192 + 4, sizeof word);
        assert_int_equal(word, UINT32_MAX << boots);
    }
    RUN("--nvm", "flash", "--virtual", "--ticks", "5", "--power-cut", "1");
    assert_int_equal(outcome.status, 42);
    RUN("--nvm", "flash", "--virtual", "--ticks", "5");
    assert_int_equal(outcome.status, 0);
    read_flash(flash);
    memcpy(&word, flash + 2 * 8192 + 4, sizeof word);
    assert_true(word == UINT32_MAX << 4 || word == UINT32_MAX << 5);
    write_text(dir, "flash", "short");
    RUN("--nvm", "flash");
    assert_int_equal(outcome.status, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_command_line, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_key_file, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_replay_ends, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_flash_outlives_it, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
