/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A few Gauss–Newton steps of baseline and effect together: what the first-order score cannot see. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fit_stages.h"
#include "score_refine.h"
#include "score_probe.h"

enum { STEPS = 8, LAST = 2, WINDOWS = 2 };
static const double window[WINDOWS] = {0.3, 0.03}; /* of the staircase's first decay */
static const double window_floor = 0.02;
static const double explained = 1.2; /* χ²/n below which no second descent is needed */
static const double weak = 9.0;      /* χ²/n of a baseline below which all minima of an effect leave about as much */
static const double far = 10.0;      /* times the lowest χ²: a factor of 3 in rms, worse than any rival */
static const double at_noise = 1.05; /* χ²/n that is the noise: 2.5 % of its rms above it */
static const double least_fall = 3e-3; /* a window ends when the misfit would fall by less than this share */
static const double as_promised =
    0.9; /* of the fall in χ² that the first order promises: a descent that takes it is the last */

enum bf_status score_model(const struct score_base *base, const struct candidate *candidate, const struct score *score,
                           struct model *out, struct bf_error *err)
{
    enum bf_status status = candidate_model(base->model, candidate, score->p, out, err);
    if (status)
        return status;
    struct parameter_ref *refs;
    const size_t n = model_parameters(out, base->names, base->n_records, &refs);
    for (size_t i = 0; i < n; i++) {
        if (score->theta && score->n_theta == n)
            refs[i].value = score->theta[i];
        else if (refs[i].role != ROLE_EFFECT)
            refs[i].value = base->start_theta[i]; /* the same order: the new effect's parameters come last */
        else if (refs[i].owner + 1 == out->n_effects && refs[i].record >= 0 && score->per_record)
            refs[i].value = score->per_record[refs[i].record];
    }
    double *value = bf_alloc(n, sizeof *value);
    for (size_t i = 0; i < n; i++)
        value[i] = refs[i].value;
    model_set_parameters(out, refs, n, value, NULL, base->names);
    free(value), free(refs);
    return BF_OK;
}

/* One candidate model, ready to move. */
struct mover {
    struct model model;
    struct predictor *predictor;
    size_t n_refs;
    struct parameter_ref *refs;
    struct fit_problem problem;
};

static void mover_free(struct mover *m)
{
    fit_problem_free(&m->problem);
    predictor_free(m->predictor);
    free(m->refs);
    model_free(&m->model);
}

static enum bf_status mover_new(const struct score_base *base, const struct candidate *c, const struct score *score,
                                struct mover *m, struct bf_error *err)
{
    *m = (struct mover){0};
    struct predict_options options = base->options.predict;
    options.threads = 1;
    options.quiet = true;
    enum bf_status status = score_model(base, c, score, &m->model, err);
    if (!status)
        status = predictor_new(&m->model, base->records, base->n_records, &options, &m->predictor, err);
    if (status)
        return status;
    m->n_refs = model_parameters(&m->model, base->names, base->n_records, &m->refs);
    return fit_problem_new(&m->problem, &m->model, m->predictor, base->records, base->n_records, base->names, m->refs,
                           m->n_refs, base->options.sigma, err);
}

/* One window of the staircase: x[n_unknowns] in/out. */
static enum bf_status step_window(struct fit_problem *p, double decay_ps, double floor, int steps, double reach,
                                  double give_up_above, double x[], double *half_square, struct bf_error *err)
{
    const struct optimise_options options = {.iterations = steps,
                                             .radius = reach,
                                             .radius_max = 4.0 * reach,
                                             .tolerance = 1e-2,
                                             .relative = least_fall,
                                             .give_up_above = give_up_above};
    const struct least_squares view = fit_problem_view(p);
    struct optimise_result result = {0};
    fit_problem_rescale(p, x);
    enum bf_status status = fit_problem_stage(p, decay_ps, floor, x, err);
    if (!status)
        fit_problem_weigh_priors(p, x);
    if (!status)
        status = optimise_local(&view, &options, x, &result, err);
    if (!status)
        *half_square = result.half_square;
    return status;
}

/* Where a descent begins and how. */
struct descent {
    bool windows; /* short windows first */
    double reach; /* trust radius in x */
    double share; /* of the score's strength; 0: the catalogue's start instead of the score's */
};
/*
 * Small steps keep weakly seen logarithms from vanishing in the early windows, large ones reach strong effects in few steps;
 * a tenth of the strength over whole records cannot end above the baseline's misfit. The catalogue's start is for effects
 * with two minima (a clamp that yields, or one that damps: the first order does not know which).
 */
static const struct descent descents[] = {{true, 1.0, 1.0}, {true, 6.0, 1.0}, {false, 1.0, 0.1}, {true, 1.0, 0.0}};

/* χ² below which this descent and all after it are not needed. */
static double enough_before(const struct score_base *base, const struct descent *descent)
{
    const double rows = (double)base->n_rows;
    if (descent->share > 0.0)
        return descent->windows ? explained * rows : base->white_misfit;
    return base->white_misfit < weak * rows ? explained * rows : HUGE_VAL;
}

