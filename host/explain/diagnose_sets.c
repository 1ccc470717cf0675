/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sets of effects: they grow from the best ones with an effect less, and shrink again where what came first has fitted what a later one explains. */
#include "diagnose_relatives.h"
#include "diagnose_shortlist.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* Refits of one more effect, at most. */
static const size_t most_pairs[] = {[KIND_LINEAR] = 4, [KIND_NONLINEAR_CHAIN] = 2, [KIND_LAW] = 3};
static const size_t most_on_law[] = {[KIND_LINEAR] = 2, [KIND_NONLINEAR_CHAIN] = 0, [KIND_LAW] = 0}; /* seconds each */
/* Hypotheses that one more effect is added to: a pair may hide behind a single effect that takes more than either of its own. */
enum { PAIR_ROOTS = 2, SET_ROOTS = 1 };
/*
 * One more effect is sought when the last one has left at most this part of the excess over the noise (in power). Of effects of equal
 * strength and unlike shape the first of three leaves 2/3, the first of two (or second of three) 1/2.
 */
static const double least_progress = 0.75;
/* Part of the progress bar. */
static const double part_pairs = 0.2;

/* A hypothesis to build upon: a copy of what is needed, because the list grows. */
static enum bf_status copy_root(const struct hypothesis *h, struct hypothesis *root, struct bf_error *err)
{
    *root = *h;
    root->fit.value = bf_alloc(h->fit.n_parameters, sizeof(double));
    memcpy(root->fit.value, h->fit.value, h->fit.n_parameters * sizeof(double));
    return model_copy(&h->model, &root->model, err);
}

static void free_root(struct hypothesis *root)
{
    free(root->fit.value);
    model_free(&root->model);
}

/* Rms in units of the noise that is left of all records: what overfits the fitted ones must not keep the others from having a pair. */
static double left_of_all(const struct hypothesis *h)
{
    return sqrt(1.0 + hypothesis_left_of_all(h));
}

static double least_left_of_all(const struct diagnosis *d, size_t n_effects)
{
    double least = left_of_all(&d->baseline);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects == n_effects)
            least = fmin(least, left_of_all(&d->hypotheses[i]));
    return least;
}

/* What takes next to nothing is no part of a pair, whatever its evidence. */
static bool helps(const struct diagnosis *d, const struct hypothesis *h)
{
    return hypothesis_excess(&h->fitted) <= least_progress * hypothesis_misfit(&d->baseline.fitted);
}

/*
 * Stepping through time for every candidate is worth it on a law that comes near what the best with as many effects leaves: beside a stronger linear effect a law is found from
 * that one's side, and beside a stronger law a linear one from the law's.
 */
static bool is_root(const struct diagnosis *d, const struct hypothesis *h, size_t n_effects, bool stepping)
{
    const double most = stepping ? search_limits.more : search_limits.far;
    return h->n_effects == n_effects && hypothesis_has_law(h) == stepping && helps(d, h) &&
           left_of_all(h) <= most * least_left_of_all(d, n_effects);
}

/* The same root, and a root and its special case lead to the same pairs, unless the general one has taken what the other effect of the pair does. */
static bool is_kin(const struct diagnosis *d, const struct hypothesis *one, const struct hypothesis *other)
{
    const double a = one->fitted.noise_ratio, b = other->fitted.noise_ratio;
    if (one->effects[0] == other->effects[0])
        return true;
    return (diagnose_special_case(one->effects[0], other->effects[0], d->model) ||
            diagnose_special_case(other->effects[0], one->effects[0], d->model)) &&
           fmax(a, b) <= search_limits.alike * fmin(a, b);
}

static bool has_kin(const struct diagnosis *d, const struct hypothesis roots[], size_t n, const struct hypothesis *h)
{
    for (size_t k = 0; k < n; k++)
        if (is_kin(d, h, &roots[k]))
            return true;
    return false;
}

