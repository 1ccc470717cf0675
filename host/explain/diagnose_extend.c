/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * One more effect on a hypothesis, in two stages. When records of different level show a nonlinear beam, nonlinear effects are
 * tried first and linear ones only when none of those explains it; otherwise linear effects come first.
 */
#include "diagnose_relatives.h"
#include "diagnose_shortlist.h"

#include <math.h>
#include <stdlib.h>

#include "ground/ground.h"

/* Rms in units of the noise of the best that is known for this number of effects. */
static double best_left(const struct shortlist *s)
{
    double best = fmin(s->from->fitted.noise_ratio, diagnose_best_left(s->w->d, s->n_effects));
    for (int kind = 0; kind < KIND_LAW; kind++)
        if (s->n_order[kind] > 0)
            best = fmin(best, shortlist_left(s, s->order[kind][0]));
    if (s->n_trials > 0)
        best = fmin(best, s->trials[0].unexplained);
    return fmax(best, 1.0);
}

/* A linear effect takes a misfit far above the noise down to it: nonlinear drives and sensors need not be tried. */
static bool linear_does(const struct shortlist *s)
{
    return diagnose_is_far(&s->w->d->baseline) && s->n_order[KIND_LINEAR] > 0 &&
           shortlist_left(s, s->order[KIND_LINEAR][0]) <= diagnose_at_noise;
}

static enum bf_status look_at(struct shortlist *s, enum effect_kind kind, struct bf_error *err)
{
    if (kind == KIND_LAW)
        return shortlist_try_laws(s, err);
    return kind == KIND_NONLINEAR_CHAIN && (s->linear || linear_does(s)) ? BF_OK : shortlist_refine(s, kind, err);
}

/*
 * Far from the noise the fitted baseline may stand where no effect explains it, and its scores are of the first order only: the linear
 * candidates are first refitted from the model as given, which costs less than to refine their scores.
 */
static bool given_is_wanted(const struct shortlist *s)
{
    const struct diagnosis *d = s->w->d;
    return s->from->n_effects == 0 && !s->w->options->everything && diagnose_is_far(&d->baseline);
}

/*
 * The baseline leaves so much of the signal that its modes may not be the beam's: what it lacks has driven it somewhere. Where it leaves less, refits from it
 * and from the model as given end in the same place, and the first order tells which are worth it.
 */
static bool is_driven(const struct diagnosis *d)
{
    return !(d->baseline.fitted.nrmse < search_limits.tenth);
}

/* Scores, trials and refits of the kinds. */
static enum bf_status stage(struct shortlist *s, const enum effect_kind kinds[], size_t n_kinds, const size_t most[],
                            double span, struct bf_error *err)
{
    struct refit_job *jobs = NULL;
    size_t n = 0;
    enum bf_status status = BF_OK;
    const bool everything = s->w->options->everything;
    for (size_t k = 0; k < n_kinds && !everything && !status; k++)
        status = look_at(s, kinds[k], err);
    const double best = best_left(s);
    for (size_t k = 0; k < n_kinds && !status; k++)
        if (kinds[k] == KIND_LAW && !everything)
            shortlist_choose_laws(s, most[kinds[k]], best, &jobs, &n);
        else
            shortlist_choose(s, kinds[k], most[kinds[k]], best, &jobs, &n);
    if (!status)
        diagnose_refits(s->w, jobs, n, span);
    free(jobs);
    diagnose_rank(s->w->d, s->w->n_tried);
    return status;
}

/* Refits the law with the best trial, whatever that leaves: nothing else explains a nonlinear beam. */
static void refit_best_law(struct shortlist *s)
{
    struct refit_job *jobs = NULL;
    size_t n = 0;
    s->best_law_tried = true;
    shortlist_choose_last(s, best_left(s), &jobs, &n);
    if (n > 0)
        diagnose_refits(s->w, jobs, n, 0.0);
    free(jobs);
    diagnose_rank(s->w->d, s->w->n_tried);
}

/* By first-order score one more effect would take half of what is left above the noise. */
static enum bf_status is_promising(struct shortlist *s, bool *promising, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    const double rows = (double)s->from->fit.n_rows, left = s->from->fit.chi2_per_row * rows - rows;
    double taken = 0.0;
    for (enum effect_kind kind = KIND_LINEAR; kind <= KIND_NONLINEAR_CHAIN && !status; kind++) {
        status = shortlist_score(s, kind, err);
        if (!status && s->n_order[kind] > 0)
            taken = fmax(taken, s->scores[s->order[kind][0]].LM);
    }
    *promising = taken >= search_limits.half * left;
    return status;
}

/* What is left is little, and next to nothing of what was there: from far off no linear effect does that in a law's place. */
static bool leaves_next_to_nothing(const struct diagnosis *d, const struct hypothesis *from, size_t n_effects)
{
    const double left = diagnose_best_left(d, n_effects), before = from->fitted.noise_ratio;
    return left <= search_limits.more && left * left - 1.0 <= search_limits.hundredth * (before * before - 1.0);
}

