/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The second road to single effects: from the model as given (diagnose_given.c). A baseline that lacks an effect is driven to values that stand in for it,
 * and a refit that starts there may never leave them. What was believed before any fit has not been driven anywhere: the
 * effect is added to that, its place scanned, and everything is fitted from short windows to whole records.
 */
#include "diagnose_relatives.h"
#include "diagnose_road.h"
#include "diagnose_shortlist.h"
#include "plausible.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* Candidates at most, and how many refits before it is asked whether one has explained the records. */
enum { MOST_GIVEN = 32, MOST_AT_ONCE = 8 };

static bool is_in(const size_t order[], size_t n, size_t i)
{
    for (size_t k = 0; k < n; k++)
        if (order[k] == i)
            return true;
    return false;
}

/*
 * The beam's own effects by score, then those of them that the scores at the fitted baseline think nothing of, then the measurement's
 * likewise: order[list.n].
 */
static size_t order_from_given(const struct shortlist *s, size_t order[])
{
    const size_t *ranked = s->order[KIND_LINEAR], n_ranked = s->n_order[KIND_LINEAR];
    size_t n = 0;
    for (int structural = 1; structural >= 0; structural--) {
        for (size_t k = 0; k < n_ranked; k++)
            if (road_is_structural(s->list.candidates[ranked[k]].effect) == (structural == 1))
                order[n++] = ranked[k];
        for (size_t i = 0; i < s->list.n; i++) {
            const struct beam_effect *effect = s->list.candidates[i].effect;
            if (effect_kind(effect) == KIND_LINEAR && road_is_structural(effect) == (structural == 1) &&
                !is_in(order, n, i))
                order[n++] = i;
        }
    }
    return n;
}

/* Those of roads[n ≤ MOST_AT_ONCE] that are not done; a candidate that the model refuses is. most_runs 0: as many as it takes. */
static void refit_roads(struct shortlist *s, const struct model *from, struct road roads[], size_t n, size_t most_runs,
                        double span)
{
    struct refit_job jobs[MOST_AT_ONCE];
    struct road *taken[MOST_AT_ONCE];
    struct bf_error ignored;
    size_t n_jobs = 0;
    for (size_t k = 0; k < n; k++) {
        struct refit_job *job = &jobs[n_jobs];
        if (roads[k].done)
            continue;
        *job = (struct refit_job){.n_effects = s->n_effects,
                                  .n_tried = s->w->n_tried,
                                  .first_new = from->n_effects,
                                  .most_runs = most_runs,
                                  .along = roads[k].along};
        roads[k].done = candidate_model(from, roads[k].candidate, roads[k].start, &job->model, &ignored) != BF_OK;
        if (roads[k].done)
            continue;
        if (roads[k].own > 0)
            job->model.effects[job->model.n_effects - 1].by_record[roads[k].own - 1] = true;
        taken[n_jobs++] = &roads[k];
    }
    (void)diagnose_try(s->w, jobs, n_jobs, BF_OK, span);
    for (size_t i = 0; i < n_jobs; i++)
        taken[i]->done = !jobs[i].unfinished, taken[i]->left = jobs[i].left;
}

/* What a quick look has brought farthest comes first, so that a cause stands beside its nearest rivals; the order of equals stays. */
static void sort_by_left(struct road roads[], size_t n)
{
    for (size_t i = 1; i < n; i++) {
        const struct road road = roads[i];
        size_t k = i;
        for (; k > 0 && roads[k - 1].left > road.left; k--)
            roads[k] = roads[k - 1];
        roads[k] = road;
    }
}

/*
 * Sorted: starts of one effect that a quick look has brought to the same misfit are on one way down, and the first goes on; so are its channels, of which none does
 * anything then. What is still where the model without it was has not set out yet.
 */
static void leave_the_same(const struct diagnosis *d, struct road roads[], size_t n)
{
    const double begin = d->baseline.fit.chi2_per_row;
    for (size_t k = 1; k < n; k++) {
        const struct road *road = &roads[k];
        bool known = false;
        for (size_t i = 0; i < k; i++)
            known = known ||
                    (!roads[i].done && roads[i].candidate->effect == road->candidate->effect &&
                     roads[i].own == road->own && road->left - roads[i].left <= search_limits.thousandth * road->left);
        roads[k].done = road->done || (known && fabs(road->left - begin) > search_limits.hundredth * begin);
    }
}

