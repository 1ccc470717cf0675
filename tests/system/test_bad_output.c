/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Outputs that cannot be written: status 3, a reason, no half file, and what was there stays. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

static void assert_unwritable(struct rig *rig, const char *output)
{
    int files = count_files(rig->dir);
    run_beamfit(rig->dir, (const char *[]){"simulate", "model.yaml", "--input", "record.csv", "-o", output, NULL},
                &rig->outcome);
    assert_refused(&rig->outcome, output, "");
    run_beamfit(rig->dir, (const char *[]){"add", "model.yaml", "quadratic_drag", "-o", output, NULL}, &rig->outcome);
    assert_refused(&rig->outcome, output, "");
    assert_int_equal(count_files(rig->dir), files);
}

static void output_in_no_directory(void **state)
{
    assert_unwritable(*state, "nowhere/out");
}

static void output_is_a_directory(void **state)
{
    run_program(((struct rig *)*state)->dir, (const char *[]){"mkdir", "folder", NULL},
                &((struct rig *)*state)->outcome);
    assert_unwritable(*state, "folder");
}

static void output_where_nothing_may_be_created(void **state)
{
    assert_unwritable(*state, "/proc/beamfit-out"); /* refused to root, too */
}

/* The file system ends after 512 bytes of a file. */
static void file_too_large(void **state)
{
    struct rig *rig = *state;
    write_text(rig->dir, "old.csv", rig_old_output);
    write_text(rig->dir, "old.yaml", rig_old_output);
    int files = count_files(rig->dir);
    run_beamfit_on_small_disk(
        rig->dir, 512,
        (const char *[]){"simulate", "model.yaml", "--input", "record.csv", "-o", "old.csv", "--force", NULL},
        &rig->outcome);
    assert_refused(&rig->outcome, "old.csv", "cannot be written");
    run_beamfit_on_small_disk(
        rig->dir, 512, (const char *[]){"add", "model.yaml", "quadratic_drag", "-o", "old.yaml", "--force", NULL},
        &rig->outcome);
    assert_refused(&rig->outcome, "old.yaml", "cannot be written");
    assert_true(file_is(rig->dir, "old.csv", rig_old_output));
    assert_true(file_is(rig->dir, "old.yaml", rig_old_output));
    assert_int_equal(count_files(rig->dir), files);
}

/* A file system of one page, in a name space of its own where that is allowed: a real ENOSPC. */
static void disk_full(void **state)
{
    struct rig *rig = *state;
    static const char script[] =
        "mkdir disk && mount -t tmpfs -o size=4k tmpfs disk || exit 77\n"
        "printf 'what was there before\\n' >disk/old.csv\n" /* the page is used up */
        "\"$BEAMFIT\" simulate model.yaml --input record.csv -o disk/old.csv --force; status=$?\n"
        "ls disk >listing; cp disk/old.csv old.csv\n"
        "exit $status\n";
    run_program(rig->dir, (const char *[]){"unshare", "--mount", "--map-root-user", "sh", "-c", script, NULL},
                &rig->outcome);
    if (rig->outcome.status == 77 || strncmp(rig->outcome.err, "unshare:", 8) == 0) {
        print_message("SKIPPED: no mount name space here, so a full disk cannot be made: %s", rig->outcome.err);
        skip();
    }
    assert_refused(&rig->outcome, "disk/old.csv", "No space left");
    assert_true(file_is(rig->dir, "old.csv", rig_old_output));
    assert_true(file_is(rig->dir, "listing", "old.csv\n"));
}

