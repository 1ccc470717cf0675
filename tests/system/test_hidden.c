/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The cheap hidden cases (tests/hidden/run.py, FAST): simulated here, diagnosed, judged. All cases: make hidden. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

static void cheap_cases_are_named(void **state)
{
    struct rig *rig = *state;
#ifdef __SANITIZE_ADDRESS__
    print_message("SKIPPED under sanitizers: minutes; the other build runs it\n");
    skip();
#endif
    run_program(rig->dir,
                (const char *[]){"sh", "-c",
                                 "exec python3 -B \"$TOP/tests/hidden/run.py\" --fast --jobs 1 "
                                 "--build \"$(dirname \"$BEAMFIT\")\" --work hidden",
                                 NULL},
                &rig->outcome);
    print_message("%s%s", rig->outcome.out, rig->outcome.err);
    assert_int_equal(rig->outcome.status, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(cheap_cases_are_named, rig_setup, rig_teardown),
    };
    return cmocka_run_group_tests_name("hidden", tests, NULL, NULL);
}
