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

static void the_page_is_made_of_the_help_texts(void **state)
{
    struct rig *rig = *state;
    run_program(rig->dir,
                (const char *[]){"sh", "-c",
                                 "set -eu\n"
                                 "\"$TOP/tools/man_page.sh\" \"$BEAMFIT\" > page.1\n"
                                 "grep -v '^\\.Dd ' page.1 > made.1\n"
                                 "grep -v '^\\.Dd ' \"$TOP/docs/man/beamfit.1\" > kept.1\n"
                                 "test -s made.1\n"
                                 "diff kept.1 made.1",
                                 NULL},
                &rig->outcome);
    if (rig->outcome.status != 0)
        fail_msg(
            "docs/man/beamfit.1 is older than the help texts: tools/man_page.sh build/beamfit > docs/man/beamfit.1\n%s",
            rig->outcome.out);
}

static void mandoc_has_nothing_to_say(void **state)
{
    struct rig *rig = *state;
    run_program(rig->dir, (const char *[]){"sh", "-c", "command -v mandoc", NULL}, &rig->outcome);
    if (rig->outcome.status != 0) {
        print_message("SKIPPED: mandoc is not installed\n");
        skip();
    }
    run_program(rig->dir, (const char *[]){"sh", "-c", "mandoc -Tlint -Wwarning \"$TOP/docs/man/beamfit.1\"", NULL},
                &rig->outcome);
    if (rig->outcome.status != 0 || rig->outcome.out[0])
        fail_msg("status %d: %s", rig->outcome.status, rig->outcome.out);
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(the_page_is_made_of_the_help_texts),
        CASE(mandoc_has_nothing_to_say),
    };
    return cmocka_run_group_tests_name("man_page", tests, NULL, NULL);
}