/* Without gnuplot: said before the work (which ends with status 4 on sick.yaml), and then only pictures are missing. */
static void without_gnuplot(void **state)
{
    struct rig *rig = *state;
    static const char *const commands[] = {"modes MODEL", "modes MODEL --convergence", "compare MODEL record.csv",
                                           "diagnose MODEL record.csv", "history MODEL fitted.yaml"};
    static const char *const script = "PATH=/nowhere; \"$BEAMFIT\" $1 --plot d";
    char words[120];
    run_program(rig->dir,
                (const char *[]){"sh", "-c",
                                 "sed 's/EI_beam_Nm2: *{*[^,}]*/&e-300/' model.yaml >sick.yaml; "
                                 "\"$BEAMFIT\" fit model.yaml record.csv -o fitted.yaml",
                                 NULL},
                &rig->outcome);
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        for (int sick = 0; sick < 2; sick++) {
            const char *rest = strchr(commands[i], ' ') + sizeof "MODEL";
            (void)snprintf(words, sizeof words, "%.*s %s%s", (int)(strchr(commands[i], ' ') - commands[i]), commands[i],
                           sick ? "sick.yaml" : "model.yaml", rest);
            const int status = sick && strncmp(words, "history", 7) != 0 ? 4 : 0; /* history computes nothing */
            run_program(rig->dir, (const char *[]){"sh", "-c", script, "sh", words, NULL}, &rig->outcome);
            if (rig->outcome.status != status ||
                strstr(rig->outcome.err, "beamfit: warning: gnuplot is not installed") == NULL)
                fail_msg("%s: status %d, %s", words, rig->outcome.status, rig->outcome.err);
        }
    run_program(rig->dir, (const char *[]){"sh", "-c", "ls d/*.gp | wc -l; ls d/*.png d/*.pdf", NULL}, &rig->outcome);
    assert_true(strtol(rig->outcome.out, NULL, 10) >= 6);
    assert_null(strstr(rig->outcome.out, "png"));
}

/* An answer that cannot be printed is no answer. */
static void standard_output_full(void **state)
{
    struct rig *rig = *state;
    run_program(rig->dir, (const char *[]){"sh", "-c", "\"$BEAMFIT\" modes model.yaml --json >/dev/full", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 3);
    assert_non_null(strstr(rig->outcome.err, "beamfit: the answer cannot be written; "));
}

static void assert_one_line(struct rig *rig, const char *script, int status, const char *begin)
{
    run_program(rig->dir, (const char *[]){"sh", "-c", script, NULL}, &rig->outcome);
    if (rig->outcome.status != status ||
        strncmp(status == 0 ? rig->outcome.out : rig->outcome.err, begin, strlen(begin)) != 0)
        fail_msg("%s: status %d: %s%s", script, rig->outcome.status, rig->outcome.out, rig->outcome.err);
}

/* "-" is standard output where that has no answer, is refused where it has one, and is never a file's name. */
static void a_dash_is_no_file(void **state)
{
    struct rig *rig = *state;
    static const char *const refused[] = {"import record.csv -o -", "modes model.yaml --shapes -",
                                          "export model.yaml -o -", "diagnose model.yaml record.csv -o -"};
    char script[160];
    assert_one_line(rig, "\"$BEAMFIT\" simulate model.yaml --input record.csv -o - | grep -v '^#'", 0, "time_s,");
    assert_one_line(rig, "\"$BEAMFIT\" frf model.yaml -o - | head -n 1", 0, "    -1\n");
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        (void)snprintf(script, sizeof script, "\"$BEAMFIT\" %s", refused[i]);
        assert_one_line(rig, script, 2, "beamfit: -: standard output has the answer");
    }
    assert_one_line(rig, "\"$BEAMFIT\" simulate model.yaml --input record.csv -o - --json", 2, "beamfit: ");
    assert_int_equal(file_exists(rig->dir, "-"), 0);
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(output_in_no_directory),
        CASE(output_is_a_directory),
        CASE(output_where_nothing_may_be_created),
        CASE(file_too_large),
        CASE(disk_full),
        CASE(standard_output_full),
        CASE(without_gnuplot),
        CASE(a_dash_is_no_file),
    };
    return cmocka_run_group_tests_name("bad output", tests, NULL, NULL);
}
