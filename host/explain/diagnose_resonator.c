/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A mode that no bending beam has: something on the beam that swings by itself, or a support that rocks. It has a strength, a frequency, a damping and
 * perhaps a place: enough to take a part of almost any misfit, near or far from a mode. So it is tried by way of the modes, and last, where nothing else is sure,
 * alone and beside the best single effect, and it stays only when it
 * is a mode: within the band, lightly damped, and leaving nothing where no other pair of effects does, or clearly less than every other explanation: the more
 * clearly, the more parameters it has.
 * What does not decay within the longest record is no mode: something drives it (a support that moves, hum).
 */
#include "diagnose_relatives.h"
#include "diagnose_resonator.h"
#include "diagnose_state.h"
#include "plausible.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "beam/beam.h"
#include "ground/ground.h"

/* All that is set by hand. */
static const struct resonator_limits {
    double lead;        /* rms: for each parameter but the strength it leaves this part of what others leave, at most */
    double spare;       /* times what it may leave at most: above, a refit is given up */
    double heaviest;    /* times the beam's mass: above, it holds the beam as a support does */
    double below_first; /* of the first mode: below, it stands still */
    double part;        /* of the beam's mass, or of its flexibility ℓ/EI: where a search begins */
    double takes;       /* of the misfit's power: a single effect that takes it may have a mode beside it */
    double beaten;      /* of what a free linear model leaves, and of the noise: no refit leaves less */
} limits = {
    .lead = 0.89, .spare = 1.1, .heaviest = 2.0, .below_first = 0.3, .part = 0.01, .takes = 0.25, .beaten = 0.9};
enum { FREQUENCIES = 8, PLACES = 2 };
static const double places[PLACES] = {1.0, 0.6}; /* of the length */

/* The baseline's first mode in which the beam bends, or swings on what holds it. */
static double first_Hz(const struct diagnosis *d)
{
    return d->mode_Hz[modes_rigid(d->mode_Hz, d->n_modes)];
}

/* What swings by itself in a model, from this effect on. NULL: nothing does. */
static const struct model_effect *own_mode(const struct model *model, size_t first)
{
    for (size_t e = first; e < model->n_effects; e++)
        if (effect_swings(&model->effects[e]))
            return &model->effects[e];
    return NULL;
}

static const struct model_effect *mode_of(const struct hypothesis *h)
{
    return own_mode(&h->model, h->n_base);
}

/* Of the explanations in which nothing swings the one that leaves the least; the baseline, where there is none. */
static const struct hypothesis *least_without(const struct diagnosis *d)
{
    const struct hypothesis *least = &d->baseline;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (mode_of(h) == NULL && h->fitted.noise_ratio < least->fitted.noise_ratio)
            least = h;
    }
    return least;
}

/* What swings in the model already takes what another one would. */
static bool is_wanted(const struct diagnosis *d)
{
    return d->n_modes > modes_rigid(d->mode_Hz, d->n_modes) && own_mode(d->model, 0) == NULL &&
           !diagnose_is_complete(d) && !diagnose_linear_is_out(d);
}

/* Where the records have no more modes than the best of the others, there is none. */
bool resonator_may_be_there(const struct diagnosis *d)
{
    return is_wanted(d) && diagnose_may_lack_mode(d, least_without(d));
}

/* Nothing in the records is seen to be nonlinear, or so little that a free linear model takes most of what the best single effect leaves. */
static bool is_mostly_linear(const struct diagnosis *d)
{
    const double left = diagnose_best_left(d, 1), floor = diagnose_floor(d);
    return d->linearity.verdict != LINEARITY_NONLINEAR ||
           (d->attainable.modes > 0 && floor * floor - 1.0 <= search_limits.half * (left * left - 1.0));
}

/*
 * One that is damped as much as it differs from a mode of the beam hides beside that, and the free linear model does without it: other effects come near what is there, and
 * none of them explains it.
 */
