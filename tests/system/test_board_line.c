/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Bad lines: noise both ways with samples streaming, cables cut at any byte, ports that vanish, Ctrl-C. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <cmocka.h>
#include "board_rig.h"

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static long bytes_of_a_download(struct board_rig *rig)
{
    line_start(&rig->line, rig->board.port, &(struct line_faults){.seed = 1});
    board_run_expect(rig, rig->line.port, 0, (const char *[]){"download", "a.img", "--key", "key", NULL});
    const long bytes = line_stop(&rig->line);
    assert_true(bytes > 2 * 5060); /* written and read back */
    return bytes;
}

/* What the board runs is what it ran before, or the new model whole: nothing between. */
static void assert_old_or_new(struct board_rig *rig, const struct board_model *before, double next)
{
    const struct board_model now = board_ask(rig);
    if (now.counter != before->counter && now.counter != next)
        fail_msg("counter %g, was %g", now.counter, before->counter);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"upload", "-o", "now.img", NULL});
    run_beamfit(rig->dir,
                (const char *[]){"verify", "now.img", "--key", "key", "--device", "626f6172645f686f73745f31", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"info", "--json", NULL});
    assert_true(board_answer(rig, "missed") == 0.0);
}

/* Cut in the middle of everything, then the whole cable again: the next download works. */
static void a_cut_cable_leaves_a_whole_model(void **state)
{
    struct board_rig *rig = *state;
    enum { CUTS = 9 };
    const long bytes = bytes_of_a_download(rig);
    for (int i = 0; i < CUTS; i++) {
        const struct board_model before = board_ask(rig);
        const long cut = 40 + (bytes - 80) * i / CUTS + 37 * i % 50;
        line_start(&rig->line, rig->board.port, &(struct line_faults){.cut_after = cut, .unplug = i % 3 != 0});
        board_run(rig, rig->line.port, (const char *[]){"download", "b.img", "--key", "key", NULL});
        assert_int_equal(rig->outcome.status, 5);
        assert_int_equal(strncmp(rig->outcome.err, "beamfit: ", 9), 0);
        line_stop(&rig->line);
        assert_old_or_new(rig, &before, before.counter + 1.0);
    }
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"download", "b.img", "--key", "key", "--json", NULL});
    assert_true(board_answer(rig, "stored") == 1.0);
}

static void noise_slows_a_download_and_no_more(void **state)
{
    struct board_rig *rig = *state;
    static const double noise[] = {1e-3, 3e-3};
    for (unsigned i = 0; i < 2; i++) {
        line_start(&rig->line, rig->board.port, &(struct line_faults){.noise = noise[i], .seed = 100 + i});
        board_run_expect(rig, rig->line.port, 0,
                         (const char *[]){"download", i % 2 ? "b.img" : "a.img", "--key", "key", "--json", NULL});
        assert_true(board_answer(rig, "stored") == 1.0);
        line_stop(&rig->line);
        const struct board_model now = board_ask(rig);
        assert_true(now.counter == i + 1.0 && now.stored == i + 1.0);
    }
}

/* An unplugged adapter, and a cable that falls silent: an error, in seconds, and what had come is kept. */
static void the_end_of_the_line_is_noticed(void **state)
{
    struct board_rig *rig = *state;
    for (int unplug = 0; unplug < 2; unplug++) {
        line_start(&rig->line, rig->board.port, &(struct line_faults){.cut_after = 150000, .unplug = unplug});
        const double from_s = now_s();
        board_run_expect(rig, rig->line.port, 5,
                         (const char *[]){"record", "--key", "key", "-o", "cut.csv", "--seconds", "60", "--settle", "0",
                                          "--chirp", "5:50:1:1", "--force", NULL});
        assert_true(now_s() - from_s < 40.0); /* not after the 60 s that were asked for */
        if (strstr(rig->outcome.err, "cut.csv") == NULL)
            fail_msg("cut.csv is not in: %s", rig->outcome.err);
        assert_true(file_exists(rig->dir, "cut.csv"));
        run_beamfit(rig->dir,
                    (const char *[]){"simulate", "model.yaml", "--input", "cut.csv", "-o", "simulated.csv", NULL},
                    &rig->outcome);
        assert_int_equal(rig->outcome.status, 0); /* a record like any other */
        line_stop(&rig->line);
    }
    line_start(&rig->line, rig->board.port, &(struct line_faults){.cut_after = 20000});
    board_run_expect(rig, rig->line.port, 5, (const char *[]){"monitor", "--seconds", "60", NULL});
    line_stop(&rig->line);
}

static void nobody_there(void **state)
{
    struct board_rig *rig = *state;
    line_start(&rig->line, rig->board.port, &(struct line_faults){.cut_after = 1});
    board_run_expect(rig, rig->line.port, 5, (const char *[]){"info", NULL});
    assert_non_null(strstr(rig->outcome.err, "no answer from the board"));
    board_run_expect(rig, "/dev/ttyBeamfitNone", 5, (const char *[]){"info", NULL});
    assert_non_null(strstr(rig->outcome.err, "no such port"));
}

/* Ctrl-C so many seconds after the start. */
static int run_interrupted(struct board_rig *rig, double after_s, const char *const arguments[])
{
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        if (chdir(rig->dir) != 0 || freopen("interrupted.out", "w", stdout) == NULL ||
            freopen("interrupted.err", "w", stderr) == NULL)
            _exit(98);
        execv(getenv("BEAMFIT"), (char *const *)arguments);
        _exit(127);
    }
    nanosleep(&(struct timespec){(time_t)after_s, (long)(1e9 * (after_s - (double)(time_t)after_s))}, NULL);
    kill(child, SIGINT);
    int ended;
    assert_int_equal(waitpid(child, &ended, 0), child);
    return WIFEXITED(ended) ? WEXITSTATUS(ended) : 128 + WTERMSIG(ended);
}

static void ctrl_c_ends_cleanly(void **state)
{
    struct board_rig *rig = *state;
    const char *port = rig->board.port;
    int status = run_interrupted(rig, 2.5,
                                 (const char *[]){"beamfit", "record", "--key", "key", "--port", port, "-o", "part.csv",
                                                  "--seconds", "100", "--settle", "0", "--chirp", "5:50:1:1", NULL});
    assert_int_equal(status, 0);
    run_beamfit(rig->dir,
                (const char *[]){"simulate", "model.yaml", "--input", "part.csv", "-o", "simulated.csv", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    assert_int_equal(run_interrupted(rig, 1.5, (const char *[]){"beamfit", "monitor", "--port", port, NULL}), 0);
    line_start(&rig->line, port, &(struct line_faults){.baud = 9600}); /* six seconds for the blocks alone */
    status = run_interrupted(
        rig, 2.5, (const char *[]){"beamfit", "download", "a.img", "--key", "key", "--port", rig->line.port, NULL});
    assert_int_equal(status, 5);
    line_stop(&rig->line);
    assert_false(board_ask(rig).downloaded);
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, board_rig_setup, board_rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(a_cut_cable_leaves_a_whole_model),
        CASE(noise_slows_a_download_and_no_more),
        CASE(the_end_of_the_line_is_noticed),
        CASE(nobody_there),
        CASE(ctrl_c_ends_cleanly),
    };
    return cmocka_run_group_tests_name("board: lines", tests, NULL, NULL);
}