/*
 * The best leaves the noise, or what a free linear model does: no other linear effect outdoes it, and one that does as well is its like. A free linear model
 * that leaves more has not found what there is to find, and is no floor.
 */
static bool is_at_floor(const struct diagnosis *d)
{
    if (d->n_hypotheses == 0 || d->attainable.modes == 0 || is_stand_in(&d->hypotheses[0]))
        return false;
    const double left = d->hypotheses[0].fitted.noise_ratio, floor = diagnose_floor(d);
    return left <= search_limits.mate * floor && (left <= search_limits.mate || floor <= search_limits.mate * left);
}

bool diagnose_no_linear_outdoes(const struct diagnosis *d)
{
    const struct hypothesis *best = d->n_hypotheses > 0 ? &d->hypotheses[0] : NULL;
    return best != NULL && d->attainable.modes > 0 && d->linearity.verdict != LINEARITY_NONLINEAR &&
           !is_stand_in(best) && effect_is_linear(best->effects[0]) && best->explained >= search_limits.half &&
           best->fitted.noise_ratio <= search_limits.same * diagnose_floor(d) &&
           (best->check.n_channels == 0 || isnan(d->attainable.held_out_noise_ratio) ||
            diagnose_predicts_as_linear(d, best));
}

/* What a quick look has brought far below the model without it, and below all that has come to its end, goes on before others are looked at. */
static void finish_leader(struct shortlist *s, const struct model *from, struct road roads[], size_t n)
{
    const struct diagnosis *d = s->w->d;
    const double best = diagnose_best_left(d, s->n_effects);
    struct road *leader = NULL;
    for (size_t k = 0; k < n; k++)
        if (!roads[k].done && (leader == NULL || roads[k].left < leader->left))
            leader = &roads[k];
    if (leader != NULL && leader->left <= search_limits.half * d->baseline.fit.chi2_per_row &&
        leader->left < best * best && !progress_interrupted())
        refit_roads(s, from, leader, 1, 0, 0.0);
}

/*
 * Quickly, and the one that leads to its end; where one explains the records, and could be outdone, the others are refitted to their ends, which come early for
 * what leaves much more.
 */
static bool refit_briefly_first(struct shortlist *s, const struct model *from, struct road roads[], size_t n,
                                double span)
{
    refit_roads(s, from, roads, n, QUICK_RUNS, span);
    if (!diagnose_explained(s->w->d, s->n_effects))
        finish_leader(s, from, roads, n);
    const bool explained = diagnose_explained(s->w->d, s->n_effects);
    if (explained && !is_at_floor(s->w->d) && !progress_interrupted())
        refit_roads(s, from, roads, n, 0, 0.0);
    return explained;
}

/* What is far ahead is not asked again from other starts. */
static void leave_other_starts(const struct diagnosis *d, size_t n_effects, struct road roads[], size_t n)
{
    const bool far_ahead = diagnose_nearly_there(d, n_effects);
    for (size_t k = 0; k < n; k++)
        roads[k].done = roads[k].done || (far_ahead && !roads[k].usual);
}

/* Of the misfit's power, by first order, which for an effect that moves no mode holds at any size. */
static double promise(const struct shortlist *s, const struct road *road)
{
    double freedom;
    return s->scores[road->candidate - s->list.candidates].LM / score_base_misfit(s->base, &freedom);
}

/* What would change a channel and promises next to nothing from the fitted baseline, beside an answer little, is not asked again. */
static void leave_unpromising(const struct shortlist *s, struct road roads[], size_t n)
{
    const double least = diagnose_has_answer(s->w->d, s->n_effects) ? search_limits.tenth : search_limits.hundredth;
    for (size_t k = 0; k < n; k++)
        roads[k].done =
            roads[k].done || (!road_is_structural(roads[k].candidate->effect) && promise(s, &roads[k]) < least);
}

