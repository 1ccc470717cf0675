/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_each.c — a free linear model of each record alone beside that of all: are they records of one linear beam? */
#include "noise.h"

#include <math.h>

/* A free linear model with too few poles may miss some of a beam's own modes; it does not leave more than so many times what another of the same beam leaves. */
static const double apart = 2.0;

bool attainable_is_apart(double noise_ratio, double of_noise_ratio)
{
    return noise_ratio > apart * fmax(of_noise_ratio, 1.0);
}

bool attainable_differs(const struct attainable *a)
{
    return a->modes > 0 && isfinite(a->each_noise_ratio) && attainable_is_apart(a->noise_ratio, a->each_noise_ratio);
}

enum bf_status attainable_each(const struct model *model, const struct record records[], size_t n_records,
                               const double noise_rms[], struct attainable *all, struct bf_error *err)
{
    double ratios = 0.0, errors = 0.0, n = 0.0;
    enum bf_status status = BF_OK;
    all->each_noise_ratio = all->each_nrmse = nan("");
    if (all->modes == 0 || n_records < 2 || !attainable_is_apart(all->noise_ratio, 1.0))
        return BF_OK;
    for (size_t r = 0; r < n_records && status == BF_OK; r++) {
        struct attainable one;
        status = attainable_find(model, &records[r], 1, noise_rms ? noise_rms + r * model->n_outputs : NULL, &one, err);
        for (size_t c = 0; c < one.n_channels && status == BF_OK; c++)
            if (isfinite(one.channels[c].noise_ratio)) {
                ratios += one.channels[c].noise_ratio * one.channels[c].noise_ratio;
                errors += one.channels[c].nrmse * one.channels[c].nrmse;
                n += 1.0;
            }
        attainable_free(&one);
    }
    if (status == BF_OK && n > 0.0) {
        all->each_noise_ratio = sqrt(ratios / n);
        all->each_nrmse = sqrt(errors / n);
    }
    return status;
}
