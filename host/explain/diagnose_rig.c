/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A rig is never quite where and what the model file says: sensors and the hammer's mark are off by a millimetre or two, gains by some per
 * cent. Left alone that is a misfit of several times the noise, and effects that are not there take it. Where it matters, places and
 * gains are fitted too, each with a prior around what the file says.
 */
#include "diagnose_shortlist.h"
#include "diagnose_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

const struct rig_limits diagnose_rig_limits = {.place_m = 0.002, .gain = 0.05, .clear = 0.3, .believed = 4.0};

/* ---- The model ---- */

static size_t free_one(struct channel_parameters *own, double at_m)
{
    size_t n = 0;
    if (own->at.name[0] && !own->lists_at && at_m > diagnose_rig_limits.place_m) {
        model_channel_open_place(own, at_m, diagnose_rig_limits.place_m);
        n++;
    }
    if (own->gain.name[0] && !own->lists_gain && own->gain.value > 0.0) {
        model_channel_open_gain(own, diagnose_rig_limits.gain);
        n++;
    }
    return n;
}

static size_t free_channels(struct model *model)
{
    size_t n = 0;
    for (size_t i = 0; i < model->n_inputs; i++)
        n += free_one(&model->inputs[i].own, model->inputs[i].at_m);
    for (size_t o = 0; o < model->n_outputs; o++)
        n += free_one(&model->outputs[o].own, model->outputs[o].at_m);
    return n;
}

/* Where and what they are: held or free, at the believed values. */
static void take_channels(const struct model *given, struct model *model)
{
    for (size_t i = 0; i < model->n_inputs; i++)
        model->inputs[i].own = given->inputs[i].own, model->inputs[i].at_m = given->inputs[i].at_m;
    for (size_t o = 0; o < model->n_outputs; o++)
        model->outputs[o].own = given->outputs[o].own, model->outputs[o].at_m = given->outputs[o].at_m;
}

/* ---- The two sides ---- */

static void exchange(struct diagnosis *d, struct diagnose_side *other)
{
    struct diagnose_side here = {.model = d->model,
                                 .baseline = d->baseline,
                                 .converged = d->converged,
                                 .n_facts = d->n_facts,
                                 .n_modes = d->n_modes,
                                 .n_hypotheses = d->n_hypotheses,
                                 .facts = d->facts,
                                 .hypotheses = d->hypotheses};
    memcpy(here.mode_Hz, d->mode_Hz, sizeof here.mode_Hz);
    d->model = other->model;
    d->baseline = other->baseline;
    d->converged = other->converged;
    d->n_facts = other->n_facts, d->facts = other->facts;
    d->n_modes = other->n_modes;
    memcpy(d->mode_Hz, other->mode_Hz, sizeof d->mode_Hz);
    d->n_hypotheses = other->n_hypotheses, d->hypotheses = other->hypotheses;
    *other = here;
}

void diagnose_side_free(struct diagnose_side *side)
{
    for (size_t i = 0; i < side->n_hypotheses; i++)
        hypothesis_free(&side->hypotheses[i]);
    hypothesis_free(&side->baseline);
    free(side->hypotheses), free(side->facts);
    *side = (struct diagnose_side){0};
}

/* The least that a side's baseline and explanations leave of all records: places and gains that are fitted take what differs from record to record, and predict nothing. */
static double least_excess(const struct hypothesis *baseline, const struct hypothesis hypotheses[], size_t n)
{
    double least = hypothesis_left_of_all(baseline);
    for (size_t i = 0; i < n; i++)
        least = fmin(least, hypothesis_left_of_all(&hypotheses[i]));
    return least;
}

/* The free model's baseline, from where the held one's ended if need be. Between two exchanges: the held side is the other one. */
static enum bf_status free_baseline(struct diagnose_state *w, struct bf_error *err)
{
    struct model start;
    enum bf_status status = diagnose_baseline(w, err);
    if (!status)
        status = model_copy(&w->other.baseline.model, &start, err);
    if (status)
        return status;
    (void)free_channels(&start);
    return diagnose_not_above(w, &w->other.baseline, &start, err);
}

/* The free model and its baseline, as the other side. */
static enum bf_status make_free_side(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    enum bf_status status = model_copy(d->model, &d->rig, err);
    if (status || free_channels(&d->rig) == 0)
        return status;
    w->other = (struct diagnose_side){.model = &d->rig};
    exchange(d, &w->other);
    status = free_baseline(w, err);
    exchange(d, &w->other);
    if (status)
        diagnose_side_free(&w->other);
    return status == BF_NUMERIC ? BF_OK : status;
}

