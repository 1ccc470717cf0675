/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The road by way of the modes: a free linear model has told poles and residues of the records, and each of the beam's own effects is fitted to those first, from the
 * model as given (refit_to_modes()). That takes milliseconds, has no wrong cycle to lock in, and leaves much where an effect cannot make the modes what they are. What
 * comes nearest is refitted to the records from there.
 */
#include "diagnose_modal.h"
#include "diagnose_relatives.h"
#include "diagnose_resonator.h"
#include "diagnose_road.h"
#include "diagnose_shortlist.h"
#include "plausible.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

enum { PLACES = 8 }; /* along the span */

/* The model's misfit to the modes from where it stands; infinite where it has no value. */
static void fit_start(const struct modal_road *road, bool rough, double sharpness, struct modal_start *start)
{
    const struct modal_options options = {.predict = *road->w->predict, .rough = rough, .sharpness = sharpness};
    struct bf_error ignored;
    if (refit_to_modes(&start->model, &road->modes, &options, &start->left, &ignored) != BF_OK ||
        !isfinite(start->left))
        start->left = HUGE_VAL;
}

static int by_left(const void *a, const void *b)
{
    const double x = ((const struct modal_start *)a)->left, y = ((const struct modal_start *)b)->left;
    return (x > y) - (x < y);
}

/* Starts of one candidate on a model, ranked by a few steps: starts[ROADS · PLACES]. Returns how many. */
static size_t rank_starts(const struct modal_road *road, const struct model *from, const struct candidate *candidate,
                          struct modal_start starts[])
{
    const int place = effect_slot(candidate->effect, BEAM_ROLE_PLACE);
    struct road roads[ROADS];
    struct bf_error ignored;
    size_t n = 0;
    const size_t n_roads = roads_lay_all(from, candidate, roads);
    for (size_t r = 0; r < n_roads; r++)
        for (int k = 1; k <= (place < 0 ? 1 : PLACES); k++) {
            struct modal_start *start = &starts[n];
            *start = (struct modal_start){.effect = candidate->effect};
            if (place >= 0)
                roads[r].start[place] = fmin(from->length_m * k / PLACES, candidate->upper[place]);
            if (candidate_model(from, candidate, roads[r].start, &start->model, &ignored) != BF_OK)
                continue;
            fit_start(road, true, 1.0, start);
            n++;
        }
    qsort(starts, n, sizeof *starts, by_left);
    return n;
}

/* The best two of ranked starts to their ends; takes all. */
static void fit_best(struct modal_road *road, struct modal_start starts[], size_t n)
{
    for (size_t k = 0; k < n; k++) {
        if (k < SEARCH_LEADERS && isfinite(starts[k].left))
            fit_start(road, false, 1.0, &starts[k]);
        if (k < SEARCH_LEADERS && isfinite(starts[k].left)) {
            road->starts = bf_grow(road->starts, road->n + 1, sizeof *road->starts);
            road->starts[road->n++] = starts[k];
        } else {
            modal_start_free(&starts[k]);
        }
    }
}

static void fit_candidate(struct modal_road *road, const struct model *from, const struct candidate *candidate)
{
    struct modal_start starts[ROADS * PLACES] = {{0}};
    const size_t n = rank_starts(road, from, candidate, starts);
    fit_best(road, starts, n);
}

/* What swings above the band is stiff there, or a mass: another effect, or another form of it, is that. */
static bool is_in_band(const struct modal_road *road, const struct modal_start *start)
{
    const struct model_effect *own = &start->model.effects[start->model.n_effects - 1];
    return own->parameters[effect_slot(own->effect, BEAM_ROLE_RESONANCE)].value < diagnose_band_Hz(road->w->d);
}