/* Quickly, the usual starts first. Returns whether one explains the records. */
static bool look_at_all(struct shortlist *s, const struct model *from, struct road roads[], size_t n, double part)
{
    bool explained = false;
    for (size_t k = 0; k < n && !explained && !progress_interrupted(); k += MOST_AT_ONCE) {
        const size_t some = n - k < MOST_AT_ONCE ? n - k : MOST_AT_ONCE;
        leave_other_starts(s->w->d, s->n_effects, roads + k, some);
        leave_unpromising(s, roads + k, some);
        explained = refit_briefly_first(s, from, roads + k, some, part);
    }
    return explained;
}

/* Far behind the best, or beside an answer, no more than its nearest rivals are asked for, each from its best start. Returns how many are left. */
static size_t leave_far_behind(const struct shortlist *s, struct road roads[], size_t n)
{
    const bool far_ahead = diagnose_nearly_there(s->w->d, s->n_effects) || diagnose_has_answer(s->w->d, s->n_effects);
    size_t wanted = 0;
    for (size_t k = 0; k < n; k++) {
        bool known = far_ahead && diagnose_has_ended(s->w->d, roads[k].candidate->effect);
        for (size_t i = 0; i < k && far_ahead; i++)
            known = known || (!roads[i].done && roads[i].candidate->effect == roads[k].candidate->effect);
        roads[k].done = roads[k].done || known || (far_ahead && wanted == SEARCH_RIVALS);
        wanted += !roads[k].done;
    }
    return wanted;
}

/* An effect of the measurement moves no mode: what a quick look has not brought below the baseline, the road from that decides. */
static void leave_to_the_other_road(const struct diagnosis *d, struct road roads[], size_t n)
{
    for (size_t k = 0; k < n; k++)
        roads[k].done = roads[k].done || (!road_is_structural(roads[k].candidate->effect) &&
                                          roads[k].left > d->baseline.fit.chi2_per_row);
}

/* What a quick look has left far above the best is given up, as the rest of its refit would be. */
static void leave_out_of_reach(const struct shortlist *s, struct road roads[], size_t n)
{
    const double most = diagnose_out_of_reach(s->w->d, s->n_effects);
    for (size_t k = 0; k < n; k++)
        roads[k].done = roads[k].done || (most > 0.0 && roads[k].left > most);
}

/* Those that were left unfinished, the nearest first, until one explains the records. */
static void bring_to_the_end(struct shortlist *s, const struct model *from, struct road roads[], size_t n, double part)
{
    sort_by_left(roads, n);
    leave_the_same(s->w->d, roads, n);
    leave_to_the_other_road(s->w->d, roads, n);
    leave_out_of_reach(s, roads, n);
    for (size_t k = 0; k < n && !progress_interrupted() && !diagnose_explained(s->w->d, s->n_effects);
         k += MOST_AT_ONCE) {
        if (leave_far_behind(s, roads + k, n - k) == 0)
            break;
        refit_roads(s, from, roads + k, n - k < MOST_AT_ONCE ? n - k : MOST_AT_ONCE, 0, part);
    }
}

/* All of them quickly; then, unless one explains the records or cannot be outdone by any linear effect, to their ends. */
static void refit_in_turn(struct shortlist *s, const struct model *from, struct road roads[], size_t n, double span)
{
    const double part = 0.5 * span * MOST_AT_ONCE / (double)(n + 1);
    if (!look_at_all(s, from, roads, n, part) && !diagnose_no_linear_outdoes(s->w->d))
        bring_to_the_end(s, from, roads, n, part);
}

/* Where the modes have told, the beam's own effects that come near them have been refitted from there, and no other will do; where they clear the beam, none will. */
static void leave_known_by_modes(const struct diagnose_state *w, struct road roads[], size_t n)
{
    for (size_t k = 0; k < n; k++)
        roads[k].done = roads[k].done || diagnose_modes_rule_out(w, roads[k].candidate->effect) ||
                        diagnose_modes_have_refitted(w, roads[k].candidate->effect);
}