/* The least that a law, a drive or a sensor that bends leaves, rms in units of the noise. */
static double bent_left(const struct diagnosis *d, size_t n_effects)
{
    double least = HUGE_VAL;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (h->n_effects == n_effects && !effect_is_linear(h->effects[n_effects - 1]))
            least = fmin(least, h->fitted.noise_ratio);
    }
    return least;
}

/* What is clearly less than the rms of a free linear model: the fit of that model may have ended above its least, the sooner where no other level shows that the beam is not linear. */
static double below_linear(const struct diagnosis *d)
{
    return d->attainable.modes == 0
               ? 0.0
               : (d->linearity.verdict == LINEARITY_NONLINEAR ? 1.0 - search_limits.fifth : search_limits.half) *
                     diagnose_floor(d);
}

/* A nonlinear effect leaves clearly less than the best linear model without any physics does: no linear effect alone outdoes that. */
static bool linear_is_out(const struct diagnosis *d, size_t n_effects)
{
    return !diagnose_levels_agree(d) && bent_left(d, n_effects) <= below_linear(d);
}

/* Along the measured motion one law leaves next to nothing of the misfit: its refit decides before drives and sensors are looked at. */
static bool law_stands_out(const struct shortlist *s)
{
    const double before = s->from->fitted.noise_ratio;
    if (s->n_trials == 0 || s->w->options->everything || !diagnose_is_far(s->from))
        return false; /* near the noise one kind imitates the other */
    const double left = s->trials[0].unexplained;
    return left * left - 1.0 <= search_limits.hundredth * (before * before - 1.0);
}

/* Laws, and nonlinear drives and sensors where no law does alone. */
static enum bf_status laws_and_chain(struct shortlist *s, const enum effect_kind kinds[], const size_t most[],
                                     double span, struct bf_error *err)
{
    struct diagnose_state *w = s->w;
    enum bf_status status = w->options->everything ? BF_OK : shortlist_try_laws(s, err);
    if (!status && law_stands_out(s)) {
        status = stage(s, kinds, 1, most, 0.5 * span, err);
        if (!status && !progress_interrupted())
            status = diagnose_steps(w, err);
    }
    if (status || progress_interrupted() || diagnose_explained(w->d, s->n_effects))
        return status;
    status = stage(s, kinds, 2, most, 0.5 * span, err);
    return status || progress_interrupted() ? status : diagnose_steps(w, err);
}

/* Nothing explains the records, though they are far from the noise: the values of the fitted baseline may be what is in the way. */
static bool still_wanted(const struct shortlist *s)
{
    return given_is_wanted(s) && !diagnose_far_ahead(s->w->d, s->n_effects) && !progress_interrupted();
}

/*
 * No two records tell whether the beam is linear, and no free linear model takes them to the noise: a law that along the measured motion leaves next to nothing, and
 * clearly less than that model, is refitted before the linear effects, which take some fifty refits from the model as given.
 */
static enum bf_status law_before_linear(struct shortlist *s, const enum effect_kind law[], const size_t most[],
                                        double span, struct bf_error *err)
{
    const struct diagnosis *d = s->w->d;
    const bool may_be_a_law = given_is_wanted(s) && !diagnose_levels_agree(d) && below_linear(d) > 1.0;
    if (!may_be_a_law || diagnose_explained(d, s->n_effects))
        return BF_OK;
    enum bf_status status = shortlist_try_laws(s, err);
    if (status || !law_stands_out(s) || !(s->trials[0].unexplained <= below_linear(d)))
        return status;
    status = stage(s, law, 1, most, span, err);
    return status || progress_interrupted() ? status : diagnose_steps(s->w, err);
}

/* Linear effects, and drives and sensors that bend: with them, or, where records of different level agree, after them if none explains the records. */
static enum bf_status linear_and_chain(struct shortlist *s, const enum effect_kind kinds[], const size_t most[],
                                       double span, struct bf_error *err)
{
    const struct diagnosis *d = s->w->d;
    const bool agree = d->linearity.verdict == LINEARITY_LINEAR && !s->w->options->everything;
    enum bf_status status = stage(s, kinds, agree ? 1 : 2, most, span, err);
    if (!status && agree && !diagnose_explained(d, s->n_effects) && !progress_interrupted())
        status = stage(s, kinds + 1, 1, most, 0.0, err);
    return status;
}

/* The first of the two stages where linear effects come first. */
static enum bf_status linear_kinds(struct shortlist *s, const enum effect_kind kinds[], const size_t most[],
                                   double span, struct bf_error *err)
{
    struct diagnose_state *w = s->w;
    enum bf_status status = law_before_linear(s, kinds + 2, most, span, err);
    if (status || progress_interrupted() || (given_is_wanted(s) && linear_is_out(w->d, s->n_effects)))
        return status;
    status = given_is_wanted(s) && is_driven(w->d) ? shortlist_from_given(s, span, err) : BF_OK;
    const bool has_ended = diagnose_is_far(&w->d->baseline) && diagnose_far_ahead(w->d, s->n_effects);
    if (!status && !has_ended && !progress_interrupted())
        status = linear_and_chain(s, kinds, most, span, err);
    if (!status && has_ended && s->from->n_effects == 0 && !progress_interrupted())
        status = shortlist_mates(s, err);
    return status;
}

