/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Is an effect there? The best explanations that have it are held against the best that have not: alone and in sets. What stands
 * out of the others and leaves little is there with a probability that was calibrated on drawn cases (diagnose_features.c).
 * An effect that does not reach enough of it is joined by the one that speaks most against it: 'one of these is there'.
 */
#include "diagnose_presence.h"
#include "diagnose_relatives.h"
#include "effect_kind.h"
#include "plausible.h"

#include <math.h>

/* ---- With and without ---- */

static void take_best(const struct diagnosis *d, size_t i, size_t *best)
{
    if (*best == d->n_hypotheses || d->hypotheses[i].score > d->hypotheses[*best].score)
        *best = i;
}

static bool is_asked_for(const struct decision *one, const struct beam_effect *effect)
{
    for (size_t k = 0; k < one->n; k++)
        if (one->among[k] == effect)
            return true;
    return false;
}

/* It is not asked for, and the best explanation that has what is asked for has it, too. */
static bool stands_beside(const struct diagnosis *d, const struct beam_effect *effect, const struct decision *one)
{
    return one->with < d->n_hypotheses && hypothesis_has(&d->hypotheses[one->with], effect) &&
           !is_asked_for(one, effect);
}

/* Kin of what is asked for speaks not against it, unless it stands beside it: whether a mass is there as well, beside a tip mass, the tip mass alone answers. */
static bool has_kin(const struct diagnosis *d, const struct hypothesis *h, const struct decision *one)
{
    for (size_t e = 0; e < h->n_effects; e++)
        for (size_t k = 0; k < one->n; k++)
            if (diagnose_is_kin(h->effects[e], one->among[k], d->model) && !stands_beside(d, h->effects[e], one))
                return true;
    return false;
}

static bool speaks_against(const struct diagnosis *d, const struct hypothesis *h, const struct decision *one)
{
    const bool better = one->with == d->n_hypotheses || h->score > d->hypotheses[one->with].score;
    return decision_looks_at(h, one) && !has_kin(d, h, one) && (better || !is_stand_in(h));
}

/* The best by the facts. */
static void find_best(const struct diagnosis *d, struct decision *one)
{
    one->with = one->without = d->n_hypotheses;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (decision_asks_for(&d->hypotheses[i], one))
            take_best(d, i, &one->with);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (speaks_against(d, &d->hypotheses[i], one))
            take_best(d, i, &one->without);
}

/* ---- Decisions ---- */

/* What a single effect leaves; infinite: it was not tried alone. */
static double left_alone(const struct diagnosis *d, const struct beam_effect *effect)
{
    double left = INFINITY;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects == 1 && d->hypotheses[i].effects[0] == effect)
            left = fmin(left, d->hypotheses[i].fitted.noise_ratio);
    return left;
}

/* Of the best explanation without them, the effect that explains the most alone. NULL: there is none that could be the cause. */
static const struct beam_effect *strongest_other(const struct diagnosis *d, const struct decision *one)
{
    if (one->without >= d->n_hypotheses || !diagnose_significant(d, &d->hypotheses[one->without]))
        return NULL;
    const struct hypothesis *h = &d->hypotheses[one->without];
    const struct beam_effect *found = h->effects[0];
    for (size_t i = 1; i < h->n_effects; i++)
        if (left_alone(d, h->effects[i]) < left_alone(d, found))
            found = h->effects[i];
    return found;
}

/* This effect, or one more of those that speak against it, and one more. That one of more effects is there cannot be less probable. */
static void weigh(struct diagnosis *d, const struct beam_effect *effect, size_t most_effects)
{
    struct decision one = {.most_effects = most_effects};
    double before = 0.0;
    while (effect != NULL && one.n < DECISION_EFFECTS && d->n_decisions < DECISIONS) {
        one.among[one.n++] = effect;
        find_best(d, &one);
        if (!diagnose_significant(d, &d->hypotheses[one.with]))
            return;
        diagnose_fill_features(d, &one);
        one.probability = fmax(one.probability, before);
        before = one.probability;
        d->decisions[d->n_decisions++] = one;
        effect = strongest_other(d, &one);
    }
}

