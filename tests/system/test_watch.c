/* SPDX-License-Identifier: GPL-3.0-or-later */
/* `beamfit watch`: in a browser from a hidden mass to the noise, and against requests of others. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "ask.h"
#include "hidden_mass.h"

static void from_a_hidden_mass_to_the_noise(void **state)
{
    struct rig *rig = *state;
    run_program(rig->dir, (const char *[]){"sh", "-c", "command -v chromium >/dev/null", NULL}, &rig->outcome);
    if (rig->outcome.status != 0) {
        print_message("the page is not opened: chromium is not installed\n");
        skip();
    }
    must(rig, "PYTHONPATH=\"$TOP/tests\" python3 -B \"$TOP/tests/system/watch_browser.py\" \"$BEAMFIT\"");
}

static void requests_of_others(void **state)
{
    must(*state,
         "PYTHONPATH=\"$TOP/tests:$TOP/tests/system\" python3 -B \"$TOP/tests/system/watch_hostile.py\" \"$BEAMFIT\"");
}

static void refused(struct rig *rig, const char *const arguments[], int status, const char *said)
{
    run_beamfit(rig->dir, arguments, &rig->outcome);
    if (rig->outcome.status != status || strstr(rig->outcome.err, said) == NULL)
        fail_msg("wanted status %d and '%s', got %d: %s", status, said, rig->outcome.status, rig->outcome.err);
}

#define REFUSED(rig, status, said, ...) refused(rig, (const char *[]){"watch", __VA_ARGS__, NULL}, status, said)

static void what_is_refused(void **state)
{
    struct rig *rig = *state;
    REFUSED(rig, 2, "at least one record", "fitted.yaml");
    REFUSED(rig, 2, "--port", "fitted.yaml", "soft.csv", "--port", "70000");
    REFUSED(rig, 3, "is no directory", "fitted.yaml", "soft.csv", "--folder", "nowhere");
    REFUSED(rig, 3, "nowhere.csv", "fitted.yaml", "nowhere.csv");
    REFUSED(rig, 3, "nowhere.yaml", "nowhere.yaml", "soft.csv");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(from_a_hidden_mass_to_the_noise),
        cmocka_unit_test(requests_of_others),
        cmocka_unit_test(what_is_refused),
    };
    return cmocka_run_group_tests_name("watch", tests, hidden_mass_setup, rig_teardown);
}