/* A law behind a linear effect, or far behind another law: its refit steps through time, which takes seconds to minutes. */
static bool is_dear(const struct hypothesis *h, const struct hypothesis *best)
{
    return hypothesis_has_law(h) &&
           (!hypothesis_has_law(best) || h->fitted.noise_ratio > search_limits.more * best->fitted.noise_ratio);
}

/* The best explanations of the other side, fitted again from near with this side's channels. */
static enum bf_status take_over(struct diagnose_state *w, struct bf_error *err)
{
    struct refit_job jobs[SEARCH_FEW];
    size_t n = 0;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < w->other.n_hypotheses && n < SEARCH_FEW && !status; i++) {
        const struct hypothesis *h = &w->other.hypotheses[i];
        if (h->score <= w->other.baseline.score || (i > 0 && is_dear(h, &w->other.hypotheses[0])))
            continue;
        jobs[n] = (struct refit_job){.n_effects = h->n_effects,
                                     .n_tried = h->n_tried,
                                     .first_new = h->model.n_effects,
                                     .to_the_end = true,
                                     .places_tried = h->places_tried,
                                     .near = true};
        status = model_copy(&h->model, &jobs[n].model, err);
        take_channels(w->d->model, &jobs[n].model);
        n += !status;
    }
    return diagnose_try(w, jobs, n, status, 0.0);
}

/* Of a place and a gain that the file does not make parameters itself. */
static bool is_near(const struct channel_parameters *own, double at_m, const struct channel_parameters *stated,
                    double stated_at_m)
{
    const struct rig_limits *limits = &diagnose_rig_limits;
    const bool placed = own->at.name[0] && !stated->lists_at, scaled = own->gain.name[0] && !stated->lists_gain;
    return !(placed && fabs(at_m - stated_at_m) > limits->believed * limits->place_m) &&
           !(scaled && fabs(own->gain.value / stated->gain.value - 1.0) > limits->believed * limits->gain);
}

/* A rig that has to be elsewhere than anybody would put it stands in for something else. */
static bool is_believed(const struct model *freed, const struct model *stated)
{
    bool near = true;
    for (size_t i = 0; i < freed->n_inputs; i++)
        near = near &&
               is_near(&freed->inputs[i].own, freed->inputs[i].at_m, &stated->inputs[i].own, stated->inputs[i].at_m);
    for (size_t o = 0; o < freed->n_outputs; o++)
        near = near && is_near(&freed->outputs[o].own, freed->outputs[o].at_m, &stated->outputs[o].own,
                               stated->outputs[o].at_m);
    return near;
}

/* On the free side: the trial has shown that the rig is to be free. */
static bool is_worth_it(const struct diagnosis *d, const struct diagnose_side *held, enum rig_trial trial)
{
    switch (trial) {
    case RIG_ALONE:
        return diagnose_is_complete(d) && is_believed(&d->baseline.model, held->model);
    case RIG_AND_LEADER:
        return d->n_hypotheses > 0 && is_believed(&d->hypotheses[0].model, held->model) &&
               (diagnose_explained(d, 1) || diagnose_no_linear_outdoes(d));
    default:
        return least_excess(&d->baseline, d->hypotheses, d->n_hypotheses) <
               (1.0 - diagnose_rig_limits.clear) * least_excess(&held->baseline, held->hypotheses, held->n_hypotheses);
    }
}

enum bf_status diagnose_free_rig(struct diagnose_state *w, enum rig_trial trial, bool *freed, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    enum bf_status status = BF_OK;
    *freed = false;
    if (d->free_rig || progress_interrupted())
        return BF_OK;
    if (d->rig.length_m == 0.0)
        status = make_free_side(w, err);
    if (status || w->other.model == NULL)
        return status;
    exchange(d, &w->other);
    if (trial != RIG_ALONE)
        status = take_over(w, err);
    *freed = !status && is_worth_it(d, &w->other, trial);
    d->free_rig = *freed;
    if (!*freed)
        exchange(d, &w->other);
    return status;
}

/* It comes down to the noise, and leaves as much as what is best with the rig free. */
static bool does_as_well(const struct hypothesis *held, double free_left)
{
    return held->explains && held->fitted.noise_ratio <= search_limits.same * free_left;
}

enum bf_status diagnose_hold_rig(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    if (!d->free_rig || d->n_hypotheses == 0 || progress_interrupted())
        return BF_OK;
    const double free_left = d->hypotheses[0].fitted.noise_ratio;
    exchange(d, &w->other);
    const enum bf_status status = take_over(w, err);
    d->free_rig = status || d->n_hypotheses == 0 || !does_as_well(&d->hypotheses[0], free_left);
    if (d->free_rig)
        exchange(d, &w->other);
    diagnose_rank(d, w->n_tried);
    return status;
}
