/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * From fitted hypotheses to a verdict. Named are the effects of the best explanation that are probable enough each for itself; otherwise
 * the fewest of which one is probable enough to be there. 'Something that the catalogue lacks' is what remains of the probability.
 * docs/diagnose.md, 'How it decides'.
 */
#include "diagnose_presence.h"
#include "diagnose_relatives.h"

#include <math.h>
#include <string.h>

/* All that is set by hand. */
static const struct decision_limits {
    double enough;     /* probability from which an answer is named: a wrong name costs as much as four times no name */
    double attainable; /* times what a free linear model leaves: no linear effect is missing */
    double
        much; /* of the misfit's power: an explanation that takes it is not taken for noise, and one that does not names nothing */
} limits = {.enough = 0.8, .attainable = 1.03, .much = 0.5};

const char *verdict_name(enum verdict verdict)
{
    static const char *const names[] = {"complete", "missing", "ambiguous", "unknown"};
    return names[verdict];
}

const char *check_kind_name(enum check_kind kind)
{
    static const char *const names[] = {"none", "records", "cross-validation"};
    return names[kind];
}

/* The noise may have been judged too low, but not by so much that a beam whose misfit is far above it lacks nothing: no linear model then does what something else would. */
bool diagnose_no_linear_misses(const struct diagnosis *d)
{
    const struct attainable *a = &d->attainable;
    return a->modes > 0 && d->linearity.verdict != LINEARITY_NONLINEAR && !diagnose_is_far(&d->baseline) &&
           d->baseline.fitted.nrmse <= limits.attainable * a->nrmse;
}

/* With poles to spare a free linear model fits the noise of its own records; held-out ones tell. */
bool diagnose_no_linear_predicts(const struct diagnosis *d)
{
    return d->attainable.modes > 0 && d->linearity.verdict != LINEARITY_NONLINEAR && d->baseline.check.n_channels > 0 &&
           d->baseline.check.noise_ratio <= limits.attainable * d->attainable.held_out_noise_ratio;
}

/* The best explanation with it takes most of the misfit: beside much that nothing explains, what takes a little is a guess, whatever stands behind it. */
static bool explains_most(const struct diagnosis *d, const struct decision *one)
{
    return d->hypotheses[one->with].explained >= limits.much;
}

static bool is_sure(const struct diagnosis *d, const struct decision *one)
{
    return one->probability >= limits.enough && explains_most(d, one) && !diagnose_is_open(d, one);
}

static size_t moved(size_t i, size_t first)
{
    return i == first ? 0 : i < first ? i + 1 : i;
}

/* What is named stands first, whatever its score; the order of the others stays. */
static void move_to_front(struct diagnosis *d, size_t first)
{
    const struct hypothesis chosen = d->hypotheses[first];
    memmove(&d->hypotheses[1], &d->hypotheses[0], first * sizeof chosen);
    d->hypotheses[0] = chosen;
    for (size_t k = 0; k < d->n_decisions; k++) {
        d->decisions[k].with = moved(d->decisions[k].with, first);
        d->decisions[k].without = moved(d->decisions[k].without, first);
    }
}

/* ---- One explanation ---- */

/* [n] of an explanation that stands out: effects that are there, each for itself. */
struct found {
    size_t n;
    const struct beam_effect *effects[DIAGNOSE_EFFECTS];
    const struct hypothesis *with[DIAGNOSE_EFFECTS]; /* the best explanations that have them */
    double probability;                              /* of the least sure */
};

/* It was weighed in explanations with so many effects at most. */
static bool is_weighed_in(const struct decision *one, size_t most_effects)
{
    return one->n_beside > 0 ? most_effects == DIAGNOSE_EFFECTS : one->most_effects == most_effects;
}

static bool is_found(const struct found *found, const struct beam_effect *effect)
{
    for (size_t e = 0; e < found->n; e++)
        if (found->effects[e] == effect)
            return true;
    return false;
}

static struct found sure_effects(const struct diagnosis *d, size_t most_effects)
{
    struct found found = {.probability = 1.0};
    for (size_t k = 0; k < d->n_decisions && found.n < DIAGNOSE_EFFECTS; k++) {
        const struct decision *one = &d->decisions[k];
        if (one->n > 1 || !is_weighed_in(one, most_effects) || !is_sure(d, one) || is_found(&found, one->among[0]))
            continue;
        found.with[found.n] = &d->hypotheses[one->with];
        found.effects[found.n++] = one->among[0];
        found.probability = fmin(found.probability, one->probability);
    }
    return found;
}

/* The best hypothesis of just these effects, a support that rocks being no clamp that gives; n_hypotheses: none. */
static size_t made_of(const struct diagnosis *d, const struct found *found)
{
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        bool all = h->n_effects == found->n;
        for (size_t e = 0; e < found->n; e++)
            all = all && hypothesis_has(h, found->effects[e]) &&
                  hypothesis_swings(h, found->effects[e]) == hypothesis_swings(found->with[e], found->effects[e]);
        if (all)
            return i;
    }
    return d->n_hypotheses;
}

