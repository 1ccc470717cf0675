/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The manual pages: one for each command, of what the program says of itself, and clean by mandoc and man. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

static void shell(struct rig *rig, const char *script)
{
    char text[2000];
    (void)snprintf(text, sizeof text,
                   "set -eu\n"
                   "man=$(dirname \"$BEAMFIT\")/man\n"
                   "commands=$(\"$BEAMFIT\" | sed -n 's/^  \\([a-z][a-z]*\\)  .*/\\1/p')\n%s",
                   script);
    run_program(rig->dir, (const char *[]){"sh", "-c", text, NULL}, &rig->outcome);
}

static bool is_there(struct rig *rig, const char *program)
{
    run_program(rig->dir, (const char *[]){"sh", "-c", "command -v \"$0\"", program, NULL}, &rig->outcome);
    return rig->outcome.status == 0;
}

/* Usage, every option of --help, and the list of commands. */
static void every_command_has_its_page(void **state)
{
    struct rig *rig = *state;
    shell(rig, "for c in $commands; do\n"
               "    page=$man/beamfit-$c.1\n"
               "    grep -q \"^.Nm beamfit $c\" \"$page\" || { echo \"$c has no synopsis\"; exit 1; }\n"
               "    grep -q \"^.It Xr beamfit-$c 1\" \"$man/beamfit.1\" || { echo \"$c is not listed\"; exit 1; }\n"
               "    grep -q '^.Sh EXIT STATUS' \"$page\" || { echo \"$c has no exit statuses\"; exit 1; }\n"
               "    grep -q '^.Sh EXAMPLES' \"$page\" || { echo \"$c has no example\"; exit 1; }\n"
               "    for o in $(\"$BEAMFIT\" $c --help | sed -n 's/^  \\(-., \\)*--\\([A-Za-z0-9-]*\\).*/\\2/p'); do\n"
               "        grep -q \"^.It.* Fl .-$o\" \"$page\" || { echo \"$c: no --$o\"; exit 1; }\n"
               "    done\n"
               "done\n"
               "test $(ls \"$man\" | grep -c '^beamfit-') -eq $(echo $commands | wc -w)");
    if (rig->outcome.status != 0)
        fail_msg("%s%s", rig->outcome.out, rig->outcome.err);
}

static void mandoc_has_nothing_to_say(void **state)
{
    struct rig *rig = *state;
    if (!is_there(rig, "mandoc")) {
        print_message("SKIPPED: mandoc is not installed\n");
        skip();
    }
    shell(rig, "mandoc -Tlint -Wwarning \"$man\"/*.1");
    if (rig->outcome.status != 0 || rig->outcome.out[0])
        fail_msg("status %d: %s", rig->outcome.status, rig->outcome.out);
}

/* As Debian's lintian asks it. */
static void man_has_nothing_to_warn_of(void **state)
{
    struct rig *rig = *state;
    if (!is_there(rig, "man") || !is_there(rig, "groff")) {
        print_message("SKIPPED: man or groff is not installed\n");
        skip();
    }
    shell(
        rig,
        "for page in \"$man\"/*.1; do\n"
        "    LC_ALL=C.UTF-8 MANROFFSEQ='' MANWIDTH=80 man --warnings -E UTF-8 -l -Tutf8 -Z \"$page\" 2>&1 >/dev/null\n"
        "done");
    if (rig->outcome.status != 0 || rig->outcome.out[0])
        fail_msg("status %d: %s%s", rig->outcome.status, rig->outcome.out, rig->outcome.err);
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(every_command_has_its_page),
        CASE(mandoc_has_nothing_to_say),
        CASE(man_has_nothing_to_warn_of),
    };
    return cmocka_run_group_tests_name("man_page", tests, NULL, NULL);
}