/* The same where the records show a nonlinear beam. */
static enum bf_status nonlinear_kinds(struct shortlist *s, const enum effect_kind kinds[], const size_t most[],
                                      double span, struct bf_error *err)
{
    struct diagnose_state *w = s->w;
    enum bf_status status = BF_OK;
    if (!(diagnose_is_far(&w->d->baseline) && diagnose_explained(w->d, s->n_effects)))
        status = laws_and_chain(s, kinds, most, span, err);
    if (!status && still_wanted(s) &&
        diagnose_linear_is_out(w->d)) /* linear effects, which cannot be the cause, take some fifty refits */
        refit_best_law(s);
    if (status || !still_wanted(s) || linear_is_out(w->d, s->n_effects))
        return status;
    return is_driven(w->d) ? shortlist_from_given(s, span, err) : BF_OK;
}

/*
 * Records of different level have told whether the beam is linear, and an effect of that kind explains them: no effect of the other kind is the cause. A law of degree one
 * is linear by this test, so that a linear effect must be sure enough to be named before such laws are left out.
 */
static bool levels_have_told(struct diagnosis *d, size_t n_effects)
{
    if (!diagnose_explained(d, n_effects) || d->hypotheses[0].n_effects != n_effects)
        return false;
    if (!effect_is_linear(d->hypotheses[0].effects[n_effects - 1]))
        return d->linearity.verdict == LINEARITY_NONLINEAR;
    diagnose_decide(d);
    return d->linearity.verdict == LINEARITY_LINEAR && d->verdict == VERDICT_MISSING;
}

/* What the first stage has left to the second: laws, or linear effects where laws came first. */
static enum bf_status others(struct shortlist *s, const enum effect_kind kinds[], const size_t most[], double span,
                             struct bf_error *err)
{
    struct diagnose_state *w = s->w;
    struct diagnosis *d = w->d;
    const bool nonlinear = kinds[0] == KIND_LAW, everything = w->options->everything,
               explained = diagnose_explained(d, s->n_effects);
    enum bf_status status = BF_OK;
    /* with modes to spare a free linear model follows a law in records of one level: it tells a linear cause only where one comes near it */
    if (!diagnose_levels_agree(d) && !explained && !diagnose_no_linear_outdoes(d))
        s->linear = false;
    s->linear = s->linear || (explained && !everything && d->linearity.verdict == LINEARITY_LINEAR);
    /* a law is found as the first or the second of three, and beside another effect only where something is not linear */
    const bool passes_for_linear =
        s->from->n_effects == 1 && diagnose_is_far(&d->baseline) && diagnose_passes_for_linear(d);
    const bool little_left = diagnose_far_ahead(d, s->n_effects) || leaves_next_to_nothing(d, s->from, s->n_effects) ||
                             (s->n_effects == 1 && diagnose_no_linear_outdoes(d));
    /* what an answer leaves of a beam that is linear at every level, and one more linear effect takes, asks for no law */
    const bool answered = w->answered && d->linearity.verdict == LINEARITY_LINEAR &&
                          diagnose_best_left(d, s->n_effects) <= diagnose_at_noise;
    const bool enough = (diagnose_is_far(s->from) && little_left) || s->from->n_effects >= 2 || passes_for_linear ||
                        answered || levels_have_told(d, s->n_effects);
    if (!enough || everything)
        status = stage(s, kinds + 2, 1, most, span, err);
    if (!status && s->n_effects == 1 && !progress_interrupted())
        status = diagnose_law_places(w, 0.0, err);
    if (!status && nonlinear && !s->best_law_tried && !everything && !progress_interrupted() &&
        !diagnose_explained(d, s->n_effects))
        refit_best_law(s);
    return status;
}

enum bf_status diagnose_extend(struct diagnose_state *w, const struct hypothesis *from, const size_t most[],
                               double span, struct bf_error *err)
{
    static const enum effect_kind nonlinear_first[] = {KIND_LAW, KIND_NONLINEAR_CHAIN, KIND_LINEAR},
                                  linear_first[] = {KIND_LINEAR, KIND_NONLINEAR_CHAIN, KIND_LAW};
    const bool nonlinear = from->n_effects == 0 && w->d->linearity.verdict == LINEARITY_NONLINEAR;
    const enum effect_kind *kinds = nonlinear ? nonlinear_first : linear_first;
    struct shortlist *s;
    bool worth_it = true;
    enum bf_status status = shortlist_new(w, from, &s, err);
    if (!status && !nonlinear && given_is_wanted(s))
        status = diagnose_by_modes(w, &s->list, err);
    const bool third = from->n_effects > 1 && !w->options->everything;
    if (!status && (third || (w->answered && from->n_effects > 0)))
        status = is_promising(s, &worth_it, err);
    if (!status && worth_it)
        status = (nonlinear ? nonlinear_kinds : linear_kinds)(s, kinds, most, 0.3 * span, err);
    if (!status && worth_it && !progress_interrupted())
        status = others(s, kinds, most, 0.4 * span, err);
    shortlist_free(s);
    return status;
}
