/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * From fitted hypotheses to a verdict. Every threshold is a named constant with its reason; docs/diagnose.md, 'Decision',
 * says by which simulation each was set.
 */
#include "diagnose_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Family-wise error of naming an effect when nothing is missing. */
static const double alpha = 0.01;
/* Noise ratios up to which nothing is left that matters: the floor itself is known to about 1.2 % a channel, held-out
 * records may be cut while the drive still runs. */
static const double noise_fitted = 1.10, noise_check = 1.15, noise_one_channel = 1.35;
/* Of a weak misfit at most this part of the excess (in power) may remain as well, unless what remains is within the floor's own error. */
static const double weak_share = 0.15, within_floor = 1.03;
/*
 * A law or a damping alone explains a misfit many times the noise also when this part of the excess (in power) remains, 7 % of its rms:
 * their forms are idealisations. Masses, springs, loads and filters have exact forms and must come down to the noise.
 */
static const double left_share = 0.005;
/*
 * Several effects, and on a weak misfit a single one, have parameters enough to fit part of what they do not cause, so they must come
 * down to the noise itself. A channel's floor is known to floor_error, so over n channels the rms may be several · floor_error/√n above
 * it. Laws are excepted, because their form has a larger error.
 */
static const double floor_error = 0.012, several = 3.5;
/* One more effect must lower the fitted rms by this much, or nobody would see the difference. */
static const double least_gain = 0.02;
/*
 * An explanation within this fall of the whitened misfit of the best is a rival: 20 for the search, and this share of the rows for
 * what the models themselves may be wrong by (0.1 % of the noise's rms).
 */
static const double rival_fall = 20.0, rival_share = 0.002;
/*
 * The cause leaves nothing systematic; a wrong effect that fits as well leaves the difference. An explanation of which one more effect
 * would take more than this share of the whitened misfit, beyond what a search finds in noise, is taken for a wrong one.
 */
static const double remainder_share = 0.003;
/*
 * An explanation whose held-out records are this much (rms) worse predicted than by the best is no rival. Both are measured on the same
 * noise, so its level cancels; effects that act alike differ by less.
 */
static const double refuted_by_check = 1.015;
/* Below this ratio a baseline that no effect improves is complete. */
static const double complete_ratio = 1.05;

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

/* ---- Evidence ---- */

static double excess(double ratio)
{
    return fmax(ratio * ratio - 1.0, 0.0);
}

static bool at_noise(const struct hypothesis_errors *e, double limit)
{
    return e->n_channels == 0 || (e->noise_ratio <= limit && e->worst_ratio <= noise_one_channel);
}

/* Most of the excess over the noise that the baseline leaves is explained. */
static bool most_explained(const struct hypothesis_errors *e, const struct hypothesis_errors *before)
{
    return e->noise_ratio <= within_floor || excess(e->noise_ratio) <= weak_share * excess(before->noise_ratio);
}

static bool is_reached(const struct hypothesis_errors *e, const struct hypothesis_errors *before, double limit,
                       bool idealised)
{
    return at_noise(e, limit) || (idealised && excess(e->noise_ratio) <= left_share * excess(before->noise_ratio));
}

/* One effect whose form is an idealisation. */
static bool is_idealised(const struct hypothesis *h)
{
    return h->n_effects == 1 && (hypothesis_has_law(h) || h->effects[0]->family == BEAM_FAMILY_DAMPING);
}

/* Ratio up to which the fitted records are at the noise; see floor_error. */
static double fitted_limit(const struct diagnosis *d, const struct hypothesis *h)
{
    if (hypothesis_has_law(h) || h->fitted.n_channels == 0 || (h->n_effects < 2 && diagnose_is_far(&d->baseline)))
        return noise_fitted;
    return 1.0 + several * floor_error / sqrt((double)h->fitted.n_channels);
}

bool diagnose_too_many(const struct diagnosis *d, const struct hypothesis *h)
{
    return h->n_effects > 1 && !diagnose_is_far(&d->baseline);
}

bool diagnose_is_doubtful(const struct diagnosis *d, const struct hypothesis *h)
{
    return h->n_effects > 1 || !diagnose_is_far(&d->baseline);
}

bool diagnose_leaves_more(const struct diagnosis *d, const struct hypothesis *h)
{
    return diagnose_is_doubtful(d, h) && h->remains > rival_fall + remainder_share * (double)h->fitted.misfit.n;
}

/* Whitened misfit with a price for parameters; comparable between hypotheses. */
static double criterion(const struct hypothesis *h, double scale)
{
    return h->fitted.misfit.chi_square / scale + (double)h->n_added * log(h->fitted.misfit.n_eff);
}

