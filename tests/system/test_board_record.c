/* SPDX-License-Identifier: GPL-3.0-or-later */
/* record and monitor against the firmware on this machine, over good and bad lines. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "board_rig.h"

enum { MOST_ROWS = 20000 };

struct table {
    size_t n;
    double time_s[MOST_ROWS], input[MOST_ROWS], output[MOST_ROWS], predicted[MOST_ROWS], sequence[MOST_ROWS],
        step[MOST_ROWS], codes[MOST_ROWS];
    char header[1024];
    int gap_lines;
};

/* Reads the CSV without the program's own code. */
static void read_table(const struct board_rig *rig, const char *name, struct table *t)
{
    char path[1024], line[1024];
    snprintf(path, sizeof path, "%s/%s", rig->dir, name);
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    t->n = 0;
    t->gap_lines = 0;
    t->header[0] = 0;
    while (fgets(line, sizeof line, f) != NULL) {
        double x[12] = {0.0};
        char *at = line, *end = NULL;
        int columns = 0;
        t->gap_lines += strncmp(line, "# gap:", 6) == 0;
        if (line[0] == '#')
            continue;
        if (t->header[0] == 0) {
            snprintf(t->header, sizeof t->header, "%s", line);
            continue;
        }
        for (; columns < 12; columns++, at = end + 1) {
            x[columns] = strtod(at, &end);
            if (*end != ',')
                break;
        }
        assert_true(end != at && *end == '\n' && columns >= 2);
        assert_true(t->n < MOST_ROWS);
        t->time_s[t->n] = x[0];
        t->input[t->n] = x[1];
        t->output[t->n] = x[2];
        t->predicted[t->n] = x[3];
        t->sequence[t->n] = x[6];
        t->step[t->n] = x[7];
        t->codes[t->n++] = x[8];
    }
    fclose(f);
}

static void assert_whole(const struct table *t, unsigned prescale, double sample_Hz)
{
    for (size_t i = 0; i < t->n; i++) {
        assert_true(t->sequence[i] == t->sequence[0] + (double)i * prescale);
        assert_true(t->step[i] == t->step[0] + (double)i * prescale);
        assert_true(fabs(t->time_s[i] - t->time_s[0] - (double)i * prescale / sample_Hz) <= 1e-9);
    }
}

/* From the model's rest on, with the drive that was asked for, and the controller's arithmetic bit for bit. */
static void a_record_begins_at_rest_and_replays(void **state)
{
    struct board_rig *rig = *state;
    static struct table t;
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"download", "a.img", "--key", "key", NULL});
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "run.csv", "--model", "model.yaml", "--samples",
                                      "1500", "--settle", "0.2", "--chirp", "10:100:0.5:2.5", "--json", NULL});
    assert_true(board_answer(rig, "samples") == 1500.0);
    assert_true(board_answer(rig, "gaps") == 0.0 && board_answer(rig, "first_step") == 0.0);
    assert_true(board_answer(rig, "overrun") == 0.0 && board_answer(rig, "missed") == 0.0);
    read_table(rig, "run.csv", &t);
    assert_string_equal(
        t.header,
        "time_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,status,innovation,innovation_ratio\n");
    assert_int_equal(t.n, 1500);
    assert_true(t.time_s[0] == 0.0 && t.step[0] == 0.0);
    assert_whole(&t, 1, 1000.0);
    double most = 0.0;
    for (size_t i = 0; i < t.n; i++) {
        const double code = (double)((uint32_t)t.codes[i] >> 16);
        assert_true(fabs(t.input[i] - (code - 2048.0) * 0.01) <= 1e-6);
        most = t.input[i] > most ? t.input[i] : most;
        if (i >= 500)
            assert_true(t.input[i] == t.input[i - 500]); /* again every 0.5 s */
    }
    assert_true(fabs(most - 2.5) <= 0.02);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"upload", "-o", "ran.img", NULL});
    run_beamfit(rig->dir, (const char *[]){"replay", "run.csv", "--image", "ran.img", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    assert_non_null(strstr(rig->outcome.out, "1500 of 1500"));
}

/*
 * What the host's model makes of the recorded drive is what the controller predicted: one time axis, one hold. They part
 * by 1.5e-3 in what a held input does above the ten dimensions; half a sample's shift would be 0.2.
 */
static void the_host_predicts_the_same_from_a_record(void **state)
{
    struct board_rig *rig = *state;
    static struct table run, simulated;
    double error = 0.0, size = 0.0;
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"download", "a.img", "--key", "key", NULL});
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "run.csv", "--samples", "1000", "--settle", "0",
                                      "--chirp", "5:120:1:2", "--model", "model.yaml", NULL});
    run_beamfit(rig->dir,
                (const char *[]){"simulate", "model.yaml", "--input", "run.csv", "--intersample", "zoh", "-o",
                                 "simulated.csv", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    read_table(rig, "run.csv", &run);
    read_table(rig, "simulated.csv", &simulated);
    assert_int_equal(simulated.n, 1000);
    for (size_t i = 0; i < run.n; i++) {
        error += (run.predicted[i] - simulated.output[i]) * (run.predicted[i] - simulated.output[i]);
        size += run.predicted[i] * run.predicted[i];
    }
    assert_true(size > 0.0);
    if (!(error < 1e-5 * size))
        fail_msg("error %g of size %g", error, size);
}

/* A pause in the drive, and one sweep only. */
static void drives_are_what_was_asked_for(void **state)
{
    struct board_rig *rig = *state;
    static struct table t;
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "pause.csv", "--samples", "600", "--settle", "0",
                                      "--chirp", "20:40:0.1:1", "--every", "0.3", NULL});
    read_table(rig, "pause.csv", &t);
    assert_int_equal(t.n, 600);
    for (size_t i = 100; i < 300; i++)
        assert_true(t.input[i] == 0.0);
    assert_true(t.input[3] != 0.0);
    for (size_t i = 300; i < 600; i++)
        assert_true(t.input[i] == t.input[i - 300]);
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "once.csv", "--samples", "600", "--settle", "0",
                                      "--chirp", "20:40:0.1:1", "--once", NULL});
    read_table(rig, "once.csv", &t);
    assert_true(t.input[3] != 0.0);
    for (size_t i = 100; i < 600; i++)
        assert_true(t.input[i] == 0.0);
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "off.csv", "--samples", "100", "--settle", "0",
                                      "--drive", "off", NULL});
    read_table(rig, "off.csv", &t);
    for (size_t i = 0; i < t.n; i++)
        assert_true(t.input[i] == 0.0);
}

