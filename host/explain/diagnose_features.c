/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * What the probability of a decision is computed from (probability.h): the best explanation that has one of its effects held against the best that has none.
 * docs/diagnose.md, 'How sure'.
 */
#include "diagnose_presence.h"
#include "diagnose_relatives.h"
#include "effect_kind.h"
#include "probability.h"

#include <math.h>

#include "beam/beam.h"

/* All that is set by hand, but for the weights. */
static const struct feature_limits {
    double least_excess; /* of the noise's power: a misfit that is smaller cannot be told from none */
    double small,
        large; /* of the signal: what the rig of a careful experimenter leaves, what laboratories change on purpose */
    double of_a_mass;   /* of what remains: how far that makes a mass as suspect as a spring */
    double least_taken; /* of the misfit's power: what takes less has not explained it alone */
} limits = {.least_excess = 0.05, .small = 0.02, .large = 0.5, .of_a_mass = 0.5, .least_taken = 0.8};

static double excess(const struct hypothesis *h)
{
    return fmax(hypothesis_excess(&h->fitted), limits.least_excess);
}

static double held_out_excess(const struct hypothesis *h)
{
    return fmax(hypothesis_excess(&h->check), limits.least_excess);
}

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
 * off with that floor only where it takes nearly all, of the held-out records, too; and so is every other where a free linear model leaves as much as the baseline does.
 */
static bool has_floor(const struct diagnosis *d, const struct hypothesis *h)
{
    const bool found_less = diagnose_floor(d) >= d->baseline.fitted.noise_ratio;
    return d->attainable.modes > 0 && ((is_linear(h) && !found_less) || hypothesis_is_answer(d, h));
}

/*
 * Of the fitted records with the least that any explanation leaves, or of the held-out ones with the best: whichever has more above a free linear model. Held-out ones that
 * values fitted to all records have brought within what is known of their noise say no more.
 */
static double share_left(const struct diagnosis *d, const struct hypothesis *least, const struct hypothesis *best)
{
    const double floor = diagnose_floor(d);
    const double fitted = share_above(least->fitted.noise_ratio, has_floor(d, least) ? floor : 1.0);
    if (best->check.n_channels == 0 || best->open_values)
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
        if (decision_asks_for(h, one) && h->fitted.noise_ratio < least->fitted.noise_ratio)
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

/* ---- A mass or a spring at a free place ---- */

/* 0: the misfit is as small a share of the signal as what the rig of a careful experimenter leaves; 1: as large as what laboratories change on purpose. */
static double size_of_misfit(const struct diagnosis *d)
{
    const double share = fmin(fmax(d->baseline.fitted.nrmse, limits.small), limits.large);
    return log(share / limits.small) / log(limits.large / limits.small);
}

/* All that is asked for, where no special case of it does as well, is such a mass or spring; *masses: all are masses. */
static bool follows_much(const struct diagnosis *d, const struct decision *one, bool *masses)
{
    const struct hypothesis *simplest = &d->hypotheses[diagnose_simplest(d, one->with)];
    *masses = true;
    for (size_t i = 0; i < one->n; i++) {
        const bool replaced =
            hypothesis_has(&d->hypotheses[one->with], one->among[i]) && !hypothesis_has(simplest, one->among[i]);
        if (replaced || !diagnose_follows_much(one->among[i], d->model) ||
            hypothesis_has_support(&d->hypotheses[one->with],
                                   one->among[i])) /* its place is all that it can follow with */
            return false;
        *masses = *masses && diagnose_is_mass(one->among[i], d->model);
    }
    return true;
}

/* Two or more such masses and springs, which are no support, have a strength and a place each and, with the beam's stiffness, as many unknowns as there are modes, whose frequencies they follow wherever those go. */
static bool follow_every_mode(const struct diagnosis *d, const struct hypothesis *h)
{
    size_t n = 0;
    for (size_t e = 0; e < h->n_effects; e++)
        n += diagnose_follows_much(h->effects[e], d->model) && !hypothesis_has_support(h, h->effects[e]);
    return n > 1 && 2 * n + 1 >= d->n_modes - modes_rigid(d->mode_Hz, d->n_modes);
}

/*
 * It follows what is small, whatever that is. A misfit as large as the signal a spring follows where something else stiffens the beam, and a mass where
 * something else makes it slower, but not down to what a free linear model leaves: of what remains then a mass, which has fewer like it, is half as suspect.
 */
static double follows(const struct diagnosis *d, const struct decision *one)
{
    bool masses;
    if (!follows_much(d, one, &masses))
        return 0.0;
    if (follow_every_mode(d, &d->hypotheses[one->with]))
        return 1.0;
    return 1.0 - size_of_misfit(d) * (1.0 - (masses ? limits.of_a_mass : 1.0) * one->feature[FEATURE_REMAINS]);
}

/* ---- What stands alone ---- */

double diagnose_share_taken(const struct hypothesis *h)
{
    const double both = isfinite(h->held_out_explained) ? fmin(h->explained, h->held_out_explained) : h->explained;
    return isfinite(both) ? fmin(fmax(both, 0.0), 1.0) : 0.0;
}

/* Of a misfit as large as the signal it takes nearly all, fitted and held out, and nothing else takes much, whatever the rig's own errors leave of it. */
static double alone(const struct diagnosis *d, const struct hypothesis *best, const struct hypothesis *other)
{
    const double size = size_of_misfit(d), taken = diagnose_share_taken(best);
    const double nearly_all = fmax(taken - limits.least_taken, 0.0) / (1.0 - limits.least_taken);
    return size * size * nearly_all * fmax(taken - diagnose_share_taken(other), 0.0);
}

void diagnose_fill_features(const struct diagnosis *d, struct decision *one)
{
    const struct hypothesis *best = &d->hypotheses[one->with], *other = best_other(d, one);
    double *x = one->feature;
    x[FEATURE_REMAINS] = share_left(d, least_left(d, one), best);
    x[FEATURE_SET] = best->n_effects > 1 + one->n_beside ? 1.0 : 0.0;
    x[FEATURE_LEAD] = logarithm_of(best->score - other->score);
    x[FEATURE_CROWD] = bounded(log(rms_of(other, best)), 1.0);
    x[FEATURE_FOLLOWS] = follows(d, one);
    x[FEATURE_ALONE] = (1.0 - x[FEATURE_FOLLOWS]) * alone(d, best, other);
    one->probability = probability_of(x);
}
