/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The manual page: what the program says of itself, and clean by mandoc. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

static void every_command_stands_in_the_page(void **state)
{
    struct rig *rig = *state;
    run_program(rig->dir,
                (const char *[]){"sh", "-c",
                                 "set -eu\n"
                                 "page=$(dirname \"$BEAMFIT\")/beamfit.1\n"
                                 "for c in $(\"$BEAMFIT\" | sed -n 's/^  \\([a-z][a-z]*\\)  .*/\\1/p'); do\n"
                                 "    grep -q \"Usage: beamfit $c \" \"$page\" || { echo $c; exit 1; }\n"
                                 "done",
                                 NULL},
                &rig->outcome);
    if (rig->outcome.status != 0)
        fail_msg("no usage in the manual page of: %s%s", rig->outcome.out, rig->outcome.err);
}

static void mandoc_has_nothing_to_say(void **state)
{
    struct rig *rig = *state;
    run_program(rig->dir, (const char *[]){"sh", "-c", "command -v mandoc", NULL}, &rig->outcome);
    if (rig->outcome.status != 0) {
        print_message("SKIPPED: mandoc is not installed\n");
        skip();
    }
    run_program(rig->dir,
                (const char *[]){"sh", "-c", "mandoc -Tlint -Wwarning \"$(dirname \"$BEAMFIT\")/beamfit.1\"", NULL},
                &rig->outcome);
    if (rig->outcome.status != 0 || rig->outcome.out[0])
        fail_msg("status %d: %s", rig->outcome.status, rig->outcome.out);
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(every_command_stands_in_the_page),
        CASE(mandoc_has_nothing_to_say),
    };
    return cmocka_run_group_tests_name("man_page", tests, NULL, NULL);
}
