/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * From fitted hypotheses to a verdict: hypotheses are ranked by what the facts say (facts.h); the best one, the best two and so on are
 * the cause with a probability that was calibrated on drawn cases (probability.h); the smallest of these groups that is probable enough
 * is named. 'Something that the catalogue lacks' is what remains of the probability. docs/diagnose.md, 'How it decides'.
 */
#include "diagnose_relatives.h"
#include "diagnose_state.h"
#include "facts.h"
#include "probability.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* All that is set by hand. */
static const struct decision_limits {
    double enough; /* probability from which an answer is named: a wrong name costs as much as four times no name */
    double alpha;  /* family-wise error of adding an effect when nothing is missing */
    double noise;  /* times the noise, its level's own error taken off: nothing is left that matters */
    double one_channel; /* the same of the worst channel */
    double attainable;  /* times what a free linear model leaves: no linear effect is missing */
} limits = {.enough = 0.8, .alpha = 0.01, .noise = 1.05, .one_channel = 1.35, .attainable = 1.03};

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

/* ---- What a hypothesis explains, and what it leaves ---- */

static bool at_noise(const struct hypothesis_errors *e, double doubt)
{
    return e->n_channels == 0 ||
           (e->noise_ratio <= limits.noise + doubt && e->worst_ratio <= limits.one_channel + doubt);
}

/* Two standard errors of the level of the noise, over all fitted channels. */
static double noise_doubt(const struct diagnosis *d)
{
    double square = 0.0;
    for (size_t c = 0; d->noise != NULL && c < d->n_channels; c++)
        square +=
            d->noise[c].rms > 0.0 ? d->noise[c].rms_sd * d->noise[c].rms_sd / (d->noise[c].rms * d->noise[c].rms) : 0.0;
    return d->noise != NULL && d->n_channels > 0 ? 2.0 * sqrt(square) / (double)d->n_channels : 0.0;
}

static double share_explained(const struct hypothesis_errors *before, const struct hypothesis_errors *after)
{
    if (before->n_channels == 0 || after->n_channels == 0)
        return nan("");
    return hypothesis_excess(before) > 0.0 ? 1.0 - hypothesis_excess(after) / hypothesis_excess(before) : 0.0;
}

static void measure_explained(struct diagnosis *d, struct hypothesis *h)
{
    const double doubt = noise_doubt(d);
    h->explained = share_explained(&d->baseline.fitted, &h->fitted);
    h->held_out_explained = share_explained(&d->baseline.check, &h->check);
    h->explains = at_noise(&h->fitted, doubt) && at_noise(&h->check, 0.05 + doubt);
}

/* ---- Ranks ---- */

static int by_score(const void *a, const void *b)
{
    const double x = ((const struct hypothesis *)a)->score, y = ((const struct hypothesis *)b)->score;
    return (x < y) - (x > y);
}

static void take_scores(struct diagnosis *d)
{
    double *score = bf_alloc(d->n_hypotheses + 1, sizeof *score);
    facts_scores(d, score);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        d->hypotheses[i].score = score[i];
    d->baseline.score = score[d->n_hypotheses];
    free(score);
}

void diagnose_rank(struct diagnosis *d, size_t n_tried)
{
    double *p = bf_alloc(d->n_hypotheses + 1, sizeof *p);
    take_scores(d);
    if (d->n_hypotheses > 0)
        qsort(d->hypotheses, d->n_hypotheses, sizeof *d->hypotheses, by_score);
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        struct hypothesis *h = &d->hypotheses[i];
        evidence_compare(&d->baseline.fitted.misfit, &h->fitted.misfit, h->n_added, 0, n_tried, &h->evidence);
        measure_explained(d, h);
        p[i] = fmin(h->evidence.p_value * (double)n_tried / (double)d->n_hypotheses, 1.0);
    }
    holm_adjust(p, d->n_hypotheses, p);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        d->hypotheses[i].p_value = p[i];
    free(p);
}

/* More than chance, and more than the doubt about the noise. */
static bool significant(const struct diagnosis *d, const struct hypothesis *h)
{
    return h->p_value < limits.alpha && h->evidence.bic_gain > 0.0 && h->evidence.fall_share >= evidence_least_fall &&
           h->score > d->baseline.score && !(h->check.noise_ratio > d->baseline.check.noise_ratio);
}

bool diagnose_as_good(const struct diagnosis *d, const struct hypothesis *h, const struct hypothesis *best)
{
    static const double nats = 3.0;
    (void)d;
    return h->score >= best->score - nats;
}

