/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_by_record.c — records that are not of one linear beam: one effect of the catalogue that differs from record to record. */
#include "diagnose_relatives.h"
#include "diagnose_shortlist.h"

#include <math.h>
#include <stdlib.h>

#include "ground/ground.h"

static const struct by_record_limits {
    double size; /* of the signal: the misfit that a change on purpose leaves */
    /* Free linear models of each record alone, times the rms that one of all leaves: with few records its spare poles are of one record each. */
    double each;
    double taken;   /* of the misfit's power: less is not worth a word */
    double lower;   /* times the rms of the best explanation that is the same in all records: likewise */
    double alike;   /* times the rms of the best of them: the records do not tell which differs */
    double as_well; /* times the rms that a more general form leaves: its special case says as much */
} limits = {.size = 0.2, .each = 0.7, .taken = 0.8, .lower = 0.7, .alike = 1.25, .as_well = 1.05};

/* Nothing of the catalogue has been named, and each record alone is closer to a linear beam than all of them. */
static bool is_wanted(const struct diagnosis *d)
{
    const struct attainable *a = &d->attainable;
    return d->verdict == VERDICT_UNKNOWN && d->baseline.fitted.nrmse >= limits.size && a->modes > 0 &&
           a->each_noise_ratio <= limits.each * a->noise_ratio;
}

static double least_left(const struct diagnosis *d)
{
    double least = HUGE_VAL;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        least = fmin(least, d->hypotheses[i].fitted.noise_ratio);
    return least;
}

static int by_left(const void *a, const void *b)
{
    const double x = ((const struct hypothesis *)a)->fitted.noise_ratio;
    const double y = ((const struct hypothesis *)b)->fitted.noise_ratio;
    return (x > y) - (x < y);
}

/* Of an effect and a special case of it (a tip mass and a point mass) the special case stays where it does as well, else the effect. */
static bool has_better_form(const struct diagnosis *d, size_t i)
{
    const struct hypothesis *h = &d->hypotheses[i];
    bool better = false;
    for (size_t k = 0; k < d->n_hypotheses; k++) {
        const struct hypothesis *other = &d->hypotheses[k];
        const double mine = h->fitted.noise_ratio, its = other->fitted.noise_ratio;
        const bool special =
            its <= limits.as_well * mine && diagnose_special_case(other->effects[0], h->effects[0], d->model);
        const bool general =
            mine > limits.as_well * its && diagnose_special_case(h->effects[0], other->effects[0], d->model);
        better = better || special || general;
    }
    return better;
}

/* d->hypotheses are those of the search; `shared`: rms over the noise that the best leaves which is the same in all records. */
static void take_best(struct diagnosis *d, double shared)
{
    size_t chosen[DIAGNOSE_BY_RECORD] = {0};
    if (d->hypotheses == NULL)
        return;
    qsort(d->hypotheses, d->n_hypotheses, sizeof *d->hypotheses, by_left);
    const double best = least_left(d);
    const bool worth = best <= limits.lower * shared && d->hypotheses[0].explained >= limits.taken;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const bool alike = d->hypotheses[i].fitted.noise_ratio <= limits.alike * best;
        if (worth && alike && d->n_by_record < DIAGNOSE_BY_RECORD && !has_better_form(d, i))
            chosen[d->n_by_record++] = i;
    }
    for (size_t k = 0; k < d->n_by_record; k++) {
        d->by_record[k] = d->hypotheses[chosen[k]];
        d->hypotheses[chosen[k]] = (struct hypothesis){0}; /* it has moved */
    }
}

int diagnose_own_slot(const struct hypothesis *h)
{
    const struct model_effect *own = &h->model.effects[h->n_base];
    for (int slot = 0; slot < own->effect->n_parameters; slot++)
        if (own->by_record[slot])
            return slot;
    return -1;
}

/* The search has a diagnosis of its own: what it refits is no rival of what is the same in all records. */
static enum bf_status search(struct diagnose_state *w, struct bf_error *err)
{
    struct shortlist *s;
    enum bf_status status = shortlist_new(w, &w->d->baseline, &s, err);
    if (!status)
        status = shortlist_by_record(s, err);
    shortlist_free(s);
    if (!status && !progress_interrupted())
        diagnose_special_cases(w);
    return status;
}

enum bf_status diagnose_by_record(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    if (!is_wanted(d))
        return BF_OK;
    const double shared = least_left(d);
    struct hypothesis *const kept = d->hypotheses;
    const size_t n_kept = d->n_hypotheses, n_tried = w->n_tried, n_failed = d->n_failed;
    d->hypotheses = NULL, d->n_hypotheses = 0;
    const enum bf_status status = search(w, err);
    if (!status)
        take_best(d, shared);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        hypothesis_free(&d->hypotheses[i]);
    free(d->hypotheses);
    d->hypotheses = kept, d->n_hypotheses = n_kept, w->n_tried = n_tried, d->n_failed = n_failed;
    return status;
}