/* What swings by itself, at the frequency of each measured mode. */
static void fit_swinging(struct modal_road *road, const struct model *from, const struct beam_effect *effect)
{
    enum { FREQUENCIES = 8, ALONG = 4 };
    static const double part = 0.1; /* of the beam's mass or flexibility */
    struct modal_start starts[FREQUENCIES * ALONG] = {{0}};
    const size_t places = effect_slot(effect, BEAM_ROLE_PLACE) < 0 ? 1 : ALONG, before = road->n;
    size_t n = 0;
    for (size_t k = 0; k < road->modes.n && k < FREQUENCIES; k++)
        for (size_t a = 1; a <= places; a++) {
            const double at_m = model_last_place_m(from) * (double)a / (double)places;
            starts[n] = (struct modal_start){.effect = effect};
            if (!resonator_begin(from, effect, cabs(road->modes.pole[k]) / (2.0 * M_PI), at_m, part, &starts[n].model))
                continue;
            fit_start(road, true, 1.0, &starts[n++]);
        }
    qsort(starts, n, sizeof *starts, by_left);
    fit_best(road, starts, n);
    size_t kept = before;
    for (size_t k = before; k < road->n; k++) {
        if (is_in_band(road, &road->starts[k]))
            road->starts[kept++] = road->starts[k];
        else
            modal_start_free(&road->starts[k]);
    }
    road->n = kept;
}

/* It may differ from record to record, and all have the same modes. */
static bool is_of_record(const struct beam_effect *effect)
{
    bool any = false;
    for (int i = 0; i < effect->n_parameters; i++)
        any = any || effect->parameters[i].flags & BEAM_PARAMETER_PER_RECORD;
    return any;
}

/* One more effect on `from`, each of the list that the model does not have. */
static void fit_each(struct modal_road *road, const struct model *from, const struct candidate_list *list)
{
    for (size_t i = 0; i < list->n && !progress_interrupted(); i++) {
        const struct candidate *candidate = &list->candidates[i];
        if (road_is_structural(candidate->effect) && effect_kind(candidate->effect) == KIND_LINEAR &&
            !is_of_record(candidate->effect) && !model_has_effect(from, candidate->effect))
            fit_candidate(road, from, candidate);
    }
    for (int i = 0; i < beam_effects_count && resonator_may_be_there(road->w->d) && !progress_interrupted(); i++)
        if (resonator_can_act(road->w, beam_effects[i]))
            fit_swinging(road, from, beam_effects[i]);
}

/* Where several leave next to nothing of what the modes may be off by, they are held against each other, and against none, by a tenth and a hundredth of that. */
static void sharpen(struct modal_road *road)
{
    enum { MOST = 12 };
    if (road->n == 0)
        return;
    qsort(road->starts, road->n, sizeof *road->starts, by_left);
    for (double sharpness = 10.0; sharpness <= 100.0 && road->starts[0].left < 10.0 * modal_limits.nothing / sharpness;
         sharpness *= 10.0) {
        const double most = 10.0 * modal_limits.nothing / sharpness;
        for (size_t k = 0; k < road->n && k < MOST && road->starts[k].left < most; k++)
            fit_start(road, false, sharpness, &road->starts[k]);
        qsort(road->starts, road->n, sizeof *road->starts, by_left);
        if (road->alone.left < most)
            fit_start(road, false, sharpness, &road->alone);
    }
}

/* One more effect on the model, which is fitted to the modes, too; that with the least is what others are held against. */
static enum bf_status extend(struct modal_road *road, const struct model *from, const struct candidate_list *list,
                             struct bf_error *err)
{
    struct modal_start alone = {0};
    const enum bf_status status = model_copy(from, &alone.model, err);
    if (status)
        return status;
    fit_start(road, false, 1.0, &alone);
    if (isfinite(alone.left))
        fit_each(road, from, list);
    if (alone.left < road->alone.left) {
        modal_start_free(&road->alone);
        road->alone = alone;
    } else {
        modal_start_free(&alone);
    }
    return BF_OK;
}

/* ---- Refits from there ---- */

