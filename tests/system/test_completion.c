/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Completion in a real bash, beside files of a model, records and an image; the words of zsh's are its own syntax. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

/* What bash offers for the last of the words, in a line: the words as bash parts them, which is at '=' too. */
static const char *offered(struct rig *rig, const char *words)
{
    static char script[1000];
    (void)snprintf(script, sizeof script,
                   "set -e\n"
                   "touch a.yaml b.yml one.csv two.csv img.bfi notes.txt; mkdir -p sub\n"
                   "source \"$(dirname \"$BEAMFIT\")/completion/bash\"\n"
                   "complete -p beamfit >/dev/null\n"
                   "COMP_WORDS=(beamfit %s) COMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n"
                   "set +e\n_beamfit beamfit \"${COMP_WORDS[COMP_CWORD]}\" \"${COMP_WORDS[COMP_CWORD - 1]}\"\n"
                   "echo $(printf '%%s\\n' \"${COMPREPLY[@]}\" | LC_ALL=C sort)",
                   words);
    run_program(rig->dir, (const char *[]){"bash", "--norc", "-c", script, NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    assert_string_equal(rig->outcome.err, "");
    rig->outcome.out[strcspn(rig->outcome.out, "\n")] = '\0';
    return rig->outcome.out;
}

#define OFFERS(words, all) assert_string_equal(offered(rig, words), all)

static void commands_are_completed(void **state)
{
    struct rig *rig = *state;
    OFFERS("mo", "modes monitor");
    OFFERS("help dis", "discriminate");
    OFFERS("--v", "--version");
    OFFERS("nonsense ''", "");
}

static void options_and_their_values_are_completed(void **state)
{
    struct rig *rig = *state;
    OFFERS("fit --st", "--start");
    OFFERS("fit --start ''", "given near search");
    OFFERS("fit --start = ne", "near");
    OFFERS("fit --start =", "given near search");
    OFFERS("compare m.yaml r.csv --intersample z", "zoh");
    OFFERS("init --support clamped-c", "clamped-clamped");
    OFFERS("import x.bin --format u", "uff");
    OFFERS("record --drive k", "keep");
}

static void effects_are_completed(void **state)
{
    struct rig *rig = *state;
    OFFERS("add a.yaml cubic", "cubic_stiffness");
    OFFERS("effects tip", "tip_mass");
    OFFERS("drop a.yaml stop", "stop_contact");
    OFFERS("diagnose a.yaml one.csv --without tip_mass,coul", "tip_mass,coulomb_friction");
    OFFERS("discriminate a.yaml --only hit,ch", "hit,chirp");
}

static void files_are_completed_by_what_they_are(void **state)
{
    struct rig *rig = *state;
    OFFERS("fit ''", "a.yaml b.yml model.yaml sub");
    OFFERS("fit a.yaml ''", "one.csv record.csv sub two.csv");
    OFFERS("fit -o fitted.yaml a.yaml one.csv t", "two.csv");
    OFFERS("fit --start=near a.yaml o", "one.csv");
    OFFERS("fit --start = near a.yaml o", "one.csv");
    OFFERS("fit a.yaml one.csv --check t", "two.csv");
    OFFERS("history a.yaml b", "b.yml");
    OFFERS("verify i", "img.bfi");
    OFFERS("import n", "notes.txt");
    OFFERS("compare a.yaml one.csv --plot ''", "sub");
}

/* Nobody types an option that the command does not take, nor misses one. */
static void every_option_of_every_command_is_offered(void **state)
{
    struct rig *rig = *state;
    static const char script[] =
        "source \"$(dirname \"$BEAMFIT\")/completion/bash\"\n"
        "for c in ${_beamfit_commands#help}; do\n"
        "    COMP_WORDS=(beamfit $c --) COMP_CWORD=2 help=$(\"$BEAMFIT\" $c --help)\n"
        "    _beamfit\n"
        "    shown=\" $(sed -n 's/^  \\(-., \\)*\\(--[A-Za-z0-9-]*\\).*/\\2/p' <<<\"$help\" | tr '\\n' ' ')--help \"\n"
        "    for o in \"${COMPREPLY[@]}\"; do [[ $shown == *\" $o \"* ]] || echo \"$c has no $o\"; done\n"
        "    for o in $shown; do [[ \" ${COMPREPLY[*]} \" == *\" $o \"* ]] || echo \"$c lacks $o\"; done\n"
        "done";
    run_program(rig->dir, (const char *[]){"bash", "--norc", "-c", script, NULL}, &rig->outcome);
    assert_string_equal(rig->outcome.out, "");
    assert_string_equal(rig->outcome.err, "");
}

static void zsh_reads_its_own(void **state)
{
    struct rig *rig = *state;
    static const char script[] =
        "mkdir -p functions && cp \"$(dirname \"$BEAMFIT\")/completion/zsh\" functions/_beamfit &&\n"
        "fpath=($PWD/functions $fpath) && autoload -U compinit && compinit -D -u &&\n"
        "autoload -U +X _beamfit && print -r -- ${_comps[beamfit]} && zsh -n functions/_beamfit";
    run_program(rig->dir, (const char *[]){"sh", "-c", "command -v zsh", NULL}, &rig->outcome);
    if (rig->outcome.status != 0) {
        print_message("SKIPPED: zsh is not installed\n");
        skip();
    }
    run_program(rig->dir, (const char *[]){"zsh", "-f", "-c", script, NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 0);
    assert_string_equal(rig->outcome.err, "");
    assert_string_equal(rig->outcome.out, "_beamfit\n");
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(commands_are_completed),
        CASE(options_and_their_values_are_completed),
        CASE(effects_are_completed),
        CASE(files_are_completed_by_what_they_are),
        CASE(every_option_of_every_command_is_offered),
        CASE(zsh_reads_its_own),
    };
    return cmocka_run_group_tests_name("completion", tests, NULL, NULL);
}
