/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"

#include <string.h>

enum bf_status intersample_from_text(const char *text, enum intersample *out, struct bf_error *err)
{
    static const char *const names[] = {"bl", "zoh", "foh"}; /* order of enum intersample */
    for (int i = 0; i < 3; i++) {
        if (strcmp(text, names[i]) == 0) {
            *out = (enum intersample)i;
            return BF_OK;
        }
    }
    return bf_fail(err, BF_USAGE, "--intersample %s is unknown; it can be bl, foh or zoh", text);
}
