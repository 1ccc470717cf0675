/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Nothing is overwritten: every command with every output, onto a foreign file, its own, a changed one, an input, with --force. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "board_rig.h"
#include "rig.h"

enum { WORDS = 20 };

/* A command line without --force; the file that it writes; the file that it reads and could replace (NULL: see below). */
struct output {
    const char *words[WORDS];
    const char *file;
    int at; /* of the name in words; 0: the name is made from a folder */
    const char *input;
};

static int run_with(const char *dir, struct outcome *outcome, const struct output *output, const char *name,
                    const char *extra)
{
    const char *words[WORDS + 2];
    int n = 0;
    for (; output->words[n] != NULL; n++)
        words[n] = n == output->at && n > 0 ? name : output->words[n];
    words[n++] = extra;
    words[n] = NULL;
    run_beamfit(dir, words, outcome);
    return outcome->status;
}

static void assert_status(const struct outcome *outcome, int status, const struct output *output, const char *what)
{
    if (outcome->status != status)
        fail_msg("%s onto %s, %s: wanted status %d, got %d: %s", output->words[0], output->file, what, status,
                 outcome->status, outcome->err);
}

static void assert_refuses(const struct outcome *outcome, const struct output *output, const char *why)
{
    assert_status(outcome, 2, output, why);
    if (strstr(outcome->err, "say --force to replace it") == NULL || strstr(outcome->err, why) == NULL)
        fail_msg("%s onto %s: '%s' is not said: %s", output->words[0], output->file, why, outcome->err);
}

/* One byte more at the end, as an editor would leave it; for an image: another length. */
static void change(const char *dir, const char *name)
{
    char path[256];
    (void)snprintf(path, sizeof path, "%s/%s", dir, name);
    FILE *f = fopen(path, "a");
    assert_non_null(f);
    assert_true(fputs("# looked at\n", f) >= 0);
    assert_int_equal(fclose(f), 0);
}

/* Foreign: kept. Forced: replaced. Its own: replaced without a word. Changed since: kept. Empty: replaced. */
static void check_output(const char *dir, struct outcome *outcome, const struct output *output)
{
    static const char foreign[] = "years of work\n";
    write_text(dir, output->file, foreign);
    (void)run_with(dir, outcome, output, output->file, NULL);
    assert_refuses(outcome, output, "beamfit has not made it");
    assert_true(file_is(dir, output->file, foreign));
    (void)run_with(dir, outcome, output, output->file, "--force");
    assert_status(outcome, 0, output, "forced");
    assert_false(file_is(dir, output->file, foreign));
    (void)run_with(dir, outcome, output, output->file, NULL);
    assert_status(outcome, 0, output, "its own");
    change(dir, output->file);
    (void)run_with(dir, outcome, output, output->file, NULL);
    assert_status(outcome, 2, output, "changed");
    write_text(dir, output->file, "");
    (void)run_with(dir, outcome, output, output->file, NULL);
    assert_status(outcome, output->at > 0 ? 0 : 2, output, "empty"); /* an empty script says nothing of its pictures */
    if (output->input == NULL)
        return;
    (void)run_with(dir, outcome, output, output->input, NULL);
    assert_refuses(outcome, output, "is read by this command");
}

