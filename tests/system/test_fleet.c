/* SPDX-License-Identifier: GPL-3.0-or-later */
/* `beamfit fleet`: each check is a function of tests/system/fleet.py, which reads RESULTS with Python's sqlite3. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <cmocka.h>
#include "python_checks.h"
#include "rig.h"

#define CHECK(name)                                                                                                    \
    static void name(void **state)                                                                                     \
    {                                                                                                                  \
        python_check(state, "fleet.py", #name);                                                                        \
    }
#define TEST(name) cmocka_unit_test_setup_teardown(name, rig_setup, rig_teardown)

CHECK(rows_are_those_of_fit)
CHECK(rows_are_those_of_diagnose)
CHECK(processes_make_no_difference)
CHECK(a_killed_run_goes_on)
CHECK(what_was_said_is_there)
CHECK(a_killed_unit_is_a_row)
CHECK(a_killed_unit_keeps_what_was_known)
CHECK(ranks_make_no_difference)
CHECK(killed_ranks_lose_nothing)
CHECK(what_has_changed_is_fitted_again)
CHECK(broken_inputs_are_rows)
CHECK(what_is_not_its_own_is_refused)
CHECK(boards_take_their_own_models)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(rows_are_those_of_fit),
        TEST(rows_are_those_of_diagnose),
        TEST(processes_make_no_difference),
        TEST(what_was_said_is_there),
        TEST(a_killed_run_goes_on),
        TEST(a_killed_unit_is_a_row),
        TEST(a_killed_unit_keeps_what_was_known),
        TEST(ranks_make_no_difference),
        TEST(killed_ranks_lose_nothing),
        TEST(what_has_changed_is_fitted_again),
        TEST(broken_inputs_are_rows),
        TEST(what_is_not_its_own_is_refused),
        TEST(boards_take_their_own_models),
    };
    return cmocka_run_group_tests_name("fleet", tests, NULL, NULL);
}