/* A slow line: every so many samples, said; asking for more than it carries is refused with the numbers. */
static void a_slow_line_is_prescaled_and_said(void **state)
{
    struct board_rig *rig = *state;
    static struct table t;
    line_start(&rig->line, rig->board.port, &(struct line_faults){.baud = 115200, .seed = 1});
    board_run_expect(rig, rig->line.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "slow.csv", "--seconds", "2", "--settle", "0.1",
                                      "--chirp", "5:50:1:1", "--baud", "115200", "--json", NULL});
    assert_true(board_answer(rig, "prescale") == 6.0);
    assert_true(board_answer(rig, "samples") == 333.0);
    assert_true(board_answer(rig, "gaps") == 0.0 && board_answer(rig, "overrun") == 0.0);
    assert_non_null(strstr(rig->outcome.err, "folded"));
    read_table(rig, "slow.csv", &t);
    assert_whole(&t, 6, 1000.0);
    assert_true(t.step[0] < 6.0);
    board_run_expect(
        rig, rig->line.port, 2,
        (const char *[]){"record", "--key", "key", "-o", "x.csv", "--baud", "115200", "--prescale", "1", NULL});
    assert_non_null(strstr(rig->outcome.err, "--prescale 6"));
}

/* Bytes are damaged both ways: what is in the file is whole, and what is missing is named. */
static void gaps_are_reported_and_never_filled(void **state)
{
    struct board_rig *rig = *state;
    static struct table t;
    line_start(&rig->line, rig->board.port, &(struct line_faults){.noise = 1e-3, .seed = 7});
    board_run_expect(rig, rig->line.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "noisy.csv", "--samples", "3000", "--settle",
                                      "0.1", "--chirp", "5:50:1:1", "--json", NULL});
    const double gaps = board_answer(rig, "gaps"), lost = board_answer(rig, "lost");
    assert_true(gaps >= 20.0 && lost >= gaps); /* about one frame in twenty */
    assert_non_null(strstr(rig->outcome.err, "gaps"));
    read_table(rig, "noisy.csv", &t);
    assert_true(t.n >= 2);
    assert_true((double)t.n == board_answer(rig, "samples"));
    assert_whole(&t, 1, 1000.0);
    assert_true((double)t.gap_lines == (gaps > 100.0 ? 101.0 : gaps));
}

