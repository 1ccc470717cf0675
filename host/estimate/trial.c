/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "trial_search.h"

/* Rounds are for candidates that explain at least this part of what the best explains. */
static const double worth_a_round = 0.05;
/* Rounds end when χ² changes by less than this part. */
static const double standstill = 0.05;
/* Candidates of trial_all() that go through the rounds; an effect with a place may take two, see candidates(). */
enum { SHORT_LIST = 6, RENEWALS = 2 };

static enum bf_status first_round(const struct motion *motion, const struct regression *regression,
                                  const struct beam_effect *effect, const struct trial_options *options,
                                  struct trial *out, struct bf_error *err)
{
    struct trial_search search;
    *out = (struct trial){.effect = effect};
    out->theta = bf_alloc(motion->n_parameters, sizeof(double));
    enum bf_status status = trial_search_new(motion, regression, effect, &search, err);
    if (status != BF_OK)
        return status;
    trial_search_scan(&search, options, err);
    status = trial_search_answer(&search, out, err);
    trial_search_free(&search);
    return status;
}

/* ---- Renewal of θ and the motion ---- */

/* The motion at out->theta with the force of out->p in it, and the search from there. */
static enum bf_status search_again(struct motion *motion, const double measure[], const struct trial_options *options,
                                   struct trial *out, struct bf_error *err)
{
    struct regression regression;
    struct trial_search search;
    enum bf_status status = trial_search_new(motion, NULL, out->effect, &search, err);
    if (status != BF_OK)
        return status;
    search.measure = measure;
    status = trial_force_assume(&search.force, motion, out->p, RENEWALS, err);
    if (status == BF_OK)
        status = regression_new(motion, &regression, err);
    if (status == BF_OK) {
        trial_search_bind(&search, &regression);
        trial_search_resume(&search, out->p, options);
        if (search.best.fall > 0.0)
            status = trial_search_answer(&search, out, err);
        regression_free(&regression);
    }
    trial_search_free(&search);
    return status;
}

static enum bf_status next_round(struct predictor *predictor, const struct motion *old,
                                 const struct trial_options *options, struct trial *out, struct bf_error *err)
{
    struct motion motion;
    enum bf_status status = predictor_rebase(predictor, out->theta, err);
    if (status == BF_OK)
        status = motion_prepare(predictor, out->theta, old->sigma, old->floor, &motion, err);
    if (status != BF_OK)
        return status;
    status = search_again(&motion, old->weight, options, out, err);
    motion_free(&motion);
    return status;
}

static void copy_trial(const struct trial *from, size_t n_parameters, struct trial *to)
{
    double *theta = to->theta;
    *to = *from;
    to->theta = theta;
    memcpy(theta, from->theta, n_parameters * sizeof *theta);
}

/*
 * The χ² of the first round is that of a predicted motion, later ones are of the renewed one; the best of those is kept. A
 * round that is worse than the one before may be on its way (friction): only a standstill ends early.
 */
static enum bf_status rounds(const struct motion *motion, const struct trial_options *options, struct trial *out,
                             struct bf_error *err)
{
    struct predictor *predictor;
    if (!out->possible || options->rounds <= 0)
        return BF_OK;
    enum bf_status status = predictor_clone(motion->predictor, &predictor, err);
    if (status != BF_OK)
        return status;
    size_t n = motion->n_parameters;
    struct trial best = {.chi_square = INFINITY, .theta = bf_alloc(n, sizeof(double))};
    for (int i = 0; i < options->rounds; i++) {
        double before = out->chi_square;
        if (next_round(predictor, motion, options, out, err) != BF_OK || !out->possible)
            break;
        if (out->chi_square < best.chi_square)
            copy_trial(out, n, &best);
        if (i > 0 && fabs(out->chi_square - before) < standstill * before)
            break;
    }
    if (isfinite(best.chi_square))
        copy_trial(&best, n, out);
    free(best.theta);
    predictor_free(predictor);
    return BF_OK;
}

/* ---- Public ---- */

void trial_free(struct trial *trial)
{
    free(trial->theta);
    *trial = (struct trial){0};
}

static int by_chi_square(const void *a, const void *b)
{
    const struct trial *x = a, *y = b;
    return (x->chi_square > y->chi_square) - (x->chi_square < y->chi_square);
}

