/* SPDX-License-Identifier: GPL-3.0-or-later */
/* info, download, upload against the firmware on this machine. */
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
#include "board_rig.h"

enum { IMAGE_BYTES = 5060 };

static void read_image(const struct board_rig *rig, const char *name, unsigned char bytes[IMAGE_BYTES])
{
    char path[1024];
    snprintf(path, sizeof path, "%s/%s", rig->dir, name);
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    assert_int_equal(fread(bytes, 1, IMAGE_BYTES, f), IMAGE_BYTES);
    assert_int_equal(fgetc(f), EOF);
    fclose(f);
}

static void download(struct board_rig *rig, const char *image)
{
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"download", image, "--key", "key", "--json", NULL});
}

static void a_new_board_runs_the_built_in_model(void **state)
{
    struct board_rig *rig = *state;
    const struct board_model m = board_ask(rig);
    assert_false(m.downloaded);
    assert_true(m.counter == 0.0 && m.stored == 0.0);
    assert_true(board_answer(rig, "sample_Hz") == 1000.0);
    assert_true(board_answer(rig, "boots") == 1.0);
    assert_true(board_answer_is(rig, "device", "626f6172645f686f73745f31")); /* "board_host_1" */
    assert_true(board_answer_is(rig, "last_fault", ""));
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"info", NULL});
    assert_non_null(strstr(rig->outcome.out, "built in"));
    assert_string_equal(rig->outcome.err, "");
}

/* The bytes that come back are those of the file but for device, counter and code. */
static void a_download_runs_and_is_kept_over_power_off(void **state)
{
    struct board_rig *rig = *state;
    static unsigned char sent[IMAGE_BYTES], got[IMAGE_BYTES];
    download(rig, "a.img");
    assert_true(board_answer(rig, "counter") == 1.0 && board_answer(rig, "stored") == 1.0);
    assert_true(board_answer(rig, "signed_here") == 1.0);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"upload", "-o", "back.img", NULL});
    read_image(rig, "a.img", sent);
    read_image(rig, "back.img", got);
    assert_memory_equal(sent, got, 12);                              /* magic, layout, length */
    assert_memory_equal(sent + 28, got + 28, IMAGE_BYTES - 28 - 32); /* behind counter and device, before the code */
    assert_memory_equal(got + 16, "board_host_1", 12);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"info", "--json", NULL});
    const struct board_model before = board_ask(rig);
    board_kill(&rig->board);
    board_start(&rig->board, rig->dir, (const char *[]){"--key", "key", "--nvm", "nvm", NULL});
    const struct board_model after = board_ask(rig);
    assert_true(after.downloaded && after.counter == 1.0);
    assert_string_equal(after.sha256, before.sha256);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"upload", "-o", "kept.img", NULL});
    read_image(rig, "kept.img", sent);
    assert_memory_equal(sent, got, IMAGE_BYTES);
}

static void no_store_lasts_until_power_off(void **state)
{
    struct board_rig *rig = *state;
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"download", "a.img", "--key", "key", "--no-store", "--json", NULL});
    assert_true(board_answer(rig, "stored") == 0.0);
    assert_true(board_ask(rig).downloaded);
    board_kill(&rig->board);
    board_start(&rig->board, rig->dir, (const char *[]){"--key", "key", "--nvm", "nvm", NULL});
    assert_false(board_ask(rig).downloaded);
}

/* A signed image that already runs is only stored; an older one is refused; --sign brings it back. */
static void repeating_and_going_back(void **state)
{
    struct board_rig *rig = *state;
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"download", "a.img", "--key", "key", "--no-store", NULL});
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"upload", "-o", "old.img", NULL});
    download(rig, "old.img");
    assert_true(board_answer(rig, "was_running") == 1.0 && board_answer(rig, "stored") == 1.0);
    assert_true(board_answer(rig, "counter") == 1.0);
    download(rig, "b.img");
    assert_true(board_answer(rig, "counter") == 2.0);
    board_run_expect(rig, rig->board.port, 5, (const char *[]){"download", "old.img", "--key", "key", NULL});
    assert_non_null(strstr(rig->outcome.err, "counter 1"));
    assert_true(board_ask(rig).counter == 2.0);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"download", "old.img", "--sign", "--key", "key", NULL});
    assert_true(board_ask(rig).counter == 3.0);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"info", "--json", NULL});
    assert_true(board_answer(rig, "noise_rms") < 0.003); /* a.img's */
}

