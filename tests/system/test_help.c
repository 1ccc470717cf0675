/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a newcomer types first: the bare program, --help of each command, mistakes on the command line. */
#include <ctype.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

static const char *const commands[] = {"init",     "modes",  "simulate", "frf",     "fit",    "compare",
                                       "effects",  "add",    "drop",     "history", "import", "export",
                                       "sign",     "verify", "replay",   "info",    "record", "monitor",
                                       "download", "upload", "report",   "doctor",  "average"};
enum { COMMANDS = sizeof commands / sizeof *commands };

/* Whether text holds word, capitals aside. */
static int says(const char *text, const char *word)
{
    for (; *text != 0; text++) {
        size_t i = 0;
        while (word[i] != 0 && tolower((unsigned char)text[i]) == tolower((unsigned char)word[i]))
            i++;
        if (word[i] == 0)
            return 1;
    }
    return 0;
}

static void the_bare_program_lists_the_commands(void **state)
{
    struct rig *rig = *state;
    run_beamfit(rig->dir, (const char *[]){NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    for (size_t i = 0; i < COMMANDS; i++) {
        char line[32];
        snprintf(line, sizeof line, "  %s ", commands[i]);
        if (strstr(rig->outcome.out, line) == NULL)
            fail_msg("'%s' is not in the list:\n%s", commands[i], rig->outcome.out);
    }
}

static void each_help_has_usage_example_and_statuses(void **state)
{
    struct rig *rig = *state;
    for (size_t i = 0; i < COMMANDS; i++) {
        run_beamfit(rig->dir, (const char *[]){commands[i], "--help", NULL}, &rig->outcome);
        char call[32];
        snprintf(call, sizeof call, "beamfit %s", commands[i]);
        const char *out = rig->outcome.out;
        if (rig->outcome.status != 0 || rig->outcome.err[0] != 0 || !says(out, "usage") || !says(out, "example") ||
            !says(out, "exit status") || strstr(out, call) == NULL)
            fail_msg("%s --help: status %d, output:\n%s%s", commands[i], rig->outcome.status, out, rig->outcome.err);
    }
}

/* At the width of the terminal: no line is longer, and no word is lost against a wide one. */
static void help_at_any_width(void **state)
{
    struct rig *rig = *state;
    static const char script[] =
        "for c in $(COLUMNS=120 \"$BEAMFIT\" | sed -n 's/^  \\([a-z][a-z]*\\)  .*/\\1/p'); do for w in 72 80 100; do\n"
        "COLUMNS=$w \"$BEAMFIT\" $c --help >narrow; COLUMNS=120 \"$BEAMFIT\" $c --help >wide\n"
        "[ \"$(wc -L <narrow)\" -le $w ] || { echo $c is wider than $w; exit 1; }\n"
        "[ \"$(tr -s '\\\\ \\n' '\\n' <narrow)\" = \"$(tr -s '\\\\ \\n' '\\n' <wide)\" ] || { echo $c loses words at "
        "$w; exit 1; }\n"
        "done; done";
    run_program(rig->dir, (const char *[]){"bash", "-c", script, NULL}, &rig->outcome);
    if (rig->outcome.status != 0)
        fail_msg("%s%s", rig->outcome.out, rig->outcome.err);
}

static void assert_usage(struct rig *rig, const char *const arguments[], const char *word)
{
    run_beamfit(rig->dir, arguments, &rig->outcome);
    if (rig->outcome.status != 2 || strncmp(rig->outcome.err, "beamfit: ", 9) != 0 ||
        strstr(rig->outcome.err, word) == NULL || rig->outcome.out[0] != 0)
        fail_msg("%s: wanted status 2 and '%s', got %d and '%s'", arguments[0], word, rig->outcome.status,
                 rig->outcome.err);
}

/* All is there where the tests run; without gnuplot that is said, with what to do, and the status is 1. */
static void the_doctor(void **state)
{
    struct rig *rig = *state;
    const int files = count_files(rig->dir);
    run_beamfit(rig->dir, (const char *[]){"doctor", NULL}, &rig->outcome);
    if (rig->outcome.status != 0 || strstr(rig->outcome.out, "ok  computation") == NULL ||
        strstr(rig->outcome.out, "draws PNG and PDF") == NULL)
        fail_msg("%d: %s%s", rig->outcome.status, rig->outcome.out, rig->outcome.err);
    assert_int_equal(count_files(rig->dir), files);
    run_program(rig->dir, (const char *[]){"sh", "-c", "PATH=/nowhere; \"$BEAMFIT\" doctor --json", NULL},
                &rig->outcome);
    assert_int_equal(rig->outcome.status, 1);
    assert_non_null(strstr(rig->outcome.out, "\"remedy\": \"apt-get install gnuplot-nox\""));
    assert_non_null(strstr(rig->outcome.err, "1 of 5 checks found something to do"));
    run_program(rig->dir, (const char *[]){"sh", "-c", "TMPDIR=/nowhere \"$BEAMFIT\" doctor", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 1);
    assert_non_null(strstr(rig->outcome.out, "set TMPDIR"));
}

static void an_unknown_command(void **state)
{
    assert_usage(*state, (const char *[]){"mods", "model.yaml", NULL}, "mods");
}

static void an_unknown_option(void **state)
{
    for (size_t i = 0; i < COMMANDS; i++)
        assert_usage(*state, (const char *[]){commands[i], "--jsno", NULL}, "jsno");
}

static void nothing_to_work_on(void **state)
{
    static const char *const needy[] = {"info", "record",  "monitor", "download", "upload",  "modes",  "simulate",
                                        "fit",  "compare", "add",     "drop",     "history", "import", "report"};
    for (size_t i = 0; i < sizeof needy / sizeof *needy; i++)
        assert_usage(*state, (const char *[]){needy[i], NULL}, "");
}

static void an_unknown_effect(void **state)
{
    assert_usage(*state, (const char *[]){"add", "model.yaml", "tip_masss", "-o", "new.yaml", NULL}, "tip_masss");
    assert_usage(*state, (const char *[]){"effects", "tip_masss", NULL}, "tip_masss");
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(the_bare_program_lists_the_commands),
        CASE(each_help_has_usage_example_and_statuses),
        CASE(help_at_any_width),
        CASE(the_doctor),
        CASE(an_unknown_command),
        CASE(an_unknown_option),
        CASE(nothing_to_work_on),
        CASE(an_unknown_effect),
    };
    return cmocka_run_group_tests_name("help", tests, NULL, NULL);
}
