/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "trial_work.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dense.h"
#include "residual.h"

/* Thresholds tried, in units of the largest motion; the last are as good as zero to most laws. */
static const double levels[] = {0.8, 0.5, 0.25, 0.1, 0.03, 0.01, 0.003, 0.001};
/* Of a parameter without a scale in the motion: multiples of the catalogue's start. */
static const double multiples[] = {0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0};
/* Places tried, as fractions of the span. */
static const double places[] = {0.08, 0.2, 0.35, 0.5, 0.65, 0.8, 1.0};
/* Refinement: steps in the logarithm of an inner parameter, in the span for a place. */
static const double first_step = 0.5, last_step = 0.1;
static const double first_place = 0.06, last_place = 0.015;
/* A force whose response the baseline's parameters imitate to this part of its square says nothing. */
static const double imitated = 1e-7;
/* Rounds are for candidates that explain at least this part of what the best explains. */
static const double worth_a_round = 0.05;
/* Rounds end when χ² changes by less than this part. */
static const double standstill = 0.05;
/* Candidates of trial_all() that go through the rounds; an effect with a place may take two, see candidates(). */
enum { SHORT_LIST = 6, MOST_TRIES = 8, RENEWALS = 2 };

struct search {
    const struct motion *motion;
    const struct regression *regression;
    struct trial_force force;
    struct trial_roles roles;
    const struct parameter *info; /* [n_parameters] of the effect, in the model */
    double *rows, *s;             /* [n_rows], [m] */
    const double *measure;        /* [n_channels] weights of the χ² that is reported, the same for all candidates */
    struct trial_point best;
};

static void search_bind(struct search *search, const struct regression *regression)
{
    search->regression = regression;
    search->rows = bf_grow(search->rows, regression->n_rows + regression->m, sizeof(double));
    search->s = search->rows + regression->n_rows;
}

/* regression NULL: bound later. */
static enum bf_status search_new(const struct motion *motion, const struct regression *regression,
                                 const struct beam_effect *effect, struct search *out, struct bf_error *err)
{
    *out = (struct search){.motion = motion, .measure = motion->weight};
    enum bf_status status = trial_force_new(motion, effect, &out->force, err);
    if (status == BF_OK)
        status = trial_roles(&out->force, &out->roles, err);
    if (status != BF_OK) {
        trial_force_free(&out->force);
        return status;
    }
    out->info = out->force.model.effects[out->force.effect].parameters;
    if (regression != NULL)
        search_bind(out, regression);
    for (int k = 0; k < effect->n_parameters; k++)
        out->best.p[k] = out->info[k].value;
    return BF_OK;
}

static void search_free(struct search *search)
{
    trial_force_free(&search->force);
    free(search->rows);
}

static double clipped(const struct parameter *info, double value)
{
    return fmax(info->min, fmin(info->max, value));
}

/* The factor by which the strength may go, nearest to the wanted one. */
static double allowed(const struct search *search, const double p[], double factor)
{
    for (int k = 0; k < search->force.law.effect->n_parameters; k++) {
        if (!search->roles.with_strength[k])
            continue;
        double value = clipped(&search->info[k], factor * p[k]);
        if (k != search->roles.strength && factor <= 0.0)
            return 0.0;
        factor = value / p[k];
    }
    return factor;
}

/* The force at p (any strength but 0), its best factor and the fall of χ². Not an error: a law that refuses p. */
static struct trial_point attempt(struct search *search, const double p[])
{
    const struct regression *regression = search->regression;
    struct trial_point out = {.fall = 0.0};
    struct bf_error ignored;
    double norm;
    memcpy(out.p, p, sizeof out.p);
    if (trial_force_rows(&search->force, p, search->rows, &ignored) != BF_OK)
        return out;
    regression_project(regression, search->rows, search->s, &norm);
    out.norm2 = dense_dot(regression->m, search->s, search->s);
    if (!(out.norm2 > imitated * norm * norm) || !(norm > 0.0))
        return out;
    double product = dense_dot(regression->m, search->s, regression->left);
    out.factor = allowed(search, p, product / out.norm2);
    out.fall = fmax(0.0, out.factor * (2.0 * product - out.factor * out.norm2));
    if (!(out.fall > 0.0))
        return out;
    for (int k = 0; k < search->force.law.effect->n_parameters; k++)
        if (search->roles.with_strength[k])
            out.p[k] *= out.factor;
    return out;
}

static void keep_best(struct search *search, struct trial_point point)
{
    if (point.fall > search->best.fall)
        search->best = point;
}

/* The best parameters so far with the strength of the catalogue's start, so that no factor compounds. */
static void base_point(const struct search *search, double p[])
{
    memcpy(p, search->best.p, sizeof search->best.p);
    double factor = search->info[search->roles.strength].value / p[search->roles.strength];
    for (int k = 0; k < search->force.law.effect->n_parameters; k++)
        if (search->roles.with_strength[k] && search->best.fall > 0.0)
            p[k] *= factor;
}