/*
 * An effect with a place is tried where the catalogue puts it and, beside that, where the scan finds it best: a scan along a
 * motion without the force may be wrong, so the renewed motion decides. Adds one or two to list[*n].
 */
static enum bf_status candidates(const struct motion *motion, const struct regression *regression,
                                 const struct beam_effect *effect, const struct trial_options *options,
                                 struct trial list[], size_t *n, struct bf_error *err)
{
    const struct trial_options at_start = {.rounds = options->rounds, .keep_positions = true};
    bool has_place = false;
    for (int k = 0; k < effect->n_parameters; k++)
        has_place = has_place || effect->parameters[k].role == BEAM_ROLE_PLACE;
    struct trial *first = &list[(*n)++];
    enum bf_status status = first_round(motion, regression, effect, &at_start, first, err);
    if (status != BF_OK || !has_place || options->keep_positions)
        return status;
    struct trial *scanned = &list[(*n)++];
    status = first_round(motion, regression, effect, options, scanned, err);
    scanned->forces += first->forces;
    if (status == BF_OK && !(scanned->chi_square < first->chi_square))
        trial_free(&list[--*n]);
    return status;
}

/* The rounds of the best, then one entry an effect, best first. */
static enum bf_status finish(const struct motion *motion, const struct trial_options *options, struct trial list[],
                             size_t *n, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    size_t kept = 0, renewed = 0;
    qsort(list, *n, sizeof *list, by_chi_square);
    while (renewed < *n && renewed < SHORT_LIST && list[renewed].share >= worth_a_round * list[0].share)
        renewed++;
    for (size_t i = 0; status == BF_OK && i < renewed; i++)
        status = rounds(motion, options, &list[i], err);
    qsort(list, renewed, sizeof *list, by_chi_square);
    for (size_t i = 0; i < *n; i++) {
        bool again = false;
        for (size_t k = 0; k < kept; k++)
            again = again || list[k].effect == list[i].effect;
        if (again) {
            trial_free(&list[i]);
            continue;
        }
        if (kept != i) {
            list[kept] = list[i];
            list[i] = (struct trial){0};
        }
        kept++;
    }
    *n = kept;
    return status;
}

/* The effects of a list, tried. list has room for two an effect; on failure it is empty. */
static enum bf_status try_effects(const struct motion *motion, const struct beam_effect *const effects[], size_t count,
                                  const struct trial_options *options, struct trial list[], size_t *n,
                                  struct bf_error *err)
{
    struct regression regression;
    enum bf_status status = regression_new(motion, &regression, err);
    *n = 0;
    if (status != BF_OK)
        return status;
    for (size_t e = 0; status == BF_OK && e < count; e++)
        status = candidates(motion, &regression, effects[e], options, list, n, err);
    regression_free(&regression);
    if (status == BF_OK)
        status = finish(motion, options, list, n, err);
    for (size_t i = 0; status != BF_OK && i < *n; i++)
        trial_free(&list[i]);
    return status;
}

enum bf_status trial_run(const struct motion *motion, const struct beam_effect *effect,
                         const struct trial_options *options, struct trial *out, struct bf_error *err)
{
    struct trial list[2] = {{0}};
    size_t n;
    if (!trial_possible(effect))
        return bf_fail(err, BF_USAGE, "effect %s has no force law", effect->id);
    enum bf_status status = try_effects(motion, &effect, 1, options, list, &n, err);
    *out = list[0];
    return status;
}

enum bf_status trial_all(const struct motion *motion, const struct trial_options *options, struct trial **out,
                         size_t *n, struct bf_error *err)
{
    const struct beam_effect **effects = bf_alloc((size_t)beam_effects_count, sizeof *effects);
    struct trial *list = bf_alloc(2 * (size_t)beam_effects_count, sizeof *list);
    size_t count = 0;
    for (int e = 0; e < beam_effects_count; e++)
        if (trial_possible(beam_effects[e]) && !model_has_effect(transfer_model(motion->predictor), beam_effects[e]))
            effects[count++] = beam_effects[e];
    enum bf_status status = try_effects(motion, effects, count, options, list, n, err);
    free(effects);
    if (status != BF_OK) {
        free(list);
        *n = 0;
        return status;
    }
    *out = list;
    return BF_OK;
}
