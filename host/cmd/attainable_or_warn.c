/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "attainable_or_warn.h"

#include "ground/ground.h"

void attainable_or_warn(const struct model *model, const struct record records[], size_t n_records,
                        struct attainable *out)
{
    struct bf_error err;
    if (attainable_find(model, records, n_records, NULL, out, &err) == BF_OK)
        return;
    bf_warn("what a free linear model leaves is not known: %s", err.text);
    attainable_free(out);
}