static bool same_effects(const struct model *one, const struct model *other)
{
    for (size_t e = 0; e < one->n_effects; e++)
        if (!model_has_effect(other, one->effects[e].effect))
            return false;
    return one->n_effects == other->n_effects;
}

static bool swings(const struct model *model)
{
    return effect_swings(&model->effects[model->n_effects - 1]);
}

/* The same effects at the same misfit have been taken. */
static bool is_taken(const struct modal_road *road, size_t k)
{
    for (size_t i = 0; i < k; i++)
        if (same_effects(&road->starts[i].model, &road->starts[k].model) &&
            swings(&road->starts[i].model) == swings(&road->starts[k].model) &&
            road->starts[k].left - road->starts[i].left <= modal_limits.same * road->alone.left)
            return true;
    return false;
}

/* starts[n ≤ SEARCH_FEW] to the records; most_runs 0: to their ends. unfinished[n], left[n] out: as of the jobs. */
static enum bf_status refit_starts(struct modal_road *road, struct modal_start *const starts[], size_t n,
                                   size_t most_runs, bool unfinished[], double left[], struct bf_error *err)
{
    struct diagnose_state *w = road->w;
    struct refit_job jobs[SEARCH_FEW];
    size_t begun = 0;
    enum bf_status status = BF_OK;
    while (begun < n && !status) {
        struct refit_job *job = &jobs[begun];
        *job = (struct refit_job){.n_effects = starts[begun]->model.n_effects - w->d->baseline.n_base,
                                  .n_tried = w->n_tried,
                                  .most_runs = most_runs,
                                  .places_tried = true};
        status = model_copy(&starts[begun]->model, &job->model, err);
        job->first_new = job->model.n_effects;
        starts[begun]->refitted = true;
        begun += !status;
    }
    status = diagnose_try(w, jobs, begun, status, 0.0);
    for (size_t k = 0; k < begun && !status; k++)
        unfinished[k] = jobs[k].unfinished, left[k] = jobs[k].left;
    return status;
}

/* The next of those that are near and were not refitted: briefly, and then to their ends those that leave little more than the best of them. */
static enum bf_status refit_nearest(struct modal_road *road, struct bf_error *err)
{
    struct modal_start *starts[SEARCH_FEW] = {NULL};
    bool unfinished[SEARCH_FEW] = {false};
    double left[SEARCH_FEW] = {0.0}, least = HUGE_VAL;
    size_t n = 0, more = 0;
    for (size_t k = 0; k < road->n && n < SEARCH_FEW && modal_is_near(road, &road->starts[k]); k++)
        if (!road->starts[k].refitted && !is_taken(road, k))
            starts[n++] = &road->starts[k];
    enum bf_status status = refit_starts(road, starts, n, QUICK_RUNS, unfinished, left, err);
    for (size_t k = 0; k < n && !status; k++)
        least = fmin(least, left[k]);
    for (size_t k = 0; k < n && !status; k++)
        if (unfinished[k] && left[k] <= search_limits.far * search_limits.far * least)
            starts[more++] = starts[k];
    if (!status && more > 0 && !progress_interrupted())
        status = refit_starts(road, starts, more, 0, unfinished, left, err);
    if (!status)
        resonators_judge(road->w);
    return status;
}

static struct modal_road road_of(struct diagnose_state *w)
{
    return (struct modal_road){.w = w,
                               .of = w->d->model,
                               .modes = measured_modes_of(&w->d->attainable, w->d->records, w->d->n_records),
                               .alone = {.left = HUGE_VAL}};
}

/* ---- The model without any effect ---- */

enum bf_status diagnose_baseline_by_modes(struct diagnose_state *w, struct bf_error *err)
{
    struct modal_road road = road_of(w);
    struct modal_start start = {0};
    enum bf_status status = BF_OK;
    bool lower = false;
    if (road.modes.n > 1 && w->d->baseline.fitted.noise_ratio > diagnose_at_noise) {
        status = diagnose_as_given(w->d->model, &start.model, err);
        if (!status)
            fit_start(&road, false, 1.0, &start);
        if (!status && isfinite(start.left))
            status = diagnose_also_from(w, &start.model, &lower, err);
        else
            modal_start_free(&start);
    }
    modal_road_free(&road);
    return !status && lower ? diagnose_numerics(w, err) : status;
}