static bool may_hide(const struct diagnosis *d)
{
    const double left = diagnose_best_left(d, 1);
    return is_wanted(d) && is_mostly_linear(d) && !diagnose_explained(d, 1) && left < d->baseline.fitted.noise_ratio &&
           left <= search_limits.far;
}

/* Modes and the middles between them, the lowest first: mode_Hz[n_modes], without those of the beam as a whole. Returns how many. */
static size_t start_frequencies(const double mode_Hz[], size_t n_modes, double frequency_Hz[FREQUENCIES])
{
    const size_t first = modes_rigid(mode_Hz, n_modes);
    size_t n = 0;
    if (n_modes > first)
        frequency_Hz[n++] = 0.6 * mode_Hz[first];
    for (size_t m = first; m < n_modes && n < FREQUENCIES; m++) {
        frequency_Hz[n++] = mode_Hz[m];
        if (m + 1 < n_modes && n < FREQUENCIES)
            frequency_Hz[n++] = sqrt(mode_Hz[m] * mode_Hz[m + 1]);
    }
    return n;
}

static bool job_at(const struct diagnose_state *w, const struct hypothesis *from, const struct beam_effect *effect,
                   double frequency_Hz, double at_m, double part, struct refit_job *job)
{
    *job = (struct refit_job){.n_tried = w->n_tried, .places_tried = true};
    if (!resonator_begin(&from->model, effect, frequency_Hz, at_m, part, &job->model))
        return false;
    job->n_effects = job->model.n_effects - w->d->baseline.n_base;
    job->first_new = job->model.n_effects;
    return true;
}

/* Where a search begins, and what came of it: χ²/n, and whether it was left unfinished. */
struct start {
    double frequency_Hz, at_m, left;
    bool unfinished;
};

/* starts[FREQUENCIES · PLACES]: each frequency at each place, shares of the length, where the effect has one. Returns how many. */
static size_t lay_starts(const struct model *model, const struct beam_effect *effect, const double mode_Hz[],
                         size_t n_modes, const double shares[PLACES], struct start starts[])
{
    double frequency_Hz[FREQUENCIES];
    const size_t n_frequencies = start_frequencies(mode_Hz, n_modes, frequency_Hz);
    const size_t n_places = effect_slot(effect, BEAM_ROLE_PLACE) >= 0 ? PLACES : 1;
    const double last_m = model_last_place_m(model);
    size_t n = 0;
    for (size_t f = 0; f < n_frequencies; f++)
        for (size_t a = 0; a < n_places; a++)
            starts[n++] = (struct start){.frequency_Hz = frequency_Hz[f], .at_m = shares[a] * last_m, .left = HUGE_VAL};
    return n;
}

/* part: of the beam's mass or flexibility. most_runs 0: to the end. useless: as in a job. Ranks. */
static void refit_starts(struct diagnose_state *w, const struct hypothesis *from, const struct beam_effect *effect,
                         double part, struct start starts[], size_t n, size_t most_runs, double useless)
{
    struct refit_job jobs[FREQUENCIES * PLACES];
    struct start *taken[FREQUENCIES * PLACES];
    size_t n_jobs = 0;
    w->n_tried += n;
    for (size_t k = 0; k < n; k++)
        if (job_at(w, from, effect, starts[k].frequency_Hz, starts[k].at_m, part, &jobs[n_jobs])) {
            jobs[n_jobs].most_runs = most_runs, jobs[n_jobs].useless = useless;
            taken[n_jobs++] = &starts[k];
        }
    diagnose_refits(w, jobs, n_jobs, 0.0);
    diagnose_rank(w->d, w->n_tried);
    for (size_t k = 0; k < n_jobs; k++)
        taken[k]->left = jobs[k].left, taken[k]->unfinished = jobs[k].unfinished;
}

/* An explanation in which nothing swings, with so few parameters as a pair, leaves nothing that matters. */
static bool others_explain(const struct diagnosis *d)
{
    bool explained = false;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        explained = explained || (mode_of(h) == NULL && h->explains && h->n_effects <= 2);
    }
    return explained;
}