static void scan_inner(struct search *search, int slot)
{
    bool own = search->roles.scale[slot] == TRIAL_OWN;
    size_t count = own ? sizeof multiples / sizeof *multiples : sizeof levels / sizeof *levels;
    double p[BEAM_EFFECT_PARAMETERS], unit = trial_unit(&search->force, &search->roles, slot);
    base_point(search, p);
    for (size_t i = 0; i < count; i++) {
        p[slot] = clipped(&search->info[slot], unit * (own ? multiples[i] : levels[i]));
        keep_best(search, attempt(search, p));
    }
}

/* Thresholds keep their ratio to the motion when the place changes. */
static void scan_places(struct search *search, struct bf_error *err)
{
    int at = search->roles.position;
    double start[BEAM_EFFECT_PARAMETERS], ratio[BEAM_EFFECT_PARAMETERS] = {0};
    base_point(search, start);
    if (trial_force_place(&search->force, start, err) != BF_OK)
        return;
    for (int i = 0; i < search->roles.n_inner; i++)
        ratio[i] = start[search->roles.inner[i]] / trial_unit(&search->force, &search->roles, search->roles.inner[i]);
    for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
        double p[BEAM_EFFECT_PARAMETERS];
        memcpy(p, start, sizeof p);
        p[at] = clipped(&search->info[at], places[k] * search->force.model.length_m);
        if (trial_force_place(&search->force, p, err) != BF_OK)
            continue;
        for (int i = 0; i < search->roles.n_inner; i++) {
            int slot = search->roles.inner[i];
            p[slot] = clipped(&search->info[slot],
                              ratio[i] * trial_unit(&search->force, &search->roles, search->roles.inner[i]));
        }
        keep_best(search, attempt(search, p));
    }
}

/* Steps up and down, halved when neither helps. log: p e^(±step); else p ± step · length. */
static void refine(struct search *search, int slot, bool logarithmic, double step, double last)
{
    for (int i = 0; i < MOST_TRIES && step >= last; i++) {
        double before = search->best.fall, centre[BEAM_EFFECT_PARAMETERS];
        base_point(search, centre);
        for (int side = -1; side <= 1 && !(search->best.fall > before); side += 2) {
            double p[BEAM_EFFECT_PARAMETERS], shift = side * step;
            memcpy(p, centre, sizeof p);
            p[slot] = clipped(&search->info[slot],
                              logarithmic ? p[slot] * exp(shift) : p[slot] + shift * search->force.model.length_m);
            keep_best(search, attempt(search, p));
        }
        if (!(search->best.fall > before))
            step *= 0.5;
    }
}

static void refine_all(struct search *search, const struct trial_options *options, double scale)
{
    if (search->roles.position >= 0 && !options->keep_positions)
        refine(search, search->roles.position, false, scale * first_place, last_place);
    for (int i = 0; i < search->roles.n_inner; i++)
        refine(search, search->roles.inner[i], true, scale * first_step, last_step);
}

static void scan(struct search *search, const struct trial_options *options, struct bf_error *err)
{
    double p[BEAM_EFFECT_PARAMETERS];
    base_point(search, p);
    if (trial_force_place(&search->force, p, err) != BF_OK)
        return;
    if (search->roles.n_inner == 0)
        keep_best(search, attempt(search, p));
    for (int i = 0; i < search->roles.n_inner; i++)
        scan_inner(search, search->roles.inner[i]);
    if (search->roles.position >= 0 && !options->keep_positions)
        scan_places(search, err);
    if (search->best.fall > 0.0)
        refine_all(search, options, 1.0);
}

/* ---- One motion: from the best point to an answer ---- */

/* The response of the best point into rows. */
static enum bf_status best_rows(struct search *search, struct bf_error *err)
{
    return trial_force_rows(&search->force, search->best.p, search->rows, err);
}

/* ‖x‖², x[m] weighted by the motion's own weights, in the search's measure. */
static double measured(const struct search *search, const double x[])
{
    const struct motion *motion = search->motion;
    double sum = 0.0;
    for (size_t c = 0; c < motion->n_channels; c++) {
        const struct predict_channel *channel = &motion->channels[c];
        double ratio = motion->weight[c] > 0.0 ? search->measure[c] / motion->weight[c] : 0.0;
        for (size_t k = channel->row; k < channel->row + channel->n; k++)
            sum += ratio * ratio * x[k] * x[k];
    }
    for (size_t k = search->regression->n_rows; k < search->regression->m; k++)
        sum += x[k] * x[k];
    return sum;
}

