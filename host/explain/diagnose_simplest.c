/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A special case instead of what is more general, where that takes little more. */
#include "diagnose_presence.h"
#include "diagnose_relatives.h"

#include <math.h>

/* One of its effects is kin of one of those. */
static bool is_kin(const struct diagnosis *d, const struct hypothesis *h, const struct hypothesis *named)
{
    for (size_t i = 0; i < h->n_effects; i++)
        for (size_t e = 0; e < named->n_effects; e++)
            if (diagnose_is_kin(h->effects[i], named->effects[e], d->model))
                return true;
    return false;
}

/* Nats that the best single effect gains over the baseline that has nothing to do with what is to be named. */
static double gain_of_unrelated(const struct diagnosis *d, const struct hypothesis *named)
{
    double gain = 0.0;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects == 1 && !is_kin(d, &d->hypotheses[i], named))
            gain = fmax(gain, d->hypotheses[i].score - d->baseline.score);
    return gain;
}

/* The same set with a special case of one of its effects. */
static bool simplifies(const struct diagnosis *d, const struct hypothesis *simple, const struct hypothesis *named)
{
    size_t specials = 0;
    if (simple->n_effects != named->n_effects)
        return false;
    for (size_t e = 0; e < simple->n_effects; e++) {
        bool special = false;
        for (size_t k = 0; k < named->n_effects; k++)
            special = special || diagnose_special_case(simple->effects[e], named->effects[k], d->model);
        if (!special && !hypothesis_has(named, simple->effects[e]))
            return false;
        specials += special;
    }
    return specials > 0;
}

size_t diagnose_simplest(const struct diagnosis *d, size_t named)
{
    const struct hypothesis *h = &d->hypotheses[named];
    const double gain = gain_of_unrelated(d, h);
    size_t found = named;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (simplifies(d, &d->hypotheses[i], h) && h->score - d->hypotheses[i].score < gain &&
            d->hypotheses[i].fitted.noise_ratio <= search_limits.more * h->fitted.noise_ratio &&
            diagnose_significant(d, &d->hypotheses[i]) &&
            (found == named || d->hypotheses[i].score > d->hypotheses[found].score))
            found = i;
    return found;
}