/* ---- Decisions ---- */

static bool is_among(const struct decision *one, size_t h)
{
    for (size_t i = 0; i < one->n; i++)
        if (one->among[i] == h)
            return true;
    return false;
}

/* Kin of a member (a special case, or more effects for nothing) does not speak against it. */
static bool is_kin(const struct diagnosis *d, const struct decision *one, const struct hypothesis *h)
{
    for (size_t i = 0; i < one->n; i++) {
        const struct hypothesis *member = &d->hypotheses[one->among[i]];
        if (diagnose_same_family(d, member, h) || diagnose_contains(h, member))
            return true;
    }
    return false;
}

/* The best that speaks against the decision: n_hypotheses is the baseline. */
static size_t best_other(const struct diagnosis *d, const struct decision *one)
{
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (!is_among(one, i) && !is_kin(d, one, &d->hypotheses[i]))
            return i;
    return d->n_hypotheses;
}

static double log_ratio(double ratio)
{
    return log10(fmax(ratio, 0.1));
}

/* The least error, in units of the noise, of what speaks against the decision. */
static double least_of_others(const struct diagnosis *d, const struct decision *one)
{
    double least = d->baseline.fitted.noise_ratio;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (!is_among(one, i) && !is_kin(d, one, &d->hypotheses[i]))
            least = fmin(least, d->hypotheses[i].fitted.noise_ratio);
    return least;
}

/* Of the hypotheses with more effects beside its own: what one more would take. */
static double least_of_supersets(const struct diagnosis *d, const struct hypothesis *h)
{
    double least = h->fitted.noise_ratio;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects > h->n_effects && diagnose_contains(&d->hypotheses[i], h))
            least = fmin(least, d->hypotheses[i].fitted.noise_ratio);
    return least;
}

/* The smallest error (nrmse) that can be asked for: a free linear model's, or the noise. */
static double floor_of(const struct diagnosis *d)
{
    const double noise = d->baseline.fitted.nrmse / fmax(d->baseline.fitted.noise_ratio, 1e-3);
    return fmax(d->attainable.modes > 0 ? fmax(d->attainable.nrmse, noise) : noise, 1e-300);
}

static void fill_features(const struct diagnosis *d, struct decision *one)
{
    const struct hypothesis *best = &d->hypotheses[one->among[0]];
    const bool checked = best->check.n_channels > 0 && d->baseline.check.n_channels > 0;
    const struct hypothesis_errors *before = checked ? &d->baseline.check : &d->baseline.fitted,
                                   *after = checked ? &best->check : &best->fitted;
    double *x = one->feature;
    size_t shown;
    x[FEATURE_STRENGTH] = log_ratio(d->baseline.fitted.noise_ratio);
    x[FEATURE_EXPLAINED] = facts_explained(d, best, &shown);
    x[FEATURE_REMAINS] = log_ratio(best->fitted.nrmse / floor_of(d));
    x[FEATURE_HELD_OUT] = log_ratio(before->noise_ratio) - log_ratio(after->noise_ratio);
    x[FEATURE_GAP] = log_ratio(after->noise_ratio) - log_ratio(best->fitted.noise_ratio);
    x[FEATURE_FACTS] = log1p((double)shown);
    x[FEATURE_MORE_EFFECTS] = (double)best->n_effects - 1.0;
    x[FEATURE_AHEAD] = log_ratio(least_of_others(d, one)) - log_ratio(best->fitted.noise_ratio);
    x[FEATURE_ONE_MORE] = log_ratio(best->fitted.noise_ratio) - log_ratio(least_of_supersets(d, best));
    x[FEATURE_AT_NOISE] = best->explains ? 1.0 : 0.0;
    one->probability = probability_of(x);
}

/* One more explanation than the last decision; false: there is none that could be the cause. */
static bool extend(const struct diagnosis *d, struct decision *one, size_t most_effects)
{
    size_t i = one->n > 0 ? best_other(d, one) : 0;
    while (one->n == 0 && i < d->n_hypotheses && d->hypotheses[i].n_effects > most_effects)
        i++;
    if (i >= d->n_hypotheses || !significant(d, &d->hypotheses[i]))
        return false;
    one->among[one->n++] = i;
    fill_features(d, one);
    return true;
}

/* What the last member adds is its own probability; one explanation more cannot be less probable. */
static void keep(struct diagnosis *d, struct decision *one, double before)
{
    one->probability = fmax(one->probability, before);
    struct hypothesis *last = &d->hypotheses[one->among[one->n - 1]];
    last->probability = fmax(last->probability, one->probability - before);
    d->decisions[d->n_decisions++] = *one;
}