/* Wrong keys: refused, counted, slower each time, and the right one works afterwards. */
static void a_wrong_key_changes_nothing(void **state)
{
    struct board_rig *rig = *state;
    for (int i = 0; i < 2; i++) {
        board_run_expect(rig, rig->board.port, 5, (const char *[]){"download", "a.img", "--key", "wrong_key", NULL});
        assert_non_null(strstr(rig->outcome.err, "does not accept the key of wrong_key"));
    }
    assert_false(board_ask(rig).downloaded);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"info", "--json", NULL});
    assert_true(board_answer(rig, "wrong_keys") == 2.0);
    download(rig, "a.img");
    assert_true(board_ask(rig).downloaded);
}

static void assert_bad_file(struct board_rig *rig, const char *const arguments[], const char *word)
{
    board_run_expect(rig, rig->board.port, 3, arguments);
    if (strstr(rig->outcome.err, word) == NULL)
        fail_msg("'%s' is not in: %s", word, rig->outcome.err);
}

static void bad_files_are_refused_before_anything_is_sent(void **state)
{
    struct board_rig *rig = *state;
    static unsigned char bytes[IMAGE_BYTES];
    char path[1024];
    read_image(rig, "a.img", bytes);
    bytes[2000] ^= 1;
    write_file(rig->dir, "bad.img", bytes, sizeof bytes);
    write_file(rig->dir, "short.img", bytes, 1000);
    assert_bad_file(rig, (const char *[]){"download", "bad.img", "--key", "key", NULL}, "bad.img");
    assert_bad_file(rig, (const char *[]){"download", "short.img", "--key", "key", NULL}, "short.img");
    assert_bad_file(rig, (const char *[]){"download", "none.img", "--key", "key", NULL}, "none.img");
    assert_bad_file(rig, (const char *[]){"download", "a.img", "--key", "no_key", NULL}, "no_key");
    snprintf(path, sizeof path, "%s/key", rig->dir);
    assert_int_equal(chmod(path, 0644), 0);
    assert_bad_file(rig, (const char *[]){"download", "a.img", "--key", "key", NULL}, "chmod 600");
    assert_bad_file(rig, (const char *[]){"upload", "-o", "no/such/dir/up.img", NULL}, "no/such/dir");
    assert_false(board_ask(rig).downloaded);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"info", "--json", NULL});
    assert_true(board_answer(rig, "refused") == 0.0);
}

static void mistakes_on_the_command_line(void **state)
{
    struct board_rig *rig = *state;
    static const char *const calls[][8] = {
        {"info", "extra", NULL},
        {"info", "--baud", "fast", NULL},
        {"download", "--key", "key", NULL},
        {"download", "a.img", NULL},
        {"upload", NULL},
        {"record", NULL},
        {"record", "-o", "x.csv", "--chirp", "5:100:2:1", NULL},
        {"monitor", "--chirp", "5:100:2:1", NULL},
        {"info", "--acknowledge", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--seconds", "-1", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--chirp", "1:2:3", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--chirp", "1:2:3:4:5", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--chirp", "5:100:2:1000", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--chirp", "5:600:2:1", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--drive", "up", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--prescale", "0", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--once", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--settle", "1e9", NULL},
        {"record", "--key", "key", "-o", "x.csv", "--seconds", "1e9", NULL},
        {"monitor", "--seconds", "x", NULL},
    };
    for (size_t i = 0; i < sizeof calls / sizeof *calls; i++) {
        board_run_expect(rig, rig->board.port, 2, calls[i]);
        assert_string_equal(rig->outcome.out, "");
        assert_int_equal(strncmp(rig->outcome.err, "beamfit: ", 9), 0);
    }
    run_beamfit(rig->dir, (const char *[]){"info", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 2);
    assert_non_null(strstr(rig->outcome.err, "--port"));
    assert_false(file_exists(rig->dir, "x.csv"));
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, board_rig_setup, board_rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(a_new_board_runs_the_built_in_model), CASE(a_download_runs_and_is_kept_over_power_off),
        CASE(no_store_lasts_until_power_off),      CASE(repeating_and_going_back),
        CASE(a_wrong_key_changes_nothing),         CASE(bad_files_are_refused_before_anything_is_sent),
        CASE(mistakes_on_the_command_line),
    };
    return cmocka_run_group_tests_name("board: models", tests, NULL, NULL);
}
