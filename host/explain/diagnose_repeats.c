/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Refits of the same effects: the best stays, and notes where another place explains the records as well. */
#include "diagnose_relatives.h"
#include "diagnose_state.h"

#include <math.h>
#include <string.h>

/* Part of the length: places closer than this are one. */
static const double same_place = 0.05;

double hypothesis_only_place(const struct hypothesis *h)
{
    const struct model_effect *own = h->n_effects == 1 ? &h->model.effects[h->n_base] : NULL;
    for (int i = 0; own != NULL && i < own->effect->n_parameters; i++)
        if (own->effect->parameters[i].role == BEAM_ROLE_PLACE && !own->parameters[i].fixed)
            return own->parameters[i].value;
    return nan("");
}

static bool has_effect(const struct hypothesis *h, const struct model_effect *effect)
{
    for (size_t i = h->n_base; i < h->model.n_effects; i++)
        if (h->model.effects[i].effect == effect->effect && strcmp(h->model.effects[i].channel, effect->channel) == 0)
            return true;
    return false;
}

static bool same_effects(const struct hypothesis *a, const struct hypothesis *b)
{
    bool same = a->n_effects == b->n_effects;
    for (size_t i = a->n_base; i < a->model.n_effects && same; i++)
        same = has_effect(b, &a->model.effects[i]) && has_effect(a, &b->model.effects[i]);
    return same;
}

/* A worse refit of the same effect tells another place that the records allow as well. */
static void note_place(const struct diagnosis *d, struct hypothesis *best, const struct hypothesis *repeat)
{
    const double at = hypothesis_only_place(best), other = hypothesis_only_place(repeat);
    if (isnan(at) || isnan(other) || best->has_other_place || !diagnose_as_good(repeat, best))
        return;
    if (fabs(at - other) <= same_place * d->model->length_m)
        return;
    best->has_other_place = true;
    best->other_at_m = other;
}

static void exchange(struct hypothesis *a, struct hypothesis *b)
{
    const struct hypothesis kept = *a;
    *a = *b;
    *b = kept;
}

/*
 * What was computed with more steps is the truer one, whatever it leaves; a support that is held, where it explains as much, is the simpler one; else the one with the better
 * score stays, which stands first.
 */
static bool is_truer(const struct hypothesis *h, const struct hypothesis *first)
{
    const int more = h->model.steps_per_sample - first->model.steps_per_sample;
    const bool is_held = hypothesis_support_is_held(h) && !hypothesis_support_is_held(first);
    return more > 0 || (more == 0 && is_held && diagnose_as_good(h, first));
}

void diagnose_drop_repeats(struct diagnosis *d)
{
    size_t kept = 0;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        size_t first = 0;
        while (first < kept && !same_effects(&d->hypotheses[first], &d->hypotheses[i]))
            first++;
        if (first == kept) {
            d->hypotheses[kept++] = d->hypotheses[i];
            continue;
        }
        if (is_truer(&d->hypotheses[i], &d->hypotheses[first]))
            exchange(&d->hypotheses[first], &d->hypotheses[i]);
        else
            note_place(d, &d->hypotheses[first], &d->hypotheses[i]);
        hypothesis_free(&d->hypotheses[i]);
    }
    d->n_hypotheses = kept;
}