static void every_output_of_every_command(void **state)
{
    struct rig *rig = *state;
    static const struct output outputs[] = {
        {{"init", "-o", "out.yaml"}, "out.yaml", 2, NULL},
        {{"simulate", "model.yaml", "--input", "record.csv", "-o", "out.csv"}, "out.csv", 5, "record.csv"},
        {{"fit", "model.yaml", "record.csv", "-o", "out.yaml"}, "out.yaml", 4, "model.yaml"},
        {{"add", "model.yaml", "tip_mass", "-o", "out.yaml"}, "out.yaml", 4, "model.yaml"},
        {{"drop", "heavy.yaml", "tip_mass", "-o", "out.yaml"}, "out.yaml", 4, "heavy.yaml"},
        {{"import", "record.csv", "-o", "out.csv"}, "out.csv", 3, "record.csv"},
        {{"import", "record.csv", "--digits", "5", "-o", "out.csv"}, "out.csv", 5, "record.csv"},
        {{"average", "long.csv", "long.csv", "-o", "out.csv"}, "out.csv", 4, "long.csv"},
        {{"modes", "model.yaml", "--shapes", "out.csv"}, "out.csv", 3, "model.yaml"},
        {{"modes", "model.yaml", "--plot", "pictures"}, "pictures/shapes.gp", 0, NULL},
        {{"frf", "model.yaml", "-o", "out.uff"}, "out.uff", 3, "model.yaml"},

        {{"compare", "model.yaml", "record.csv", "--plot", "compared"}, "compared/record-piezo_V.gp", 0, NULL},
        {{"history", "model.yaml", "fitted.yaml", "--plot", "history"}, "history/history.gp", 0, NULL},
        {{"report", "model.yaml", "record.csv", "--pictures", "0", "-o", "out.html"}, "out.html", 6, "record.csv"},
        {{"discriminate", "model.yaml", "tip_mass", "quadratic_drag", "record.csv", "--only", "hit", "--no-sensors",
          "-o", "out.csv"},
         "out.csv",
         9,
         "record.csv"},
    };
    run_beamfit(rig->dir, (const char *[]){"add", "model.yaml", "tip_mass", "-o", "heavy.yaml", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    run_beamfit(rig->dir, (const char *[]){"fit", "model.yaml", "record.csv", "-o", "fitted.yaml", NULL},
                &rig->outcome);
    run_program(rig->dir, (const char *[]){"mkdir", "pictures", "compared", "history", NULL}, &rig->outcome);
    run_program(rig->dir,
                (const char *[]){"sh", "-c",
                                 "awk 'BEGIN {print \"time_s,hammer_N,piezo_V\"; for (k = 0; k < 512; k++) "
                                 "print k / 256 \",\" (k == 4) \",\" sin(k) * exp(-k / 50)}' >long.csv",
                                 NULL},
                &rig->outcome);
    for (size_t i = 0; i < sizeof outputs / sizeof *outputs; i++) {
        check_output(rig->dir, &rig->outcome, &outputs[i]);
        run_program(rig->dir, (const char *[]){"rm", "-f", outputs[i].file, NULL}, &rig->outcome);
    }
}

static void run_expect_out(struct rig *rig, const struct output *output, int status, const char *when)
{
    (void)run_with(rig->dir, &rig->outcome, output, "", NULL);
    assert_status(&rig->outcome, status, output, when);
    if (rig->outcome.out[0] != '\0')
        fail_msg("%s onto %s, %s: something was printed: %s", output->words[0], output->file, when, rig->outcome.out);
}

/* The work on sick.yaml fails, so a refusal with status 2 came before it. */
static void refusals_come_before_the_work(void **state)
{
    struct rig *rig = *state;
    static const struct output outputs[] = {
        {{"simulate", "sick.yaml", "--input", "record.csv", "-o", "out.csv"}, "out.csv", 0, NULL},
        {{"fit", "sick.yaml", "record.csv", "-o", "out.yaml"}, "out.yaml", 0, NULL},
        {{"diagnose", "sick.yaml", "record.csv", "-o", "out.yaml"}, "out.yaml", 0, NULL},
        {{"diagnose", "sick.yaml", "record.csv", "--plot", "d"}, "d/diagnose-force.png", 0, NULL},
        {{"diagnose", "sick.yaml", "record.csv", "-o", "new.yaml", "--plot", "d"},
         "d/diagnose-ranking-rows.dat",
         0,
         NULL},
        {{"modes", "sick.yaml", "--shapes", "out.csv"}, "out.csv", 0, NULL},
        {{"modes", "sick.yaml", "--shapes", "new.csv", "--plot", "d"}, "d/shapes.pdf", 0, NULL},
        {{"modes", "sick.yaml", "--convergence", "--plot", "d"}, "d/convergence.png", 0, NULL},
        {{"compare", "sick.yaml", "record.csv", "--plot", "d"}, "d/record-piezo_V.png", 0, NULL},
        {{"compare", "sick.yaml", "record.csv", "--plot", "d"}, "d/record-piezo_V-residual.gp", 0, NULL},
        {{"compare", "sick.yaml", "record.csv", "--plot", "d"}, "d/record-piezo_V-residual-time.dat", 0, NULL},
        {{"frf", "sick.yaml", "-o", "out.uff"}, "out.uff", 0, NULL},
        {{"report", "sick.yaml", "record.csv", "-o", "out.html"}, "out.html", 0, NULL},
        {{"discriminate", "sick.yaml", "tip_mass", "quadratic_drag", "record.csv", "--only", "hit", "--no-sensors",
          "-o", "out.csv"},
         "out.csv",
         0,
         NULL},
        {{"export", "sick.yaml", "-o", "out.img", "--sample-Hz", "1000"}, "out.img", 0, NULL},
        {{"export", "sick.yaml", "-o", "new.img", "--a2l", "out.a2l", "--sample-Hz", "1000"}, "out.a2l", 0, NULL},
    };
    run_program(
        rig->dir,
        (const char *[]){"sh", "-c", "mkdir d && sed 's/EI_beam_Nm2: *{*[^,}]*/&e-300/' model.yaml >sick.yaml", NULL},
        &rig->outcome);
    for (size_t i = 0; i < sizeof outputs / sizeof *outputs; i++) {
        write_text(rig->dir, outputs[i].file, rig_old_output);
        run_expect_out(rig, &outputs[i], 2, "foreign");
        assert_non_null(strstr(rig->outcome.err, "beamfit has not made it"));
        assert_true(file_is(rig->dir, outputs[i].file, rig_old_output));
        run_program(rig->dir, (const char *[]){"rm", outputs[i].file, NULL}, &rig->outcome);
        (void)run_with(rig->dir, &rig->outcome, &outputs[i], "", NULL);
        assert_in_range(rig->outcome.status, 3, 4); /* 3: export, whose model has no board */
    }
    run_program(rig->dir, (const char *[]){"sh", "-c", "ls new.* d/*", NULL}, &rig->outcome);
    assert_string_equal(rig->outcome.out, "");
}

/* What is no directory cannot hold pictures, and one that is missing is not made before there is something to put into it. */
static void no_place_for_pictures(void **state)
{
    struct rig *rig = *state;
    static const char *const places[] = {"record.csv", "record.csv/deeper", "model.yaml"};
    for (size_t i = 0; i < 3; i++) {
        const struct output plots[] = {
            {{"compare", "model.yaml", "record.csv", "--plot", places[i]}, places[i], 0, NULL},
            {{"modes", "model.yaml", "--plot", places[i]}, places[i], 0, NULL},
            {{"history", "model.yaml", "--plot", places[i]}, places[i], 0, NULL},
            {{"diagnose", "model.yaml", "record.csv", "--plot", places[i]}, places[i], 0, NULL},
            {{"monitor", "--port", "/nowhere", "--plot", places[i]}, places[i], 0, NULL},
        };
        for (size_t k = 0; k < sizeof plots / sizeof *plots; k++) {
            run_expect_out(rig, &plots[k], 3, "no directory");
            assert_non_null(strstr(rig->outcome.err, "it is a file"));
        }
    }
    assert_true(file_is(rig->dir, "model.yaml", rig_model));
}

static void run_expect(struct rig *rig, int status, const char *said, const char *const words[])
{
    run_beamfit(rig->dir, words, &rig->outcome);
    if (rig->outcome.status != status || strstr(rig->outcome.err, said) == NULL)
        fail_msg("%s: wanted status %d and '%s', got %d: %s", words[0], status, said, rig->outcome.status,
                 rig->outcome.err);
}

static void diagnose_keeps_what_it_has_not_made(void **state)
{
    struct rig *rig = *state;
    write_text(rig->dir, "out.yaml", rig_old_output);
    run_expect(rig, 2, "beamfit has not made it",
               (const char *[]){"diagnose", "model.yaml", "record.csv", "-o", "out.yaml", NULL});
    assert_true(file_is(rig->dir, "out.yaml", rig_old_output));
    assert_true(rig->outcome.out[0] == '\0'); /* before the long work */
}

/* A picture is the program's own when the script beside it is. */
static void pictures_of_others_stay(void **state)
{
    struct rig *rig = *state;
    static const char *const plot[] = {"modes", "model.yaml", "--plot", "pictures", NULL};
    run_program(rig->dir, (const char *[]){"mkdir", "pictures", NULL}, &rig->outcome);
    write_text(rig->dir, "pictures/shapes.png", rig_old_output);
    run_expect(rig, 2, "pictures/shapes.png: exists, and beamfit has not made it", plot);
    assert_true(file_is(rig->dir, "pictures/shapes.png", rig_old_output));
    assert_int_equal(file_exists(rig->dir, "pictures/shapes.gp"), 0);
    run_expect(rig, 0, "", (const char *[]){"modes", "model.yaml", "--plot", "pictures", "--force", NULL});
    run_expect(rig, 0, "", plot);
    assert_false(file_is(rig->dir, "pictures/shapes.png", rig_old_output));
}

/* A fitted model is not lost to a command that makes other models. */
static void a_file_of_another_command_stays(void **state)
{
    struct rig *rig = *state;
    run_expect(rig, 0, "", (const char *[]){"add", "model.yaml", "tip_mass", "-o", "out.yaml", NULL});
    run_expect(rig, 2, "out.yaml: was made by `beamfit add`, not by `beamfit init`",
               (const char *[]){"init", "-o", "out.yaml", NULL});
    change(rig->dir, "out.yaml");
    run_expect(rig, 2, "out.yaml: was changed after `beamfit add` had made it",
               (const char *[]){"add", "model.yaml", "tip_mass", "-o", "out.yaml", NULL});
}

/* The same file by another name is the same file; a link to a foreign file leads to it. */
static void links_are_followed(void **state)
{
    struct rig *rig = *state;
    run_program(rig->dir, (const char *[]){"ln", "-s", "model.yaml", "link.yaml", NULL}, &rig->outcome);
    run_program(rig->dir, (const char *[]){"ln", "record.csv", "hard.csv", NULL}, &rig->outcome);
    run_expect(rig, 2, "link.yaml: is read by this command",
               (const char *[]){"add", "model.yaml", "tip_mass", "-o", "link.yaml", NULL});
    run_expect(rig, 2, "hard.csv: is read by this command",
               (const char *[]){"simulate", "model.yaml", "--input", "record.csv", "-o", "hard.csv", NULL});
    assert_true(file_is(rig->dir, "model.yaml", rig_model));
}

/* The mark goes from file to file once, and is no part of what a record or a model says. */
static void one_mark_a_file(void **state)
{
    struct rig *rig = *state;
    run_expect(rig, 0, "", (const char *[]){"add", "model.yaml", "tip_mass", "-o", "a.yaml", NULL});
    run_expect(rig, 0, "", (const char *[]){"add", "a.yaml", "quadratic_drag", "-o", "b.yaml", NULL});
    run_expect(rig, 0, "", (const char *[]){"import", "record.csv", "-o", "a.csv", NULL});
    run_expect(rig, 0, "", (const char *[]){"import", "a.csv", "-o", "b.csv", NULL});
    run_program(rig->dir, (const char *[]){"grep", "-c", "made_by", "b.yaml", "b.csv", NULL}, &rig->outcome);
    assert_string_equal(rig->outcome.out, "b.yaml:1\nb.csv:1\n");
    run_expect(rig, 0, "", (const char *[]){"add", "a.yaml", "quadratic_drag", "-o", "-", NULL});
    assert_null(strstr(rig->outcome.out, "made_by"));
}

static void images_and_descriptions(void **state)
{
    struct board_rig *rig = *state;
    static const char id[] = "0123456789abcdef01234567";
    const struct output outputs[] = {
        {{"export", "model.yaml", "-o", "out.bfi"}, "out.bfi", 3, "model.yaml"},
        {{"export", "model.yaml", "-o", "c.img", "--a2l", "out.a2l"}, "out.a2l", 5, "model.yaml"},
        {{"sign", "a.img", "--key", "key", "--device", id, "--counter", "3", "-o", "out.bfi"}, "out.bfi", 9, "a.img"},
        {{"sign", "a.img", "--key", "key", "--device", id, "--counter", "3", "-o", "out.bfi"}, "out.bfi", 9, "key"},
        {{"upload", "--port", rig->board.port, "-o", "out.img"}, "out.img", 4, NULL},
    };
    for (size_t i = 0; i < sizeof outputs / sizeof *outputs; i++) {
        check_output(rig->dir, &rig->outcome, &outputs[i]);
        run_program(rig->dir, (const char *[]){"rm", "-f", outputs[i].file, NULL}, &rig->outcome);
    }
}

/* What was measured is never replaced unasked, and that is said before the board is asked for anything. */
static void recordings(void **state)
{
    struct board_rig *rig = *state;
    static const char *const record[] = {"record",    "--key", "key",      "-o", "run.csv",
                                         "--samples", "50",    "--settle", "0",  NULL};
    static const char *const forced[] = {"record", "--key",    "key", "-o",      "run.csv", "--samples",
                                         "60",     "--settle", "0",   "--force", NULL};
    board_run_expect(rig, rig->board.port, 0, record);
    board_run_expect(rig, rig->board.port, 2, record);
    assert_non_null(strstr(rig->outcome.err, "run.csv: exists, and what was measured cannot be made again"));
    board_run_expect(rig, "/nowhere", 2, record);
    board_run_expect(rig, "/nowhere", 2, (const char *[]){"upload", "-o", "run.csv", NULL});
    board_run_expect(rig, rig->board.port, 0, forced);
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"monitor", "--seconds", "0.3", "--plot", "live", NULL});
    write_text(rig->dir, "live/live.gp", "mine\n");
    board_run_expect(rig, "/nowhere", 2, (const char *[]){"monitor", "--seconds", "0.3", "--plot", "live", NULL});
    board_run_expect(rig, rig->board.port, 2, (const char *[]){"monitor", "--seconds", "0.3", "--plot", "live", NULL});
    assert_true(file_is(rig->dir, "live/live.gp", "mine\n"));
}

#define CASE(f)       cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)
#define BOARD_CASE(f) cmocka_unit_test_setup_teardown(f, board_rig_setup, board_rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(every_output_of_every_command),
        CASE(refusals_come_before_the_work),
        CASE(no_place_for_pictures),
        CASE(diagnose_keeps_what_it_has_not_made),
        CASE(pictures_of_others_stay),
        CASE(a_file_of_another_command_stays),
        CASE(links_are_followed),
        CASE(one_mark_a_file),
        BOARD_CASE(images_and_descriptions),
        BOARD_CASE(recordings),
    };
    return cmocka_run_group_tests_name("nothing is overwritten", tests, NULL, NULL);
}
