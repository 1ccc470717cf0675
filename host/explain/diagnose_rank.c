/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a hypothesis explains and leaves, and the order of the hypotheses: by what the facts say (facts.h). */
#include "diagnose_state.h"
#include "facts.h"

#include <math.h>
#include <stdlib.h>

/* All that is set by hand. */
static const struct rank_limits {
    double alpha;       /* family-wise error of adding an effect when nothing is missing */
    double noise;       /* times the noise, its level's own error taken off: nothing is left that matters */
    double one_channel; /* the same of the worst channel */
    double held_out;    /* more than that, of records whose values come of others */
    double nats;        /* two explanations closer than this are not told apart */
} limits = {.alpha = 0.01, .noise = 1.05, .one_channel = 1.35, .held_out = 0.05, .nats = 3.0};

/* ---- What a hypothesis explains, and what it leaves ---- */

/* ratio, worst: of what is looked at, with the mains or without. */
static bool is_noise(const struct hypothesis_errors *e, double ratio, double worst, double more)
{
    if (e->n_channels == 0)
        return true;
    return ratio <= limits.noise + more + noise_ratio_doubt(e->doubt, e->record, e->n_channels) &&
           worst <= limits.one_channel + more;
}

bool diagnose_errors_are_noise(const struct hypothesis_errors *e, bool held_out)
{
    return is_noise(e, e->noise_ratio, e->worst_ratio, held_out ? limits.held_out : 0.0);
}

static bool at_noise(const struct hypothesis *h)
{
    return diagnose_errors_are_noise(&h->fitted, false) && diagnose_errors_are_noise(&h->check, true);
}

static bool at_noise_but_for_hum(const struct hypothesis *h)
{
    return is_noise(&h->fitted, h->fitted.humless_ratio, h->fitted.humless_worst, 0.0) &&
           is_noise(&h->check, h->check.humless_ratio, h->check.humless_worst, limits.held_out);
}

static double share_explained(const struct hypothesis_errors *before, const struct hypothesis_errors *after)
{
    if (before->n_channels == 0 || after->n_channels == 0)
        return nan("");
    const double misfit = hypothesis_misfit(before);
    return misfit > 0.0 ? 1.0 - hypothesis_excess(after) / misfit : 0.0;
}

static void measure_explained(struct diagnosis *d, struct hypothesis *h)
{
    h->explained = share_explained(&d->baseline.fitted, &h->fitted);
    /* where the baseline leaves the noise there is nothing to explain */
    h->held_out_explained = diagnose_errors_are_noise(&d->baseline.check, true)
                                ? (double)NAN
                                : share_explained(&d->baseline.check, &h->check);
    /* hum is an effect of its own, and asked for after what else is missing, unless nothing else is */
    h->explains = at_noise(h) || (at_noise_but_for_hum(h) && !at_noise_but_for_hum(&d->baseline));
}

bool diagnose_leaves_hum(const struct hypothesis *h)
{
    return h->explains && !at_noise(h);
}

bool diagnose_is_complete(const struct diagnosis *d)
{
    return at_noise(&d->baseline);
}

bool diagnose_only_hum_is_left(const struct diagnosis *d)
{
    return !at_noise(&d->baseline) && at_noise_but_for_hum(&d->baseline);
}

/* Of held-out records it leaves the noise, or next to nothing of what the baseline leaves of them: values that the records leave open, no law. */
static bool linear_model_predicts(const struct diagnosis *d)
{
    const double held_out = d->attainable.held_out_noise_ratio, baseline = d->baseline.check.noise_ratio;
    return !(held_out > limits.noise + limits.held_out) ||
           held_out * held_out - 1.0 <= search_limits.thousandth * (baseline * baseline - 1.0);
}

bool diagnose_passes_for_linear(const struct diagnosis *d)
{
    return d->linearity.verdict != LINEARITY_NONLINEAR && d->attainable.modes > 0 &&
           diagnose_floor(d) <= limits.noise && linear_model_predicts(d);
}

bool diagnose_levels_agree(const struct diagnosis *d)
{
    return d->linearity.verdict == LINEARITY_LINEAR || d->linearity.verdict == LINEARITY_ADDITIVE;
}

/* A free linear model is far from the noise, and leaves more than a tenth of the misfit. */
static bool floor_is_high(const struct diagnosis *d)
{
    const double floor = diagnose_floor(d), before = d->baseline.fitted.noise_ratio;
    return floor > search_limits.far && floor * floor > search_limits.tenth * before * before;
}

bool diagnose_is_taken_for_linear(const struct diagnosis *d)
{
    return (diagnose_levels_agree(d) && !floor_is_high(d)) || diagnose_passes_for_linear(d);
}

bool diagnose_floor_is_doubtful(const struct diagnosis *d)
{
    const struct hypothesis_errors *e = &d->baseline.fitted;
    return d->attainable.modes > 0 && d->linearity.verdict != LINEARITY_NONLINEAR && e->noise_ratio <= 1.0 &&
           e->noise_ratio <= d->attainable.noise_ratio + noise_ratio_doubt(e->doubt, e->record, e->n_channels);
}

bool diagnose_more_wanted(const struct diagnosis *d)
{
    return d->n_hypotheses > 0 && !at_noise(&d->hypotheses[0]);
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

/*
 * With a sensor's own response it leaves as much of a channel as a model that predicts silence there: a sensor that is slow without end takes all of the misfit of one
 * that was not connected.
 */
static bool silences(const struct hypothesis *h)
{
    static const double silence = 0.98; /* of the signal */
    bool filters = false;
    for (size_t e = 0; e < h->n_effects; e++)
        filters = filters || h->effects[e]->filter != NULL;
    for (size_t c = 0; c < h->fit.n_channels && filters; c++) {
        const struct predict_channel *channel = &h->fit.channels[c];
        if (dense_norm(channel->n, h->fit.residual + channel->row) >=
            silence * dense_norm(channel->n, channel->measured))
            return true;
    }
    return false;
}

/* Of held-out records it leaves more than the baseline. What leaves the noise there is held against an explanation only where there is no misfit of the others to explain. */
static bool predicts_worse(const struct diagnosis *d, const struct hypothesis *h)
{
    return h->check.noise_ratio > d->baseline.check.noise_ratio &&
           (diagnose_is_complete(d) || !diagnose_errors_are_noise(&h->check, true));
}

bool diagnose_significant(const struct diagnosis *d, const struct hypothesis *h)
{
    return !silences(h) && h->p_value < limits.alpha && h->evidence.bic_gain > 0.0 &&
           h->evidence.fall_share >= evidence_least_fall && h->score > d->baseline.score && !predicts_worse(d, h);
}

bool diagnose_as_good(const struct hypothesis *h, const struct hypothesis *best)
{
    return h->score >= best->score - limits.nats;
}
