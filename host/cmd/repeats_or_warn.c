/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "repeats_or_warn.h"

#include "ground/ground.h"

struct repeatability repeats_or_warn(const struct model *model, const struct record records[], size_t n_records)
{
    struct repeatability out;
    struct bf_error err;
    if (repeatability_find(model, records, n_records, &out, &err) == BF_OK)
        return out;
    bf_warn("how well repeated records agree is not known: %s", err.text);
    repeatability_free(&out);
    return out;
}
