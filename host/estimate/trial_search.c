/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The search of one effect's parameters along one motion: grids, refinement, and what comes out. */
#include "trial_search.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* Thresholds tried, in units of the largest motion; the last are as good as zero to most laws. */
static const double levels[] = {0.8, 0.5, 0.25, 0.1, 0.03, 0.01, 0.003, 0.001};
/* Of a parameter without a scale in the motion: multiples of the catalogue's start. */
static const double multiples[] = {0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0};
/* Places tried, as fractions of the span. */
static const double places[] = {0.08, 0.2, 0.35, 0.5, 0.65, 0.8, 1.0};
/* Refinement: steps in the logarithm of an inner parameter, in the span for a place. */
static const double first_step = 0.5, last_step = 0.1;
static const double first_place = 0.06, last_place = 0.015;
/* A force cannot be estimated when all but this part of its response (in power) is a combination of the baseline's columns. */
static const double collinear = 1e-7;
enum { MOST_TRIES = 8 };

void trial_search_bind(struct trial_search *search, const struct regression *regression)
{
    search->regression = regression;
    search->rows = bf_grow(search->rows, regression->n_rows + regression->m, sizeof(double));
    search->s = search->rows + regression->n_rows;
}

enum bf_status trial_search_new(const struct motion *motion, const struct regression *regression,
                                const struct beam_effect *effect, struct trial_search *out, struct bf_error *err)
{
    *out = (struct trial_search){.motion = motion, .measure = motion->weight};
    enum bf_status status = trial_force_new(motion, effect, &out->force, err);
    if (status == BF_OK)
        status = trial_roles(&out->force, &out->roles, err);
    if (status != BF_OK) {
        trial_force_free(&out->force);
        return status;
    }
    out->info = out->force.model.effects[out->force.effect].parameters;
    if (regression != NULL)
        trial_search_bind(out, regression);
    for (int k = 0; k < effect->n_parameters; k++)
        out->best.p[k] = out->info[k].value;
    return BF_OK;
}

void trial_search_free(struct trial_search *search)
{
    trial_force_free(&search->force);
    free(search->rows);
}

static double clipped(const struct parameter *info, double value)
{
    return fmax(info->min, fmin(info->max, value));
}

/* The factor by which the strength may go, nearest to the wanted one. */
static double allowed(const struct trial_search *search, const double p[], double factor)
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
static struct trial_point attempt(struct trial_search *search, const double p[])
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
    if (!(out.norm2 > collinear * norm * norm) || !(norm > 0.0))
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

static void keep_best(struct trial_search *search, struct trial_point point)
{
    if (point.fall > search->best.fall)
        search->best = point;
}

/* The best parameters so far with the strength of the catalogue's start, so that no factor compounds. */
static void base_point(const struct trial_search *search, double p[])
{
    memcpy(p, search->best.p, sizeof search->best.p);
    double factor = search->info[search->roles.strength].value / p[search->roles.strength];
    for (int k = 0; k < search->force.law.effect->n_parameters; k++)
        if (search->roles.with_strength[k] && search->best.fall > 0.0)
            p[k] *= factor;
}

static void scan_inner(struct trial_search *search, int slot)
{
    bool own = search->roles.scale[slot] == BEAM_LEVEL_OWN;
    size_t count = own ? sizeof multiples / sizeof *multiples : sizeof levels / sizeof *levels;
    double p[BEAM_EFFECT_PARAMETERS], unit = trial_unit(&search->force, &search->roles, slot);
    base_point(search, p);
    for (size_t i = 0; i < count; i++) {
        p[slot] = clipped(&search->info[slot], unit * (own ? multiples[i] : levels[i]));
        keep_best(search, attempt(search, p));
    }
}

/* Thresholds keep their ratio to the motion when the place changes. */
static void scan_places(struct trial_search *search, struct bf_error *err)
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
static void refine(struct trial_search *search, int slot, bool logarithmic, double step, double last)
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

static void refine_all(struct trial_search *search, const struct trial_options *options, double scale)
{
    if (search->roles.position >= 0 && !options->keep_positions)
        refine(search, search->roles.position, false, scale * first_place, last_place);
    for (int i = 0; i < search->roles.n_inner; i++)
        refine(search, search->roles.inner[i], true, scale * first_step, last_step);
}

/* The largest motion of the coordinate with the effect at this place, m or rad; 0: the effect cannot be there. */
static double motion_at(struct trial_search *search, double at_m, struct bf_error *err)
{
    double p[BEAM_EFFECT_PARAMETERS], w, v;
    memcpy(p, search->best.p, sizeof p);
    p[search->roles.position] = clipped(&search->info[search->roles.position], at_m);
    if (trial_force_place(&search->force, p, err) != BF_OK)
        return 0.0;
    trial_force_scales(&search->force, &w, &v);
    return w;
}

/* At the catalogue's place; where that is a support, which does not move, where the beam moves most. */
static void begin(struct trial_search *search, struct bf_error *err)
{
    static const double moves = 1e-2; /* times the largest motion */
    const int at = search->roles.position;
    if (at < 0)
        return;
    const double here = motion_at(search, search->best.p[at], err);
    double most = here, best = search->best.p[at];
    for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
        const double at_m = places[k] * search->force.model.length_m, there = motion_at(search, at_m, err);
        if (there > most)
            most = there, best = clipped(&search->info[at], at_m);
    }
    if (here < moves * most)
        search->best.p[at] = best;
}

void trial_search_scan(struct trial_search *search, const struct trial_options *options, struct bf_error *err)
{
    double p[BEAM_EFFECT_PARAMETERS];
    begin(search, err);
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
static enum bf_status best_rows(struct trial_search *search, struct bf_error *err)
{
    return trial_force_rows(&search->force, search->best.p, search->rows, err);
}

/* ‖x‖², x[m] weighted by the motion's own weights, in the search's measure. */
static double measured(const struct trial_search *search, const double x[])
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

enum bf_status trial_search_answer(struct trial_search *search, struct trial *out, struct bf_error *err)
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

void trial_search_resume(struct trial_search *search, const double p[BEAM_EFFECT_PARAMETERS],
                         const struct trial_options *options)
{
    memcpy(search->best.p, p, sizeof search->best.p);
    keep_best(search, attempt(search, p));
    if (search->best.fall > 0.0)
        refine_all(search, options, 0.5);
}
