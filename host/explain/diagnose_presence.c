/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Is an effect there? The best explanations that have it are held against the best that have not: alone and in sets. What stands
 * out of the others and leaves little is there with a probability that was calibrated on drawn cases (probability.h).
 * An effect that does not reach enough of it is joined by the one that speaks most against it: 'one of these is there'.
 */
#include "diagnose_presence.h"
#include "diagnose_relatives.h"
#include "effect_kind.h"
#include "plausible.h"
#include "probability.h"

#include <math.h>

/* Of the noise's power: a misfit that is smaller cannot be told from none. */
static const double least_excess = 0.05;
/* Of the misfit's power: what takes it is an answer of a real beam, which is never exact. */
static const double an_answer = 0.97;

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

static void take_best(const struct diagnosis *d, size_t i, size_t *best)
{
    if (*best == d->n_hypotheses || d->hypotheses[i].score > d->hypotheses[*best].score)
        *best = i;
}

/*
 * A spring that attracts is a magnet or, nearly always, a stand-in for something else: it is no explanation, and speaks against another one only where it is
 * better than that. What the damper, its special case, explains is asked for without it.
 */
static bool is_asked(const struct hypothesis *h, const struct decision *one)
{
    return h->n_effects <= one->most_effects && has_one(h, one) && !is_attracting(h);
}

static bool speaks_against(const struct diagnosis *d, const struct hypothesis *h, const struct decision *one)
{
    const bool better = one->with == d->n_hypotheses || h->score > d->hypotheses[one->with].score;
    return h->n_effects <= one->most_effects && !has_one(h, one) && !has_kin(d, h, one) &&
           (better || !is_attracting(h));
}

/* The best by the facts. */
static void find_best(const struct diagnosis *d, struct decision *one)
{
    one->with = one->without = d->n_hypotheses;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (is_asked(&d->hypotheses[i], one))
            take_best(d, i, &one->with);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (speaks_against(d, &d->hypotheses[i], one))
            take_best(d, i, &one->without);
}

/* ---- Features ---- */

/* Times the rms above the noise that `other` leaves, one leaves: of the fitted and, where both were asked, the held-out records. */
static double rms_of(const struct hypothesis *one, const struct hypothesis *other)
{
    const bool held_out = one->check.n_channels > 0 && other->check.n_channels > 0;
    const double left = excess(one) + (held_out ? held_out_excess(one) : 0.0);
    return sqrt(left / (excess(other) + (held_out ? held_out_excess(other) : 0.0)));
}

/* Of the rms that is left, the share that neither the noise nor what else is the floor would leave. */
static double share_above(double left, double floor)
{
    const double least = isfinite(floor) ? fmax(floor, 1.0) : 1.0, all = fmax(left, least);
    return sqrt(1.0 - least * least / (all * all));
}

static bool is_linear(const struct hypothesis *h)
{
    for (size_t e = 0; e < h->n_effects; e++)
        if (!effect_is_linear(h->effects[e]))
            return false;
    return true;
}

/*
 * What no linear model takes a nonlinear effect may take: a free linear model is no measure of what such an explanation should leave. It is let
 * off with that floor only where it takes nearly all, of the held-out records, too.
 */
static bool has_floor(const struct diagnosis *d, const struct hypothesis *h)
{
    const bool nearly_all = h->explained >= an_answer && !(h->held_out_explained < an_answer);
    return d->attainable.modes > 0 && (is_linear(h) || nearly_all);
}

/* Of the fitted records with the least that any explanation leaves, or of the held-out ones with the best: whichever has more above a free linear model. */
static double share_left(const struct diagnosis *d, const struct hypothesis *least, const struct hypothesis *best)
{
    const double floor = diagnose_floor(d);
    const double fitted = share_above(least->fitted.noise_ratio, has_floor(d, least) ? floor : 1.0);
    if (best->check.n_channels == 0)
        return fitted;
    /* the floor of the held-out records where it is known, and never less than of the fitted ones */
    const double held_out = has_floor(d, best) ? fmax(d->attainable.held_out_noise_ratio, floor) : 1.0;
    return fmax(fitted, share_above(best->check.noise_ratio, held_out));
}

/* Of the hypotheses with one of the effects, the one that leaves the least. */
static const struct hypothesis *least_left(const struct diagnosis *d, const struct decision *one)
{
    const struct hypothesis *least = &d->hypotheses[one->with];
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (is_asked(h, one) && h->fitted.noise_ratio < least->fitted.noise_ratio)
            least = h;
    }
    return least;
}

/* What has none of the effects: an explanation, or the baseline where that is better. */
static const struct hypothesis *best_other(const struct diagnosis *d, const struct decision *one)
{
    const bool any = one->without < d->n_hypotheses;
    return any && d->hypotheses[one->without].score > d->baseline.score ? &d->hypotheses[one->without] : &d->baseline;
}

/* Ten nats say much more than one; a hundred not much more than ten. */
static double logarithm_of(double nats)
{
    return copysign(log1p(fabs(nats)), nats);
}

static double bounded(double x, double half)
{
    return x / (half + fabs(x));
}

/* All that is asked for, where no special case of it does as well, is a mass or a spring at a free place. */
static bool follows_much(const struct diagnosis *d, const struct decision *one)
{
    const struct hypothesis *simplest = &d->hypotheses[diagnose_simplest(d, one->with)];
    for (size_t i = 0; i < one->n; i++) {
        const bool replaced =
            hypothesis_has(&d->hypotheses[one->with], one->among[i]) && !hypothesis_has(simplest, one->among[i]);
        if (replaced || !diagnose_follows_much(one->among[i], d->model))
            return false;
    }
    return true;
}

double diagnose_share_taken(const struct hypothesis *h)
{
    const double both = isfinite(h->held_out_explained) ? fmin(h->explained, h->held_out_explained) : h->explained;
    return isfinite(both) ? fmin(fmax(both, 0.0), 1.0) : 0.0;
}

static void fill_features(const struct diagnosis *d, struct decision *one)
{
    const struct hypothesis *best = &d->hypotheses[one->with], *other = best_other(d, one);
    double *x = one->feature;
    x[FEATURE_REMAINS] = share_left(d, least_left(d, one), best);
    x[FEATURE_SET] = best->n_effects > 1 ? 1.0 : 0.0;
    x[FEATURE_LEAD] = logarithm_of(best->score - other->score);
    x[FEATURE_CROWD] = bounded(log(rms_of(other, best)), 1.0);
    x[FEATURE_FOLLOWS] = follows_much(d, one) ? 1.0 : 0.0;
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
        if (d->hypotheses[i].n_effects <= most_effects && !is_attracting(&d->hypotheses[i]))
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

/* Kin of one of the effects: itself, a special case, or what it is a special case of. */
static bool is_kin(const struct diagnosis *d, const struct hypothesis *h, const struct hypothesis *named)
{
    for (size_t e = 0; e < named->n_effects; e++) {
        const struct decision one = {.n = 1, .among = {named->effects[e]}};
        if (has_kin(d, h, &one))
            return true;
    }
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
            diagnose_significant(d, &d->hypotheses[i]) &&
            (found == named || d->hypotheses[i].score > d->hypotheses[found].score))
            found = i;
    return found;
}

bool diagnose_is_open(const struct diagnosis *d, const struct decision *one)
{
    return one->n < DECISION_EFFECTS && one->without < d->n_hypotheses &&
           diagnose_as_good(&d->hypotheses[one->without], &d->hypotheses[one->with]) &&
           diagnose_significant(d, &d->hypotheses[one->without]);
}
