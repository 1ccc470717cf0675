/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "python_checks.h"
#include "rig.h"

void python_check(void **state, const char *script, const char *name)
{
    struct rig *rig = *state;
    run_program(rig->dir,
                (const char *[]){"sh", "-c", "exec python3 -B \"$TOP/tests/system/$0\" \"$1\"", script, name, NULL},
                &rig->outcome);
    if (rig->outcome.status == 77) {
        print_message("%s", rig->outcome.out);
        skip();
    }
    if (rig->outcome.status != 0)
        fail_msg("%s%s", rig->outcome.out, rig->outcome.err);
}