static void monitor_prints_lines_and_objects(void **state)
{
    struct board_rig *rig = *state;
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"monitor", "--seconds", "0.5", "--every", "0.1", "--json", NULL});
    int lines = 0;
    for (char *line = strtok(rig->outcome.out, "\n"); line != NULL; line = strtok(NULL, "\n"), lines++)
        if (line[0] != '{' || strstr(line, "\"ratio\":") == NULL || line[strlen(line) - 1] != '}')
            fail_msg("no object: %s", line);
    assert_int_equal(lines, 5);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"monitor", "--seconds", "0.3", "--every", "0.1", NULL});
    assert_non_null(strstr(rig->outcome.out, "ratio to noise"));
    assert_null(strchr(rig->outcome.out, 033)); /* no terminal's codes in a pipe */
}

/* The board without a plant reads mid scale, as with a wire that is off: the ratio alone would be 0, a perfect model. */
static void a_wire_that_is_off_is_said(void **state)
{
    struct board_rig *rig = *state;
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "off.csv", "--samples", "500", "--settle", "0.3",
                                      "--json", NULL});
    assert_true(board_answer_is(rig, "sensor", "stuck"));
    assert_true(board_answer(rig, "sensor_faults") > 400.0);
    assert_true(board_answer(rig, "alarms") < 1.0);
    assert_non_null(strstr(rig->outcome.err, "out of order (stuck)"));
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"monitor", "--seconds", "0.2", "--every", "0.1", NULL});
    assert_non_null(strstr(rig->outcome.out, "SENSOR stuck"));
}

/* Longer than the board's dead-man time: the program renews it; and with the program the drive ends. */
static void the_drive_lasts_as_long_as_the_record(void **state)
{
    static struct table t;
    struct board_rig *rig = *state;
    double last = 0.0;
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "long.csv", "--seconds", "4.5", "--settle", "0",
                                      "--chirp", "10:100:0.5:2.5", NULL});
    read_table(rig, "long.csv", &t);
    assert_true(t.n > 1000);
    for (size_t i = t.n - 200; i < t.n; i++)
        last = fmax(last, fabs(t.input[i]));
    assert_true(last > 2.0);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"info", "--json", NULL});
    assert_true(board_answer(rig, "drive_stops") > 0.5);
    assert_non_null(strstr(rig->outcome.out, "\"sensor stuck\"")); /* latched: no plant, no noise */
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"info", NULL});
    assert_non_null(strstr(rig->outcome.out, "Drive     off"));
    assert_non_null(strstr(rig->outcome.out, "Latched   sensor stuck"));
    board_run_expect(rig, rig->board.port, 5, (const char *[]){"info", "--acknowledge", "--key", "wrong_key", NULL});
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"info", "--acknowledge", "--key", "key", "--json", NULL});
    assert_true(board_answer(rig, "sensor_faults") < 1.5); /* it is stuck still, and so it came again */
}

/* Followed only when the image asks for it; at first as the model has them, in doubt. */
static void modes_are_followed_on_request(void **state)
{
    struct board_rig *rig = *state;
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"monitor", "--seconds", "0.2", "--every", "0.1", "--json", NULL});
    assert_non_null(strstr(rig->outcome.out, "\"modes\":[]"));
    run_beamfit(rig->dir, (const char *[]){"export", "model.yaml", "--track", "-o", "t.img", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    assert_non_null(strstr(rig->outcome.out, "tracking   "));
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"download", "t.img", "--key", "key", NULL});
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"monitor", "--seconds", "0.6", "--every", "0.2", "--plot", "pictures", NULL});
    assert_non_null(strstr(rig->outcome.out, "mode 2: "));
    assert_null(strstr(rig->outcome.out, "nan"));
    assert_true(file_exists(rig->dir, "pictures/live-tracking.png"));
}

static void monitor_leaves_pictures(void **state)
{
    struct board_rig *rig = *state;
    static const char *const files[] = {"pictures/live.png", "pictures/live.pdf", "pictures/live-panels.png"};
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"record", "--key", "key", "-o", "run.csv", "--samples", "100", "--settle", "0",
                                      "--chirp", "10:100:1:1", NULL});
    board_run_expect(rig, rig->board.port, 0,
                     (const char *[]){"monitor", "--seconds", "0.5", "--plot", "pictures", NULL});
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        assert_true(file_exists(rig->dir, files[i]));
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, board_rig_setup, board_rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(a_record_begins_at_rest_and_replays), CASE(the_host_predicts_the_same_from_a_record),
        CASE(drives_are_what_was_asked_for),       CASE(a_slow_line_is_prescaled_and_said),
        CASE(gaps_are_reported_and_never_filled),  CASE(monitor_prints_lines_and_objects),
        CASE(a_wire_that_is_off_is_said),          CASE(the_drive_lasts_as_long_as_the_record),
        CASE(modes_are_followed_on_request),       CASE(monitor_leaves_pictures),
    };
    return cmocka_run_group_tests_name("board: records", tests, NULL, NULL);
}