/* ---- Single effects ---- */

static enum bf_status begin(struct diagnose_state *w, const struct model *given, const struct candidate_list *list,
                            struct bf_error *err)
{
    diagnose_modes_free(w);
    w->modal = bf_alloc(1, sizeof *w->modal);
    *w->modal = road_of(w);
    const enum bf_status status = w->modal->modes.n > 1 ? extend(w->modal, given, list, err) : BF_OK;
    if (!status)
        sharpen(w->modal);
    return status;
}

/* What differs from record to record cannot be fitted to modes that all have in common: a quick look from the model as given. */
static enum bf_status look_at_own(struct diagnose_state *w, const struct model *given,
                                  const struct candidate_list *list, struct bf_error *err)
{
    struct refit_job jobs[SEARCH_FEW];
    size_t n = 0;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < list->n && n < SEARCH_FEW && !status; i++) {
        const struct candidate *candidate = &list->candidates[i];
        if (!road_is_structural(candidate->effect) || !is_of_record(candidate->effect))
            continue;
        jobs[n] = (struct refit_job){
            .n_effects = 1, .n_tried = w->n_tried, .most_runs = QUICK_RUNS, .first_new = given->n_effects};
        status = candidate_model(given, candidate, candidate->start, &jobs[n].model, err);
        n += !status;
    }
    return diagnose_try(w, jobs, n, status, 0.0);
}

enum bf_status diagnose_by_modes(struct diagnose_state *w, const struct candidate_list *list, struct bf_error *err)
{
    struct model given;
    const bool first = w->modal == NULL || w->modal->of != w->d->model;
    enum bf_status status = diagnose_as_given(w->d->model, &given, err);
    if (status)
        return status;
    if (first)
        status = begin(w, &given, list, err);
    if (!status && !diagnose_modes_clear_beam(w))
        status = refit_nearest(w->modal, err);
    if (!status && first && diagnose_modes_have_told(w) && !diagnose_explained(w->d, 1))
        status = look_at_own(w, &given, list, err);
    model_free(&given);
    return status;
}

/* ---- Pairs ---- */

/* The best of the beam's own linear effects that is none of roots[n]; NULL: there is no more. */
static const struct hypothesis *next_root(const struct diagnosis *d, const struct model roots[], size_t n)
{
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        bool wanted = h->n_effects == 1 && !is_stand_in(h) && road_is_structural(h->effects[0]) &&
                      effect_kind(h->effects[0]) == KIND_LINEAR;
        for (size_t k = 0; k < n; k++)
            wanted = wanted && !same_effects(&roots[k], &h->model);
        if (wanted)
            return h;
    }
    return NULL;
}

enum bf_status diagnose_pairs_by_modes(struct diagnose_state *w, struct bf_error *err)
{
    struct modal_road road = road_of(w);
    const struct candidate_options options = {.without = w->options->without, .n_without = w->options->n_without};
    struct candidate_list list = {0};
    struct model roots[SEARCH_RIVALS];
    const struct hypothesis *root;
    size_t n = 0;
    enum bf_status status =
        candidate_list_new(&w->d->baseline.model, w->d->records, w->d->n_records, &options, &list, err);
    while (!status && road.modes.n > 1 && n < SEARCH_RIVALS && (root = next_root(w->d, roots, n)) != NULL) {
        status = model_copy(&root->model, &roots[n], err);
        if (!status)
            status = extend(&road, &roots[n++], &list, err);
    }
    sharpen(&road);
    if (!status)
        status = refit_nearest(&road, err);
    for (size_t k = 0; k < n; k++)
        model_free(&roots[k]);
    candidate_list_free(&list);
    modal_road_free(&road);
    return status;
}
