/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Is an effect there? The best explanations that have it are held against the best that have not: alone and in sets. What stands
 * out of the others, explains much and leaves little is there with a probability that was calibrated on drawn cases (probability.h).
 * An effect that does not reach enough of it is joined by the one that speaks most against it: 'one of these is there'.
 */
#include "diagnose_presence.h"
#include "diagnose_relatives.h"
#include "probability.h"

#include <math.h>

/* Of the noise's power: a misfit that is smaller cannot be told from none. */
static const double least_excess = 0.05;

static double excess(const struct hypothesis *h)
{
    return fmax(hypothesis_excess(&h->fitted), least_excess);
}

static double held_out_excess(const struct hypothesis *h)
{
    return fmax(hypothesis_excess(&h->check), least_excess);
}

/* ---- With and without ---- */

static bool has_one(const struct hypothesis *h, const struct decision *one)
{
    for (size_t i = 0; i < one->n; i++)
        if (hypothesis_has(h, one->among[i]))
            return true;
    return false;
}

/* A special case of what is asked for (a tip mass is a point mass) does not speak against it. */
static bool has_kin(const struct diagnosis *d, const struct hypothesis *h, const struct decision *one)
{
    for (size_t i = 0; i < h->n_effects; i++)
        for (size_t k = 0; k < one->n; k++)
            if (h->effects[i] == one->among[k] || diagnose_special_case(h->effects[i], one->among[k], d->model) ||
                diagnose_special_case(one->among[k], h->effects[i], d->model))
                return true;
    return false;
}

/* The least that hypotheses leave with one of the effects, and without; of all that the decision looks at, and of single effects. */
struct sides {
    const struct hypothesis *with, *without; /* that leave the least */
    double alone, others_alone;              /* excess */
};

static void take_least(const struct hypothesis **least, const struct hypothesis *h)
{
    if (h->fitted.noise_ratio < (*least)->fitted.noise_ratio)
        *least = h;
}

static struct sides sides_of(const struct diagnosis *d, const struct decision *one)
{
    struct sides s = {.with = &d->hypotheses[one->with],
                      .without = &d->baseline,
                      .alone = excess(&d->baseline),
                      .others_alone = excess(&d->baseline)};
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        const bool with = has_one(h, one), without = !has_kin(d, h, one);
        if (h->n_effects == 1 && with)
            s.alone = fmin(s.alone, excess(h));
        if (h->n_effects == 1 && without)
            s.others_alone = fmin(s.others_alone, excess(h));
        if (h->n_effects <= one->most_effects && with)
            take_least(&s.with, h);
        if (h->n_effects <= one->most_effects && without)
            take_least(&s.without, h);
    }
    return s;
}

static void take_best(const struct diagnosis *d, size_t i, size_t *best)
{
    if (*best == d->n_hypotheses || d->hypotheses[i].score > d->hypotheses[*best].score)
        *best = i;
}

/* The best by the facts. */
static void find_best(const struct diagnosis *d, struct decision *one)
{
    one->with = one->without = d->n_hypotheses;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (h->n_effects > one->most_effects)
            continue;
        if (has_one(h, one))
            take_best(d, i, &one->with);
        else if (!has_kin(d, h, one))
            take_best(d, i, &one->without);
    }
}

/* ---- Features ---- */

/* Share of the misfit's rms that it takes, of the fitted and the held-out records together. */
static double share_explained(const struct diagnosis *d, const struct hypothesis *h)
{
    double before = excess(&d->baseline), after = excess(h);
    if (h->check.n_channels > 0 && d->baseline.check.n_channels > 0) {
        before += held_out_excess(&d->baseline);
        after += held_out_excess(h);
    }
    return fmax(1.0 - sqrt(after / before), -1.0);
}

/* Of the power that is left, the share that neither the noise nor a free linear model would leave. */
static double share_left(const struct diagnosis *d, const struct hypothesis *h)
{
    const double floor = d->attainable.modes > 0 ? fmax(d->attainable.noise_ratio, 1.0) : 1.0;
    const double left = fmax(h->fitted.noise_ratio, floor);
    return 1.0 - floor * floor / (left * left);
}

/* -1 … 1 */
static double contrast(double without, double with)
{
    return (without - with) / (without + with);
}

static void fill_features(const struct diagnosis *d, struct decision *one)
{
    const struct hypothesis *best = &d->hypotheses[one->with];
    const struct sides s = sides_of(d, one);
    double *x = one->feature;
    x[FEATURE_STANDS_OUT] = fmax(contrast(s.others_alone, s.alone), contrast(excess(s.without), excess(s.with)));
    x[FEATURE_EXPLAINED] = share_explained(d, best);
    x[FEATURE_REMAINS] = share_left(d, s.with);
    x[FEATURE_AT_NOISE] = best->explains ? 1.0 : 0.0;
    x[FEATURE_SET] = best->n_effects > 1 ? 1.0 : 0.0;
    one->probability = probability_of(x);
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
        fill_features(d, &one);
        one.probability = fmax(one.probability, before);
        before = one.probability;
        d->decisions[d->n_decisions++] = one;
        effect = strongest_other(d, &one);
    }
}

/* Each effect of the best explanation with so many effects at most. */
static void weigh_best(struct diagnosis *d, size_t most_effects)
{
    size_t best = d->n_hypotheses;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects <= most_effects)
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