static double misfit_scale(const struct diagnosis *d)
{
    double scale = d->baseline.fitted.misfit.chi_square / (double)d->baseline.fitted.misfit.n;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        scale = fmin(scale, d->hypotheses[i].fitted.misfit.chi_square / (double)d->hypotheses[i].fitted.misfit.n);
    return fmax(scale, 1.0);
}

static int by_criterion(const void *a, const void *b, void *scale)
{
    const double x = criterion(a, *(double *)scale), y = criterion(b, *(double *)scale);
    return (x > y) - (x < y);
}

void diagnose_rank(struct diagnosis *d, size_t n_tried)
{
    double scale = misfit_scale(d);
    if (d->n_hypotheses == 0)
        return;
    double *p = bf_alloc(d->n_hypotheses + 1, sizeof *p);
    qsort_r(d->hypotheses, d->n_hypotheses, sizeof *d->hypotheses, by_criterion, &scale);
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        struct hypothesis *h = &d->hypotheses[i];
        evidence_compare(&d->baseline.fitted.misfit, &h->fitted.misfit, h->n_added, 0, n_tried, &h->evidence);
        h->explains = !diagnose_too_many(d, h) && !diagnose_leaves_more(d, h) &&
                      most_explained(&h->fitted, &d->baseline.fitted) &&
                      is_reached(&h->fitted, &d->baseline.fitted, fitted_limit(d, h), is_idealised(h)) &&
                      is_reached(&h->check, &d->baseline.check, noise_check, is_idealised(h));
        p[i] = fmin(h->evidence.p_value * (double)n_tried / (double)d->n_hypotheses, 1.0);
    }
    holm_adjust(p, d->n_hypotheses, p);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        d->hypotheses[i].p_value = p[i];
    free(p);
}

static bool significant(const struct diagnosis *d, const struct hypothesis *h)
{
    return h->p_value < alpha && h->evidence.bic_gain > 0.0 && h->evidence.fall_share >= evidence_least_fall &&
           !(h->check.noise_ratio > d->baseline.check.noise_ratio);
}

/* ---- Which of the hypotheses ---- */

static bool has_effect(const struct hypothesis *h, const struct beam_effect *effect)
{
    for (size_t i = 0; i < h->n_effects; i++)
        if (h->effects[i] == effect)
            return true;
    return false;
}

static bool contains(const struct hypothesis *large, const struct hypothesis *small)
{
    for (size_t i = 0; i < small->n_effects; i++)
        if (!has_effect(large, small->effects[i]))
            return false;
    return true;
}

/*
 * More effects than the simpler one that explains the records too, and not worth them: they lower the rms too little, or they
 * do not end at the noise either: a remainder that several effects cannot take away is a flaw in the form of the first.
 */
static bool not_worth(const struct hypothesis *large, const struct hypothesis *small)
{
    return large->n_effects > small->n_effects && small->explains &&
           (!large->explains || large->fitted.noise_ratio > (1.0 - least_gain) * small->fitted.noise_ratio);
}

/* The terms of `small` are those of `large` with some parameters neutral or a place at the free end. */
static bool special_case(const struct beam_effect *small, const struct beam_effect *large, const struct model *model)
{
    double ps[BEAM_EFFECT_PARAMETERS], pl[BEAM_EFFECT_PARAMETERS];
    struct beam_term ts[BEAM_EFFECT_TERMS] = {0}, tl[BEAM_EFFECT_TERMS] = {0};
    const struct beam_place place = model_place(model);
    if (small == large || small->terms == NULL || large->terms == NULL || small->n_terms != large->n_terms ||
        small->n_parameters >= large->n_parameters)
        return false;
    for (int j = 0; j < small->n_parameters; j++)
        ps[j] = small->parameters[j].role == BEAM_ROLE_PLACE ? model->length_m : small->parameters[j].start;
    for (int i = 0; i < large->n_parameters; i++) {
        const struct beam_parameter_info *info = &large->parameters[i];
        pl[i] = info->role == BEAM_ROLE_PLACE ? model->length_m : info->neutral;
        for (int j = 0; j < small->n_parameters; j++)
            if (strcmp(info->name, small->parameters[j].name) == 0)
                pl[i] = ps[j];
    }
    if (small->terms(ps, &place, ts) != 0 || large->terms(pl, &place, tl) != 0)
        return false;
    for (int t = 0; t < small->n_terms; t++) {
        const struct beam_coefficients *a = &ts[t].value, *b = &tl[t].value;
        if (ts[t].place.kind != tl[t].place.kind || ts[t].place.at_m != tl[t].place.at_m || a->mass != b->mass ||
            a->damping != b->damping || a->stiffness != b->stiffness || a->memory != b->memory)
            return false;
    }
    return true;
}

