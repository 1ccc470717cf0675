/* SPDX-License-Identifier: GPL-3.0-or-later */
/* `beamfit fleet report`: each check is a function of tests/system/fleet_population.py. */
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
        python_check(state, "fleet_population.py", #name);                                                             \
    }
#define TEST(name) cmocka_unit_test_setup_teardown(name, rig_setup, rig_teardown)

CHECK(population_is_the_maximum_of_the_likelihood)
CHECK(false_alarms_are_as_stated)
CHECK(what_differs_stands_out)
CHECK(few_units_are_no_population)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(population_is_the_maximum_of_the_likelihood),
        TEST(false_alarms_are_as_stated),
        TEST(what_differs_stands_out),
        TEST(few_units_are_no_population),
    };
    return cmocka_run_group_tests_name("fleet_report", tests, NULL, NULL);
}