/* The decision on this effect alone, with no others taken to be there. NULL: there is none. */
static const struct decision *decision_on(const struct diagnosis *d, const struct beam_effect *effect)
{
    for (size_t k = 0; k < d->n_decisions; k++) {
        const struct decision *one = &d->decisions[k];
        if (one->n == 1 && one->n_beside == 0 && one->among[0] == effect)
            return one;
    }
    return NULL;
}

/* What d->hypotheses[set] has beside effect e: into *one. Returns the probability of the least sure of them. */
static double take_others(const struct diagnosis *d, size_t set, size_t e, struct decision *one)
{
    const struct hypothesis *h = &d->hypotheses[set];
    double least = 1.0;
    for (size_t i = 0; i < h->n_effects; i++) {
        if (i == e)
            continue;
        const struct decision *other = decision_on(d, h->effects[i]);
        one->beside[one->n_beside++] = h->effects[i];
        least = fmin(least, other != NULL ? other->probability : 0.0);
    }
    return least;
}

/*
 * Effect e of a set, the others being there: what `diagnose` would say of a model that has them. Explanations that have them, and no more effects than the set, are
 * held against it, because with one more nearly everything can be followed. Kept where it says more than the set as a whole does.
 */
static void weigh_beside(struct diagnosis *d, size_t set, size_t e)
{
    const struct hypothesis *h = &d->hypotheses[set];
    const struct decision *own = decision_on(d, h->effects[e]);
    struct decision one = {.n = 1, .among = {h->effects[e]}, .most_effects = h->n_effects};
    const double others = take_others(d, set, e, &one);
    find_best(d, &one);
    if (own == NULL || own->with != set || one.with != set || one.without == d->n_hypotheses ||
        d->n_decisions == DECISIONS)
        return;
    diagnose_fill_features(d, &one);
    one.probability *= others;
    if (one.probability > own->probability)
        d->decisions[d->n_decisions++] = one;
}

/* Each effect of the best explanation with so many effects at most. */
static void weigh_best(struct diagnosis *d, size_t most_effects)
{
    size_t best = d->n_hypotheses;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects <= most_effects && !is_stand_in(&d->hypotheses[i]))
            take_best(d, i, &best);
    if (best == d->n_hypotheses)
        return;
    const struct hypothesis *h = &d->hypotheses[best];
    for (size_t e = 0; e < h->n_effects; e++) {
        bool before = false;
        for (size_t k = 0; k < e; k++)
            before = before || h->effects[k] == h->effects[e];
        if (!before)
            weigh(d, h->effects[e], most_effects);
    }
    for (size_t e = 0; h->n_effects > 1 && e < h->n_effects; e++)
        weigh_beside(d, best, e);
}

/* What was asked for alone, or what it adds to the others. */
static double presence_of(const struct diagnosis *d, const struct beam_effect *effect)
{
    double p = 0.0;
    for (size_t k = 0; k < d->n_decisions; k++) {
        const struct decision *one = &d->decisions[k];
        if (one->among[one->n - 1] == effect)
            p = fmax(p, one->n > 1 ? one->probability - d->decisions[k - 1].probability : one->probability);
    }
    return p;
}

void diagnose_weigh_presence(struct diagnosis *d)
{
    d->n_decisions = 0;
    weigh_best(d, DIAGNOSE_EFFECTS);
    if (d->n_decisions > 0 && d->hypotheses[d->decisions[0].with].n_effects > 1)
        weigh_best(d, 1);
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        struct hypothesis *h = &d->hypotheses[i];
        h->probability = 1.0;
        for (size_t e = 0; e < h->n_effects; e++)
            h->probability = fmin(h->probability, presence_of(d, h->effects[e]));
    }
}

bool diagnose_is_open(const struct diagnosis *d, const struct decision *one)
{
    return one->n < DECISION_EFFECTS && one->without < d->n_hypotheses &&
           diagnose_as_good(&d->hypotheses[one->without], &d->hypotheses[one->with]) &&
           diagnose_significant(d, &d->hypotheses[one->without]);
}