/* Of the effects that a model has more than the diagnosis was given. */
static int added_parameters(const struct diagnosis *d, const struct model *model)
{
    int n = 0;
    for (size_t e = d->baseline.n_base; e < model->n_effects; e++)
        n += model->effects[e].effect->n_parameters;
    return n;
}

/*
 * What a model with this effect may leave at most to be kept, rms in units of the noise. Each parameter of the effect but the strength can fit noise, so the model must leave less than
 * every explanation in which nothing swings, by `lead` for each of them. A parameter that the other explanation has in its place fits noise there, too, and is not counted.
 */
static double most_left(const struct diagnosis *d, const struct beam_effect *effect, int n_parameters)
{
    const int most_counted = effect->n_parameters - 1;
    double most = pow(limits.lead, most_counted) * d->baseline.fitted.noise_ratio;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        const int more = n_parameters - added_parameters(d, &h->model),
                  counted = more < most_counted ? more : most_counted;
        if (mode_of(h) == NULL)
            most = fmin(most, pow(limits.lead, counted > 0 ? counted : 0) * h->fitted.noise_ratio);
    }
    return most;
}

/* What others explain it would have to outdo by so much that not even the noise would be left, nor what the best free linear model leaves. */
static bool cannot_stand_out(const struct diagnosis *d, double most)
{
    const double floor = d->attainable.modes > 0 ? fmin(diagnose_floor(d), 1.0) : 0.0;
    return others_explain(d) && most < limits.beaten * floor;
}

static int by_left(const void *a, const void *b)
{
    const double x = ((const struct start *)a)->left, y = ((const struct start *)b)->left;
    return (x > y) - (x < y);
}

/* starts[n] become those that have come farthest of what is unfinished, unless one that is finished has come farther and leaves enough, χ²/n. Returns how many. */
static size_t brought_far(struct start starts[], size_t n, double enough)
{
    size_t far = 0;
    qsort(starts, n, sizeof *starts, by_left);
    for (size_t k = 0; k < n && far < SEARCH_LEADERS; k++) {
        if (starts[k].unfinished)
            starts[far++] = starts[k];
        else if (starts[k].left <= enough)
            break;
    }
    return far;
}

/* A quick look from each start; what has come farthest goes to its end. */
static void look_from_each(struct diagnose_state *w, const struct hypothesis *from, const struct beam_effect *effect,
                           double part, struct start starts[], size_t n, double useless)
{
    refit_starts(w, from, effect, part, starts, n, QUICK_RUNS, useless);
    const size_t far = brought_far(starts, n, useless > 0.0 ? useless * useless : HUGE_VAL);
    if (!diagnose_far_ahead(w->d, from->n_effects + 1) && !progress_interrupted())
        refit_starts(w, from, effect, part, starts, far, 0, useless);
}

/* Of use is what stands out of the others, and comes near what has been found with as many effects. */
static void try_all(struct diagnose_state *w, const struct hypothesis *from, const struct beam_effect *effect)
{
    struct start starts[FREQUENCIES * PLACES];
    const size_t n = lay_starts(w->d->model, effect, w->d->mode_Hz, w->d->n_modes, places, starts);
    const double most = most_left(w->d, effect, added_parameters(w->d, &from->model) + effect->n_parameters),
                 useful = fmin(most, diagnose_best_left(w->d, from->n_effects + 1));
    if (!cannot_stand_out(w->d, most))
        look_from_each(w, from, effect, limits.part, starts, n, limits.spare * fmax(useful, 1.0));
}

static double value_of(const struct model_effect *own, enum beam_role role)
{
    const int slot = effect_slot(own->effect, role);
    return slot >= 0 ? own->parameters[slot].value : (double)NAN;
}

static bool stands_out(const struct diagnosis *d, const struct hypothesis *h)
{
    return (h->explains && !others_explain(d)) ||
           h->fitted.noise_ratio <= most_left(d, mode_of(h)->effect, added_parameters(d, &h->model));
}

