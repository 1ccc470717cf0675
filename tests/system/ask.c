/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>
#include "ask.h"

const char *ran(struct rig *rig, int status, const char *const arguments[])
{
    run_beamfit(rig->dir, arguments, &rig->outcome);
    if (rig->outcome.status != status)
        fail_msg("%s: wanted status %d, got %d: %s%s", arguments[0], status, rig->outcome.status, rig->outcome.out,
                 rig->outcome.err);
    return status == 0 ? rig->outcome.out : rig->outcome.err;
}

json_t *answer(struct rig *rig, const char *const arguments[])
{
    json_error_t error;
    json_t *root = json_loads(ran(rig, 0, arguments), JSON_REJECT_DUPLICATES, &error);
    if (!json_is_object(root))
        fail_msg("%s: no JSON object (%s): %s", arguments[0], error.text, rig->outcome.out);
    return root;
}

void says(const char *text, const char *part)
{
    if (!strstr(text, part))
        fail_msg("'%s' is not in:\n%s", part, text);
}

void must(struct rig *rig, const char *script)
{
    run_program(rig->dir, (const char *[]){"bash", "-c", script, NULL}, &rig->outcome);
    if (rig->outcome.status != 0)
        fail_msg("%s\n%s%s", script, rig->outcome.out, rig->outcome.err);
}