/*
 * From the best explanation, and from the best of those with fewer effects: more effects that take what a wrong form leaves do not speak
 * against the one that explains the most.
 */
static void make_decisions(struct diagnosis *d)
{
    d->n_decisions = 0;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        d->hypotheses[i].probability = 0.0;
    for (size_t most = d->n_hypotheses > 0 ? d->hypotheses[0].n_effects : 0; most > 0; most--) {
        struct decision one = {0};
        double before = 0.0;
        while (one.n < DECISIONS_EACH && extend(d, &one, most)) {
            keep(d, &one, before);
            before = one.probability;
        }
        while (most > 1 && one.n > 0 && d->hypotheses[one.among[0]].n_effects < most)
            most--;
    }
}

static void name(struct diagnosis *d, const struct hypothesis *h)
{
    enum { ROOM = sizeof d->named / sizeof *d->named };
    for (size_t i = 0; i < h->n_effects && d->n_named < ROOM; i++) {
        bool known = false;
        for (size_t j = 0; j < d->n_named; j++)
            known = known || strcmp(d->named[j], h->effects[i]->id) == 0;
        if (!known)
            d->named[d->n_named++] = h->effects[i]->id;
    }
}

/* What is named stands first, whatever its score; the order of the others stays. */
static void move_to_front(struct diagnosis *d, size_t first)
{
    const struct hypothesis chosen = d->hypotheses[first];
    memmove(&d->hypotheses[1], &d->hypotheses[0], first * sizeof chosen);
    d->hypotheses[0] = chosen;
    for (size_t k = 0; k < d->n_decisions; k++)
        for (size_t i = 0; i < d->decisions[k].n; i++) {
            size_t *at = &d->decisions[k].among[i];
            *at = *at == first ? 0 : *at < first ? *at + 1 : *at;
        }
}

static void take_decision(struct diagnosis *d, size_t k)
{
    move_to_front(d, d->decisions[k].among[0]);
    const struct decision *one = &d->decisions[k];
    d->verdict = one->n > 1 ? VERDICT_AMBIGUOUS : VERDICT_MISSING;
    d->probability = one->probability;
    for (size_t i = 0; i < one->n; i++) {
        struct hypothesis *h = &d->hypotheses[one->among[i]];
        name(d, h);
        h->rival = i > 0;
    }
}

bool diagnose_no_linear_misses(const struct diagnosis *d)
{
    const struct attainable *a = &d->attainable;
    return a->modes > 0 && d->linearity.verdict != LINEARITY_NONLINEAR &&
           d->baseline.fitted.nrmse <= limits.attainable * a->nrmse;
}

bool diagnose_is_complete(const struct diagnosis *d)
{
    const double doubt = noise_doubt(d);
    return at_noise(&d->baseline.fitted, doubt) && at_noise(&d->baseline.check, 0.05 + doubt);
}

bool diagnose_more_wanted(const struct diagnosis *d)
{
    return d->n_hypotheses > 0 && !d->hypotheses[0].explains;
}

/* Another explanation, no kin of these, is as good by what the facts say: the records do not tell them apart. */
static bool is_open(const struct diagnosis *d, const struct decision *one)
{
    const size_t other = best_other(d, one);
    return one->n < DECISIONS_EACH && other < d->n_hypotheses &&
           diagnose_as_good(d, &d->hypotheses[other], &d->hypotheses[one->among[0]]) &&
           significant(d, &d->hypotheses[other]);
}

/* Of the decisions that are probable enough the one with the fewest explanations, then effects; n_decisions: none is. */
static size_t simplest(const struct diagnosis *d)
{
    size_t found = d->n_decisions;
    for (size_t k = 0; k < d->n_decisions; k++) {
        const struct decision *one = &d->decisions[k], *best = &d->decisions[found];
        if (one->probability < limits.enough || is_open(d, one))
            continue;
        const size_t effects = d->hypotheses[one->among[0]].n_effects;
        if (found == d->n_decisions || one->n < best->n ||
            (one->n == best->n && effects < d->hypotheses[best->among[0]].n_effects))
            found = k;
    }
    return found;
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
    make_decisions(d);
    const size_t k = simplest(d);
    if (k < d->n_decisions) {
        take_decision(d, k);
        return;
    }
    if (diagnose_is_complete(d) || diagnose_no_linear_misses(d))
        d->verdict = VERDICT_COMPLETE;
}