enum bf_status shortlist_from_given(struct shortlist *s, double span, struct bf_error *err)
{
    struct model given;
    if (diagnose_explained(s->w->d, s->n_effects) || diagnose_no_linear_outdoes(s->w->d))
        return BF_OK;
    enum bf_status status = shortlist_score(s, KIND_LINEAR, err);
    if (!status)
        status = diagnose_as_given(s->w->d->model, &given, err);
    if (status)
        return status;
    size_t *order = bf_alloc(s->list.n + 1, sizeof *order);
    const size_t all = order_from_given(s, order), n = all < MOST_GIVEN ? all : MOST_GIVEN;
    struct road *roads = bf_alloc(ROADS * n + 1, sizeof *roads);
    const size_t n_roads = roads_lay(s->list.candidates, &given, order, n, true, roads);
    leave_known_by_modes(s->w, roads, n_roads);
    refit_in_turn(s, &given, roads, n_roads, span);
    free(order), free(roads);
    model_free(&given);
    return BF_OK;
}

/* Sorted: of the first few effects the two nearest roads each stay to be done. */
static void leave_few(struct road roads[], size_t n)
{
    size_t n_effects = 0;
    for (size_t k = 0; k < n; k++) {
        size_t before = 0;
        for (size_t i = 0; i < k; i++)
            before += !roads[i].done && roads[i].candidate->effect == roads[k].candidate->effect;
        roads[k].done = roads[k].done || before == SEARCH_LEADERS || (before == 0 && n_effects == SEARCH_RIVALS);
        n_effects += !roads[k].done && before == 0;
    }
}

static void refit_all(struct shortlist *s, const struct model *from, struct road roads[], size_t n, size_t most_runs)
{
    for (size_t k = 0; k < n && !progress_interrupted(); k += MOST_AT_ONCE)
        refit_roads(s, from, roads + k, n - k < MOST_AT_ONCE ? n - k : MOST_AT_ONCE, most_runs, 0.0);
}

enum bf_status shortlist_by_record(struct shortlist *s, struct bf_error *err)
{
    struct model given;
    const enum bf_status status = diagnose_as_given(s->w->d->model, &given, err);
    if (status)
        return status;
    struct road *roads = bf_alloc(2 * ROADS * s->list.n + 1, sizeof *roads);
    size_t n = 0;
    for (size_t i = 0; i < s->list.n; i++)
        if (diagnose_can_be_changed(s->list.candidates[i].effect, &given))
            n += roads_lay_own(&given, &s->list.candidates[i], &roads[n]);
    refit_all(s, &given, roads, n, OWN_RUNS);
    sort_by_left(roads, n);
    leave_few(roads, n);
    refit_all(s, &given, roads, n, 0);
    free(roads);
    model_free(&given);
    return BF_OK;
}

/* By first order, which is exact for what adds to the channels, it takes nearly all of the misfit. */
static bool takes_nearly_all(const struct shortlist *s, size_t candidate)
{
    double freedom;
    return s->scores[candidate].LM >= search_limits.nearly_all * score_base_misfit(s->base, &freedom);
}

/* order[n] of the first look: the best scores; a signal that no input caused is among them where the records show one, or it takes nearly all. Returns n. */
static size_t order_first(const struct shortlist *s, size_t order[])
{
    const bool linear = s->w->d->linearity.verdict == LINEARITY_LINEAR;
    size_t n = 0;
    for (size_t k = 0; k < s->n_order[KIND_LINEAR] && n < SEARCH_RIVALS; k++) {
        const size_t candidate = s->order[KIND_LINEAR][k];
        const struct beam_effect *effect = s->list.candidates[candidate].effect;
        if (!linear || (effect->signal == NULL && effect->base == NULL) || takes_nearly_all(s, candidate))
            order[n++] = candidate;
    }
    return n;
}

enum bf_status diagnose_first_look(struct diagnose_state *w, struct bf_error *err)
{
    struct shortlist *s;
    enum bf_status status = shortlist_new(w, &w->d->baseline, &s, err);
    if (!status)
        status = diagnose_by_modes(w, &s->list, err);
    const bool told = diagnose_modes_have_told_all(w);
    if (!status && !told)
        status = shortlist_score(s, KIND_LINEAR, err);
    if (!status && !told) {
        struct road roads[ROADS * SEARCH_RIVALS];
        size_t order[SEARCH_RIVALS];
        const size_t n = order_first(s, order);
        (void)refit_briefly_first(s, &w->d->baseline.model, roads,
                                  roads_lay(s->list.candidates, &w->d->baseline.model, order, n, false, roads), 0.0);
    }
    w->looked = s;
    return status;
}
