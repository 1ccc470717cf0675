/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The search ends when one effect has explained the records, and its mates may have been passed over: a spring does to a few modes what tension does. Those
 * that by the scores at the fitted baseline take nearly as much are refitted, too, so that what nobody has held against another is not named for sure.
 */
#include "diagnose_shortlist.h"

#include <math.h>

static double score_of(const struct shortlist *s, const struct beam_effect *effect)
{
    double most = 0.0;
    for (size_t i = 0; i < s->list.n; i++)
        if (s->list.candidates[i].effect == effect)
            most = fmax(most, s->scores[i].LM);
    return most;
}

/* mates[SEARCH_FEW] of the best single effect, best score first; returns how many. A law, or a set, has no score to compare with. */
static size_t find_mates(const struct shortlist *s, size_t mates[])
{
    const struct hypothesis *best = &s->w->d->hypotheses[0];
    const double least = best->n_effects == 1 ? search_limits.nearly_all * score_of(s, best->effects[0]) : 0.0;
    size_t n = 0;
    for (size_t k = 0; k < s->n_order[KIND_LINEAR] && n < SEARCH_FEW && least > 0.0; k++) {
        const size_t i = s->order[KIND_LINEAR][k];
        if (s->scores[i].LM >= least && !diagnose_has_ended(s->w->d, s->list.candidates[i].effect))
            mates[n++] = i;
    }
    return n;
}

enum bf_status shortlist_mates(struct shortlist *s, struct bf_error *err)
{
    struct refit_job jobs[SEARCH_FEW];
    size_t mates[SEARCH_FEW], n_jobs = 0;
    if (diagnose_modes_have_told(s->w)) /* what comes as near the modes has been refitted */
        return BF_OK;
    enum bf_status status = shortlist_score(s, KIND_LINEAR, err);
    if (status || s->has_law) /* its scores are those of a linear part */
        return status;
    const size_t n = find_mates(s, mates);
    score_refine_all(s->base, s->list.candidates, s->scores, mates, n, 0);
    for (size_t k = 0; k < n && !status; k++)
        if (shortlist_left(s, mates[k]) <= search_limits.more * s->w->d->hypotheses[0].fitted.noise_ratio) {
            status = shortlist_job(s, mates[k], &jobs[n_jobs], err);
            n_jobs += !status;
        }
    return diagnose_try(s->w, jobs, n_jobs, status, 0.0);
}
