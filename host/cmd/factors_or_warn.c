/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "factors_or_warn.h"

#include "ground/ground.h"

void factors_or_warn(const struct model *model, const struct record records[], size_t n_records,
                     const struct predict_options *options, const struct fit_result *fitted, bool places,
                     struct channel_factors *out)
{
    struct bf_error err;
    *out = (struct channel_factors){0};
    if (fitted != NULL && fitted->interrupted)
        return;
    if (channel_factors_find(model, records, n_records, options, fitted, places, out, &err) == BF_OK)
        return;
    bf_warn("signs and units of the channels were not checked: %s", err.text);
    channel_factors_free(out);
}
