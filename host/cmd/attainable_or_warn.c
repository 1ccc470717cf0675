/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "attainable_or_warn.h"

#include "ground/ground.h"
#include "response/response.h"

void attainable_or_warn(const struct model *model, const struct record records[], size_t n_records,
                        const struct record checks[], size_t n_checks, struct attainable *out)
{
    struct bf_error err;
    *out = (struct attainable){0};
    for (size_t r = 0; r < n_records; r++)
        if (!record_is_driven(model, &records[r]))
            return; /* no model answers to nothing: that is said elsewhere, and a floor would lead away from it */
    if (attainable_find(model, records, n_records, NULL, out, &err) == BF_OK &&
        attainable_each(model, records, n_records, NULL, out, &err) == BF_OK &&
        attainable_check(model, records, n_records, NULL, checks, n_checks, out, &err) == BF_OK)
        return;
    bf_warn("what a free linear model leaves is not known: %s", err.text);
    attainable_free(out);
}