static void name(struct diagnosis *d, const struct beam_effect *effect)
{
    for (size_t j = 0; j < d->n_named; j++)
        if (strcmp(d->named[j], effect->id) == 0)
            return;
    if (d->n_named < sizeof d->named / sizeof *d->named)
        d->named[d->n_named++] = effect->id;
}

/* What is told of an explanation: the special case that does as well, which then is as probable as it was. */
static size_t told_of(struct diagnosis *d, size_t i, double probability)
{
    const size_t simple = diagnose_simplest(d, i);
    if (simple != i)
        d->hypotheses[simple].probability = probability, d->hypotheses[i].probability = 0.0;
    return simple;
}

/* From the best explanation, else from the best single effect. */
static bool take_missing(struct diagnosis *d)
{
    for (size_t most = DIAGNOSE_EFFECTS; most > 0; most = most > 1 ? 1 : 0) {
        const struct found found = sure_effects(d, most);
        const size_t made = found.n > 0 ? made_of(d, &found) : d->n_hypotheses;
        if (made == d->n_hypotheses)
            continue;
        const size_t h = told_of(d, made, found.probability);
        d->verdict = VERDICT_MISSING;
        d->probability = found.probability;
        for (size_t e = 0; e < d->hypotheses[h].n_effects; e++)
            name(d, d->hypotheses[h].effects[e]);
        move_to_front(d, h);
        return true;
    }
    return false;
}

/* ---- One of several ---- */

/* Of the decisions that are sure the one with the fewest effects; NULL: none is. */
static const struct decision *fewest(const struct diagnosis *d)
{
    const struct decision *found = NULL;
    for (size_t k = 0; k < d->n_decisions; k++)
        if (is_sure(d, &d->decisions[k]) && (found == NULL || d->decisions[k].n < found->n))
            found = &d->decisions[k];
    return found;
}

static bool has_another(const struct hypothesis *h, const struct decision *one, const struct beam_effect *effect)
{
    for (size_t e = 0; e < one->n; e++)
        if (one->among[e] != effect && hypothesis_has(h, one->among[e]))
            return true;
    return false;
}

/* The best hypothesis that the decision looks at with this of its effects, and with none of the others if there is one: those are held against it. */
static size_t best_with(const struct diagnosis *d, const struct decision *one, const struct beam_effect *effect)
{
    size_t best[2] = {one->with, one->with};
    double score[2] = {-INFINITY, -INFINITY};
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        const int shared = has_another(h, one, effect);
        if (h->n_effects > one->most_effects || !hypothesis_has(h, effect) || h->score <= score[shared])
            continue;
        best[shared] = i;
        score[shared] = h->score;
    }
    return best[isfinite(score[0]) ? 0 : 1];
}

/* The effect, or its special case that a simpler explanation has in its place. */
static const struct beam_effect *effect_in(const struct diagnosis *d, const struct hypothesis *simple,
                                           const struct beam_effect *effect)
{
    if (hypothesis_has(simple, effect))
        return effect;
    for (size_t e = 0; e < simple->n_effects; e++)
        if (diagnose_special_case(simple->effects[e], effect, d->model))
            return simple->effects[e];
    return effect;
}

static bool take_ambiguous(struct diagnosis *d)
{
    const struct decision *one = fewest(d);
    if (one == NULL || one->n < 2)
        return false;
    d->verdict = VERDICT_AMBIGUOUS;
    d->probability = one->probability;
    for (size_t e = 0; e < one->n; e++) {
        const size_t best = best_with(d, one, one->among[e]);
        struct hypothesis *told = &d->hypotheses[told_of(d, best, d->hypotheses[best].probability)];
        name(d, effect_in(d, told, one->among[e]));
        told->rival = true;
    }
    const size_t first = diagnose_simplest(d, one->with);
    d->hypotheses[first].rival = false;
    move_to_front(d, first);
    return true;
}

static bool adds_a_signal(const struct hypothesis *h)
{
    for (size_t e = 0; e < h->n_effects; e++)
        if (h->effects[e]->signal != NULL)
            return true;
    return false;
}

/*
 * By something: what a linear model cannot take (a saturation of the drive) is no noise, though it is not sure what it is. `beside_signals`: by something else
 * than a signal in a channel, of which hum is one.
 */
static bool much_is_explained(const struct diagnosis *d, bool beside_signals)
{
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (diagnose_significant(d, h) && h->explained > limits.much && !(beside_signals && adds_a_signal(h)))
            return true;
    }
    return false;
}

/* A steady line near the mains' frequency may also be a harmonic of a drive, or a support that moves: then something else explains it. */
static bool only_hum_is_left(const struct diagnosis *d)
{
    return diagnose_only_hum_is_left(d) && !much_is_explained(d, true);
}

void diagnose_decide(struct diagnosis *d)
{
    d->n_named = 0;
    d->probability = nan("");
    d->n_decisions = 0;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        d->hypotheses[i].rival = false;
    d->verdict = VERDICT_UNKNOWN;
    if (d->interrupted || !diagnose_computed(d))
        return;
    diagnose_weigh_presence(d);
    if (take_missing(d) || take_ambiguous(d))
        return;
    if (diagnose_is_complete(d) || only_hum_is_left(d) ||
        (diagnose_no_linear_misses(d) && !much_is_explained(d, false)))
        d->verdict = VERDICT_COMPLETE;
}