static enum bf_status answer(struct search *search, struct trial *out, struct bf_error *err)
{
    const struct regression *regression = search->regression;
    const struct motion *motion = search->motion;
    out->forces += search->force.evaluations;
    out->possible = search->best.fall > 0.0;
    out->chi_square_baseline = out->chi_square = measured(search, regression->left);
    out->p_value = 1.0;
    out->strength = out->strength_sd = out->share = 0.0;
    memcpy(out->theta, motion->theta, motion->n_parameters * sizeof(double));
    out->unexplained = sqrt(out->chi_square / (double)regression->n_rows);
    if (!out->possible)
        return BF_OK;
    enum bf_status status = best_rows(search, err);
    if (status != BF_OK)
        return status;
    memcpy(out->p, search->best.p, sizeof out->p);
    out->strength = out->p[search->roles.strength];
    regression_move(regression, motion, search->rows, out->theta);
    regression_project(regression, search->rows, search->s, NULL);
    for (size_t i = 0; i < regression->m; i++)
        search->s[i] = regression->left[i] - search->s[i];
    out->chi_square = measured(search, search->s);
    out->share = fmax(0.0, 1.0 - out->chi_square / out->chi_square_baseline);
    out->unexplained = sqrt(out->chi_square / (double)regression->n_rows);
    double left = fmax(regression->chi_square - search->best.fall, 1e-300);
    double variance = left / regression_effective(regression, motion, search->s);
    out->strength_sd = fabs(out->strength) * sqrt(variance / search->best.norm2) / fabs(search->best.factor);
    out->p_value = chi_square_tail(search->best.fall / variance, 1.0);
    return BF_OK;
}

static enum bf_status first_round(const struct motion *motion, const struct regression *regression,
                                  const struct beam_effect *effect, const struct trial_options *options,
                                  struct trial *out, struct bf_error *err)
{
    struct search search;
    *out = (struct trial){.effect = effect};
    out->theta = bf_alloc(motion->n_parameters, sizeof(double));
    enum bf_status status = search_new(motion, regression, effect, &search, err);
    if (status != BF_OK)
        return status;
    scan(&search, options, err);
    status = answer(&search, out, err);
    search_free(&search);
    return status;
}

/* ---- Renewal of θ and the motion ---- */

/* The motion at out->theta with the force of out->p in it, and the search from there. */
static enum bf_status search_again(struct motion *motion, const double measure[], const struct trial_options *options,
                                   struct trial *out, struct bf_error *err)
{
    struct regression regression;
    struct search search;
    enum bf_status status = search_new(motion, NULL, out->effect, &search, err);
    if (status != BF_OK)
        return status;
    search.measure = measure;
    status = trial_force_assume(&search.force, motion, out->p, RENEWALS, err);
    if (status == BF_OK)
        status = regression_new(motion, &regression, err);
    if (status == BF_OK) {
        search_bind(&search, &regression);
        memcpy(search.best.p, out->p, sizeof out->p);
        keep_best(&search, attempt(&search, out->p));
        if (search.best.fall > 0.0)
            refine_all(&search, options, 0.5);
        if (search.best.fall > 0.0)
            status = answer(&search, out, err);
        regression_free(&regression);
    }
    search_free(&search);
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

bool trial_possible(const struct beam_effect *effect)
{
    return effect->law != NULL && effect->law_place != NULL;
}

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
 * motion without the force may be misled, the renewed motion decides. Adds one or two to list[*n].
 */
static enum bf_status candidates(const struct motion *motion, const struct regression *regression,
                                 const struct beam_effect *effect, const struct trial_options *options,
                                 struct trial list[], size_t *n, struct bf_error *err)
{
    const struct trial_options at_start = {.rounds = options->rounds, .keep_positions = true};
    bool has_place = false;
    for (int k = 0; k < effect->n_parameters; k++)
        has_place = has_place || (effect->parameters[k].flags & BEAM_PARAMETER_POSITION) != 0;
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

static bool in_model(const struct model *model, const struct beam_effect *effect)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (model->effects[e].effect == effect)
            return true;
    return false;
}

enum bf_status trial_all(const struct motion *motion, const struct trial_options *options, struct trial **out,
                         size_t *n, struct bf_error *err)
{
    const struct beam_effect **effects = bf_alloc((size_t)beam_effects_count, sizeof *effects);
    struct trial *list = bf_alloc(2 * (size_t)beam_effects_count, sizeof *list);
    size_t count = 0;
    for (int e = 0; e < beam_effects_count; e++)
        if (trial_possible(beam_effects[e]) && !in_model(transfer_model(motion->predictor), beam_effects[e]))
            effects[count++] = beam_effects[e];
    enum bf_status status = try_effects(motion, effects, count, options, list, n, err);
    free(effects);
    if (status != BF_OK) {
        free(list);
        return status;
    }
    *out = list;
    return BF_OK;
}
