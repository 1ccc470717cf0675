/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"

enum bf_status intersample_from_text(const char *text, enum intersample *out, struct bf_error *err)
{
    static const char *const names[] = {"bl", "zoh", "foh"}; /* order of enum intersample */
    size_t chosen = 0;
    const enum bf_status status = options_choice("--intersample", text, names, 3, &chosen, err);
    if (status == BF_OK)
        *out = (enum intersample)chosen;
    return status;
}