/* The one with the most evidence, then those that leave the least: evidence counts modes and records alike, whatever is left in each. NULL: no more. */
static const struct hypothesis *next_root(const struct diagnosis *d, const struct hypothesis roots[], size_t n,
                                          size_t n_effects, bool stepping)
{
    const struct hypothesis *next = NULL;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        const bool fits = is_root(d, h, n_effects, stepping) && !has_kin(d, roots, n, h);
        if (fits && (next == NULL || (n > 0 && left_of_all(h) < left_of_all(next))))
            next = h;
    }
    return next;
}

/* One more effect on the best hypotheses with n_effects of them, those that step through time or those that do not. */
static enum bf_status extend_roots(struct diagnose_state *w, size_t n_effects, bool stepping, size_t most_roots,
                                   const size_t most[], double span, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct hypothesis roots[PAIR_ROOTS];
    const struct hypothesis *next;
    size_t n = 0;
    enum bf_status status = BF_OK;
    while (n < most_roots && !status && (next = next_root(d, roots, n, n_effects, stepping)) != NULL)
        status = copy_root(next, &roots[n++], err);
    for (size_t i = 0; i < n; i++) {
        const bool wanted = i == 0 || (diagnose_is_far(&d->baseline) && !diagnose_explained(d, n_effects + 1));
        if (!status && wanted && !progress_interrupted())
            status = diagnose_extend(w, &roots[i], most, span / (double)n, err);
        free_root(&roots[i]);
    }
    return status;
}

/* A weak misfit does not show two effects; of held-out records that come of other inputs it may be strong. */
static bool misfit_is_weak(const struct diagnosis *d)
{
    return !diagnose_is_far(&d->baseline) && !(d->baseline.check.noise_ratio > search_limits.far);
}

enum bf_status diagnose_one_more(struct diagnose_state *w, size_t n_effects, struct bf_error *err)
{
    const size_t most_roots = n_effects == 1 ? PAIR_ROOTS : SET_ROOTS;
    enum bf_status status = extend_roots(w, n_effects, false, most_roots, most_pairs, 0.5 * part_pairs, err);
    if (!status && !misfit_is_weak(w->d) && !progress_interrupted() && diagnose_more_wanted(w->d))
        status = extend_roots(w, n_effects, true, 1, most_on_law, 0.5 * part_pairs, err);
    return status;
}

/*
 * Without what came last it is known, although not from these values: a step through time for that is too dear. Of three effects with
 * a law two are not tried either.
 */
static bool is_worth_dropping(const struct hypothesis *best, size_t e)
{
    const bool last = e + 1 == best->n_effects;
    if (best->n_effects > 2)
        return !hypothesis_has_law(best);
    return !last || best->effects[0]->law == NULL;
}

enum bf_status diagnose_without_one(struct diagnose_state *w, struct bf_error *err)
{
    const struct hypothesis *best = &w->d->hypotheses[0];
    struct refit_job jobs[DIAGNOSE_EFFECTS];
    size_t n = 0;
    enum bf_status status = BF_OK;
    if (w->d->n_hypotheses == 0 || best->n_effects < 2)
        return BF_OK;
    for (size_t e = 0; e < best->n_effects && !status; e++) {
        struct refit_job *job = &jobs[n];
        if (!is_worth_dropping(best, e))
            continue;
        *job = (struct refit_job){.n_effects = best->n_effects - 1, .n_tried = w->n_tried};
        status = model_copy(&best->model, &job->model, err);
        if (status)
            break;
        n++;
        status = model_drop_effect(&job->model, best->effects[e]->id, err);
        job->first_new = job->model.n_effects;
    }
    if (!status)
        diagnose_refits(w, jobs, n, 0.0);
    for (size_t i = 0; status && i < n; i++)
        model_free(&jobs[i].model);
    diagnose_rank(w->d, w->n_tried);
    return status;
}

bool diagnose_last_one_helped(const struct diagnosis *d, size_t n_effects)
{
    const double now = diagnose_best_left(d, n_effects), before = diagnose_best_left(d, n_effects - 1);
    return now * now - 1.0 <= least_progress * fmax(before * before - 1.0, 0.0);
}