static bool is_mode(const struct diagnosis *d, const struct hypothesis *h)
{
    const struct model_effect *own = mode_of(h);
    const double f_Hz = value_of(own, BEAM_ROLE_RESONANCE);
    const double damping = resonator_damping_ratio(own->effect, value_of(own, BEAM_ROLE_LOSS), f_Hz);
    const bool heavy = !own->effect->releases_root &&
                       value_of(own, BEAM_ROLE_STRENGTH) > limits.heaviest * resonator_whole(own->effect, &h->model);
    return stands_out(d, h) && diagnose_is_mode(d, f_Hz, damping) && !heavy &&
           f_Hz > limits.below_first * first_Hz(d) && f_Hz < diagnose_band_Hz(d) &&
           diagnose_modes_are_seen(d, h, limits.below_first * first_Hz(d));
}

/* What is no mode is no explanation either. */
static void drop_others(struct diagnosis *d)
{
    bool *dropped = bf_alloc(d->n_hypotheses + 1, sizeof *dropped);
    size_t kept = 0;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        dropped[i] = mode_of(&d->hypotheses[i]) != NULL && !is_mode(d, &d->hypotheses[i]);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (dropped[i])
            hypothesis_free(&d->hypotheses[i]);
        else
            d->hypotheses[kept++] = d->hypotheses[i];
    d->n_hypotheses = kept;
    free(dropped);
}

/* A refit takes a limited number of steps, too few where its frequency had far to go. The best one is refitted from where it stopped. */
static enum bf_status to_the_end(struct diagnose_state *w, struct bf_error *err)
{
    const struct diagnosis *d = w->d;
    size_t best = 0;
    while (best < d->n_hypotheses && mode_of(&d->hypotheses[best]) == NULL)
        best++;
    if (best == d->n_hypotheses)
        return BF_OK;
    struct refit_job job = {.n_effects = d->hypotheses[best].n_effects,
                            .n_tried = w->n_tried,
                            .places_tried = true,
                            .to_the_end = true,
                            .near = true};
    const enum bf_status status = model_copy(&d->hypotheses[best].model, &job.model, err);
    if (status)
        return status;
    job.first_new = job.model.n_effects;
    diagnose_refits(w, &job, 1, 0.0);
    diagnose_rank(w->d, w->n_tried);
    return BF_OK;
}

/* Beside the effects of `from`, which must not lie in d->hypotheses. */
static enum bf_status try_beside(struct diagnose_state *w, const struct hypothesis *from, struct bf_error *err)
{
    for (int i = 0; i < beam_effects_count && !progress_interrupted(); i++)
        if (resonator_can_act(w, beam_effects[i]))
            try_all(w, from, beam_effects[i]);
    return progress_interrupted() ? BF_OK : to_the_end(w, err);
}

/* The best linear effect alone, where it takes much and leaves much. */
static const struct hypothesis *best_single(const struct diagnosis *d)
{
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (h->n_effects == 1 && mode_of(h) == NULL)
            return effect_is_linear(h->effects[0]) && h->explained >= limits.takes && diagnose_is_far(h) ? h : NULL;
    }
    return NULL;
}

static enum bf_status try_beside_single(struct diagnose_state *w, struct bf_error *err)
{
    const struct hypothesis *single = best_single(w->d);
    struct hypothesis from = {0};
    if (single == NULL || progress_interrupted())
        return BF_OK;
    from.n_effects = single->n_effects;
    enum bf_status status = model_copy(&single->model, &from.model, err);
    if (!status)
        status = try_beside(w, &from, err);
    model_free(&from.model);
    return status;
}

void resonators_judge(struct diagnose_state *w)
{
    drop_others(w->d);
    diagnose_rank(w->d, w->n_tried);
    diagnose_drop_repeats(w->d);
}

enum bf_status diagnose_resonator(struct diagnose_state *w, struct bf_error *err)
{
    if (!resonator_may_be_there(w->d) && !may_hide(w->d))
        return BF_OK;
    enum bf_status status = try_beside(w, &w->d->baseline, err);
    if (!status)
        status = try_beside_single(w, err);
    resonators_judge(w);
    return status;
}