/* theta[n_refs] is where it ends. */
static enum bf_status descend_from(struct mover *m, const struct score_base *base, const struct candidate *c,
                                   const struct descent *descent, int steps, double give_up_above, double theta[],
                                   double *half_square, struct bf_error *err)
{
    struct fit_problem *p = &m->problem;
    const double first_ps = staircase_for(base->model, base->records, base->n_records).first_ps;
    double *x = bf_alloc(p->n_unknowns + 1, sizeof *x);
    for (size_t i = 0; i < m->n_refs; i++) {
        const struct parameter_ref *ref = &m->refs[i];
        const bool own = ref->role == ROLE_EFFECT && ref->owner + 1 == m->model.n_effects;
        theta[i] = ref->value;
        if (own && descent->share <= 0.0)
            theta[i] = c->start[ref->slot];
        else if (own && c->role[ref->slot] == CANDIDATE_STRENGTH)
            theta[i] = descent->share * ref->value;
    }
    fit_problem_to_x(p, theta, x);
    enum bf_status status = BF_OK;
    const bool windows = descent->windows && !candidate_is_sinusoid(c); /* a phase needs whole records */
    for (size_t k = 0; k < WINDOWS && !status && windows; k++)
        status = step_window(p, window[k] * first_ps, window_floor, steps, descent->reach, 0.0, x, half_square, err);
    if (!status)
        status = step_window(p, 0.0, 0.0, LAST * steps, descent->reach, give_up_above, x, half_square, err);
    if (!status)
        fit_problem_to_theta(p, x, theta);
    free(x);
    return status;
}

static void keep(const struct mover *m, const double theta[], double chi_square, struct score *score)
{
    score->refined = true;
    score->chi_square = chi_square;
    score->n_theta = m->n_refs;
    score->theta = bf_grow(score->theta, m->n_refs, sizeof *score->theta);
    memcpy(score->theta, theta, m->n_refs * sizeof *theta);
    for (size_t i = 0; i < m->n_refs; i++) {
        const struct parameter_ref *ref = &m->refs[i];
        if (ref->role != ROLE_EFFECT || ref->owner + 1 != m->model.n_effects)
            continue;
        if (ref->record >= 0 && score->per_record)
            score->per_record[ref->record] = theta[i];
        else if (ref->record < 0)
            score->p[ref->slot] = theta[i];
    }
}

/* ---- The lowest χ² of all candidates ---- */

void lowest_begin(struct lowest_misfit *shared)
{
    pthread_mutex_init(&shared->lock, NULL);
    shared->lowest = INFINITY;
}

void lowest_end(struct lowest_misfit *shared)
{
    pthread_mutex_destroy(&shared->lock);
}

/* Takes the χ² at the end of a descent (INFINITY: none yet) and returns the lowest so far. */
static double lowest_update(struct lowest_misfit *shared, double chi_square)
{
    pthread_mutex_lock(&shared->lock);
    const double lowest = shared->lowest = fmin(shared->lowest, chi_square);
    pthread_mutex_unlock(&shared->lock);
    return lowest;
}

/* On a weak misfit an effect with one parameter is nearly a linear problem: every descent ends where the first does. */
static bool has_one_minimum(const struct score_base *base, const struct candidate *candidate)
{
    return base->white_misfit < weak * (double)base->n_rows && candidate->effect->n_parameters == 1;
}

static bool keeps_its_promise(const struct score_base *base, const struct score *score, double own)
{
    return base->white_misfit - own >= as_promised * score->LM;
}

static bool wants_descent(const struct score_base *base, const struct candidate *candidate, const struct score *score,
                          size_t k, double own, double lowest)
{
    if (k == 0)
        return true;
    if (keeps_its_promise(base, score, own))
        return false;
    if (base->options.stop_at_noise && lowest < at_noise * (double)base->n_rows)
        return false;
    if (descents[k].windows && has_one_minimum(base, candidate) && isfinite(own))
        return false;
    return own >= enough_before(base, &descents[k]);
}

enum bf_status score_descend(const struct score_base *base, const struct candidate *candidate, int steps,
                             struct lowest_misfit *shared, struct score *score, struct bf_error *err)
{
    if (!score->possible)
        return bf_fail(err, BF_USAGE, "effect %s has no score to refine: %s", candidate->effect->id, score->reason);
    struct mover m;
    enum bf_status status = mover_new(base, candidate, score, &m, err);
    double *theta = bf_alloc(m.n_refs + 1, sizeof *theta), *best = bf_alloc(m.n_refs + 1, sizeof *best);
    double own = INFINITY, lowest = lowest_update(shared, own);
    bool ready = status == BF_OK;
    for (size_t k = 0; k < sizeof descents / sizeof *descents && ready && (!status || status == BF_NUMERIC); k++) {
        double half_square;
        if (!wants_descent(base, candidate, score, k, own, lowest))
            continue;
        status = descend_from(&m, base, candidate, &descents[k], steps > 0 ? steps : STEPS,
                              isfinite(lowest) ? 0.5 * far * lowest : 0.0, theta, &half_square, err);
        if (!status && 2.0 * half_square < own) {
            own = 2.0 * half_square;
            memcpy(best, theta, m.n_refs * sizeof *best);
        }
        lowest = lowest_update(shared, own);
    }
    if (isfinite(own)) {
        status = BF_OK;
        keep(&m, best, own, score);
    }
    free(theta), free(best);
    mover_free(&m);
    return status;
}