/* Both hypotheses are the same but for effects of which one is a special case of the other. */
static bool same_family(const struct diagnosis *d, const struct hypothesis *a, const struct hypothesis *b)
{
    if (a->n_effects != b->n_effects)
        return false;
    for (size_t i = 0; i < a->n_effects; i++) {
        bool found = false;
        for (size_t j = 0; j < b->n_effects; j++)
            found = found || a->effects[i] == b->effects[j] || special_case(a->effects[i], b->effects[j], d->model) ||
                    special_case(b->effects[j], a->effects[i], d->model);
        if (!found)
            return false;
    }
    return true;
}

/* What models themselves may be wrong by, in the whitened misfit: two hypotheses closer than this are equally good. */
static double margin_of(const struct hypothesis *h)
{
    return rival_fall + rival_share * (double)h->fitted.misfit.n;
}

bool diagnose_as_good(const struct diagnosis *d, const struct hypothesis *h, const struct hypothesis *best)
{
    const double scale = misfit_scale(d);
    return criterion(h, scale) <= criterion(best, scale) + rival_fall;
}

static int catalogue_parameters(const struct hypothesis *h)
{
    int n = 0;
    for (size_t i = 0; i < h->n_effects; i++)
        n += h->effects[i]->n_parameters;
    return n;
}

/*
 * A special case of the larger effects that does as well: a damper for a spring without stiffness. Parameters are counted as the
 * catalogue has them: a place that the search has pushed to the free end is no longer an unknown of the fit.
 */
static bool simpler_case(const struct diagnosis *d, const struct hypothesis *large, const struct hypothesis *small)
{
    const double scale = misfit_scale(d);
    return small->explains && catalogue_parameters(small) < catalogue_parameters(large) &&
           same_family(d, large, small) && criterion(small, scale) <= criterion(large, scale) + margin_of(large);
}

static void swap(struct diagnosis *d, size_t i)
{
    const struct hypothesis chosen = d->hypotheses[i];
    memmove(&d->hypotheses[1], &d->hypotheses[0], i * sizeof chosen);
    d->hypotheses[0] = chosen;
}

/* The lowest criterion, unless a simpler one explains as much. */
static void choose_best(struct diagnosis *d)
{
    for (size_t i = 1; i < d->n_hypotheses; i++)
        if (not_worth(&d->hypotheses[0], &d->hypotheses[i]) || simpler_case(d, &d->hypotheses[0], &d->hypotheses[i])) {
            swap(d, i);
            i = 0;
        }
}

static void find_rivals(struct diagnosis *d)
{
    const struct hypothesis *best = &d->hypotheses[0];
    const double scale = misfit_scale(d), limit = criterion(best, scale) + margin_of(best);
    for (size_t i = 1; i < d->n_hypotheses; i++) {
        struct hypothesis *h = &d->hypotheses[i];
        if (h->n_effects > best->n_effects || contains(h, best) || !significant(d, h) || same_family(d, h, best))
            continue;
        /* the held-out records may separate what the fitted ones do not */
        const bool refuted = h->check.noise_ratio > refuted_by_check * best->check.noise_ratio;
        h->rival = criterion(h, scale) <= limit && !refuted;
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

bool diagnose_more_wanted(const struct diagnosis *d)
{
    static const double wanted_fitted = 1.03, wanted_check = 1.08;
    const struct hypothesis *best = &d->hypotheses[0];
    if (d->n_hypotheses == 0)
        return false;
    if (hypothesis_has_law(best))
        return !best->explains || best->fitted.noise_ratio > noise_fitted; /* a law's own error leaves a few per cent */
    return best->fitted.noise_ratio > fmin(wanted_fitted, fitted_limit(d, best)) ||
           best->check.noise_ratio > wanted_check;
}

void diagnose_decide(struct diagnosis *d)
{
    d->n_named = 0;
    d->unconfirmed = false;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        d->hypotheses[i].rival = false;
    d->verdict = VERDICT_UNKNOWN;
    if (!diagnose_computed(d))
        return;
    choose_best(d);
    const struct hypothesis *best = d->n_hypotheses > 0 ? &d->hypotheses[0] : NULL;
    if (d->interrupted)
        return;
    if (best == NULL || !significant(d, best)) {
        const bool fine =
            d->baseline.fitted.noise_ratio <= complete_ratio ||
            (d->baseline.fitted.noise_ratio <= noise_fitted && d->baseline.check.noise_ratio <= noise_check);
        d->verdict = fine ? VERDICT_COMPLETE : VERDICT_UNKNOWN;
        return;
    }
    d->unconfirmed = best->explains && best->n_effects > 1 && best->check.n_channels == 0;
    if (!best->explains || d->unconfirmed)
        return;
    find_rivals(d);
    d->verdict = VERDICT_MISSING;
    name(d, best);
    for (size_t i = 1; i < d->n_hypotheses; i++) {
        if (!d->hypotheses[i].rival)
            continue;
        d->verdict = VERDICT_AMBIGUOUS;
        name(d, &d->hypotheses[i]);
    }
}
