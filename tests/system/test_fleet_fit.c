/* SPDX-License-Identifier: GPL-3.0-or-later */
/* `beamfit fleet fit` and `beamfit-fleet fit`: each check is a function of tests/system/fleet_fit.py. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "python_checks.h"
#include "rig.h"

#define CHECK(name)                                                                                                    \
    static void name(void **state)                                                                                     \
    {                                                                                                                  \
        python_check(state, "fleet_fit.py", #name);                                                                    \
    }
#define TEST(name) cmocka_unit_test_setup_teardown(name, rig_setup, rig_teardown)

CHECK(one_model_is_that_of_fit)
CHECK(processes_and_ranks_have_the_same_bits)
CHECK(what_cannot_be_fitted_is_said)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(one_model_is_that_of_fit),
        TEST(processes_and_ranks_have_the_same_bits),
        TEST(what_cannot_be_fitted_is_said),
    };
    return cmocka_run_group_tests_name("fleet fit", tests, NULL, NULL);
}
