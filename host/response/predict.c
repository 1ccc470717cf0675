/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"

#include <stdlib.h>
#include <string.h>

enum bf_status splines_from_text(const char *text, struct predict_options *out, struct bf_error *err)
{
    enum { FEWEST = 5, MOST = 1000 };
    char *end;
    const long n = strtol(text, &end, 10);
    out->uniform_splines = strcmp(end, ",uniform") == 0;
    if (end == text || (*end && !out->uniform_splines) || n < FEWEST || n > MOST)
        return bf_fail(err, BF_USAGE, "--splines %s: give a number from %d to %d, and ',uniform' for even knots", text,
                       FEWEST, MOST);
    out->fine_splines = (size_t)n;
    return BF_OK;
}

size_t predict_rows_of(const struct predict_channel channels[], size_t n_channels, size_t record, size_t *first)
{
    size_t n = 0;
    *first = 0;
    for (size_t c = 0; c < n_channels; c++) {
        if (channels[c].record != record)
            continue;
        if (n == 0)
            *first = channels[c].row;
        n += channels[c].n;
    }
    return n;
}
