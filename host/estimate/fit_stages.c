/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_stages.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fit_phase.h"
#include "fit_starts.h"
#include "fit_tried.h"
#include "ground/ground.h"
#include "refit_horizon.h"

enum { STEP_ITERATIONS = 20 };
static const double floor_share = 0.02; /* of the windowed signal */

/* First frequency of a uniform beam with the mean EI and ρ, Hz: (λ²/2π) √(EI/ρ)/ℓ². */
static double rough_first_Hz(const struct model *model)
{
    static const double lambda[] = {
        [SUPPORT_CLAMPED_FREE] = 1.8751,
        [SUPPORT_CLAMPED_CLAMPED] = 4.7300,
        [SUPPORT_PINNED_PINNED] = M_PI,
        [SUPPORT_FREE_FREE] = 4.7300,
    };
    double compliance = 0.0, mass = 0.0;
    for (size_t i = 0; i < model->n_regions; i++) {
        const struct material *m = model_material(model, model->regions[i].name);
        const double share = (model->regions[i].to_m - model->regions[i].from_m) / model->length_m;
        compliance += share / m->EI.value;
        mass += share * m->rho.value;
    }
    const double l = lambda[model->support];
    return l * l / (2.0 * M_PI) / sqrt(compliance * mass) / (model->length_m * model->length_m);
}

struct staircase staircase_for(const struct model *model, const struct record records[], size_t n_records)
{
    struct staircase s = {.first_ps = 4.5 * rough_first_Hz(model), .iterations = 40, .rounds = 6, .nats = 1e-4};
    double longest_dt_s = 0.0;
    for (size_t r = 0; r < n_records; r++) {
        s.longest_s = fmax(s.longest_s, (double)records[r].n * records[r].dt_s);
        longest_dt_s = fmax(longest_dt_s, records[r].dt_s);
    }
    s.first_ps = fmin(s.first_ps, 0.05 / longest_dt_s);
    return s;
}

static void say(struct progress *bar, double decay_ps, const struct staircase *stairs, const struct fit_problem *p)
{
    if (!bar)
        return;
    char note[64];
    const double span = log(fmax(stairs->first_ps * stairs->longest_s, 2.0));
    const double left = log(fmax(decay_ps * stairs->longest_s, 1.0)) / span;
    const double fraction = decay_ps > 0.0 ? 0.8 * (1.0 - left) : 0.9;
    snprintf(note, sizeof note, "window s = %.3g/s, misfit %.3g", p->decay_ps, sqrt(fit_problem_mean_square(p)));
    progress_update(bar, fraction, note);
}

/* Of ½Σr². A window weighs each row less than whole records do: what it leaves at its best, they leave at least. */
static double give_up_above(const struct fit_problem *p)
{
    return 0.5 * p->abandon_above * (double)p->n_used;
}

enum bf_status staircase_last(struct fit_problem *p, const struct staircase *stairs, double x[],
                              struct optimise_result *out, struct bf_error *err)
{
    fit_problem_rescale(p, x);
    static const double same_scale = 0.1;
    static const double half = 0.5; /* of ½‖r‖² */
    enum bf_status status = fit_problem_whole(p, x, err);
    int values = 0, derivatives = 0;
    const double limit = p->rebase_limit;
    /* A derivative of a law costs far more than a reduced space; made where it is taken, the space spares another round of derivatives. */
    if (stairs->gentle)
        p->rebase_limit = fit_problem_unmoved;
    for (int round = 0; round < stairs->rounds && !status; round++) {
        const double before = round > 0 ? out->half_square : 0.0;
        const size_t runs = p->runs;
        struct optimise_options options = {
            .iterations = stairs->iterations, .tolerance = 1e-4, .give_up_above = give_up_above(p)};
        fit_problem_end_within(p, stairs->nats, &options);
        const struct least_squares view = fit_problem_view(p);
        status = optimise_local(&view, &options, x, out, err);
        values += out->values, derivatives += out->derivatives;
        if (status || out->end == OPTIMISE_INTERRUPTED || out->end == OPTIMISE_GAVE_UP)
            break;
        if (out->half_square <=
            half * before) /* a round that halves the misfit does not count among the evaluations of a quick look */
            fit_problem_do_not_count(p, runs);
        const double scale = p->prior_scale;
        const bool moved = fit_problem_moved(p, x) >= fit_problem_unmoved,
                   unfinished = stairs->gentle && out->end == OPTIMISE_ITERATIONS;
        if (scale > 1.0)
            fit_problem_weigh_priors(p, x);
        if (!moved && !unfinished && fabs(p->prior_scale - scale) <= same_scale * scale)
            break;
        if (moved)
            status = fit_problem_pair(p, x, err);
    }
    p->rebase_limit = limit;
    out->values = values, out->derivatives = derivatives;
    return status;
}

/*
 * An early window only has to bring x to where the next converges, and a model that lacks something must not be driven
 * by the little it cannot explain: the floor caps the weights at a share of the signal.
 */
static enum bf_status step_until(struct fit_problem *p, double decay_ps, double enough, int iterations, double x[],
                                 struct optimise_result *out, struct bf_error *err)
{
    fit_problem_rescale(p, x);
    enum bf_status status = fit_problem_stage(p, decay_ps, floor_share, x, err);
    const struct optimise_options options = {
        .iterations = iterations, .tolerance = 1e-2, .relative = 1e-2, .enough = 0.5 * p->noise_rows * enough * enough};
    const struct least_squares view = fit_problem_view(p);
    if (!status)
        fit_problem_weigh_priors(p, x);
    if (!status)
        status = optimise_local(&view, &options, x, out, err);
    return status;
}

enum bf_status staircase_step(struct fit_problem *p, double decay_ps, int iterations, double x[],
                              struct optimise_result *out, struct bf_error *err)
{
    return step_until(p, decay_ps, 0.0, iterations, x, out, err);
}

/*
 * The iterations were over while one more step, of any length, still promised a good part of the misfit: the next window, begun from there, would
 * find a motion that is periods off (a strut near buckling).
 */
static bool is_on_its_way(const struct optimise_result *out)
{
    static const double good_part = 0.1; /* of ½‖r‖² */
    return out->end == OPTIMISE_ITERATIONS && out->decrement > good_part * out->half_square;
}

/* A window, and what it takes to its end while it is on its way: that does not count among the evaluations after which a quick look ends. */
static enum bf_status whole_step(struct fit_problem *p, double decay_ps, double x[], struct optimise_result *out,
                                 struct bf_error *err)
{
    enum { TIMES = 4 }; /* the usual iterations, at most */
    enum bf_status status = staircase_step(p, decay_ps, STEP_ITERATIONS, x, out, err);
    for (int k = 1; k < TIMES && !status && is_on_its_way(out); k++) {
        const size_t before = p->runs, most = p->most_runs;
        p->most_runs = 0;
        status = staircase_step(p, decay_ps, STEP_ITERATIONS, x, out, err);
        p->most_runs = most;
        fit_problem_do_not_count(p, before);
    }
    return status;
}

/* What is explained to below the floor can be stretched further. */
static double next_factor(double misfit)
{
    if (misfit < 0.5)
        return 30.0;
    return misfit < 1.0 ? 10.0 : 3.0;
}

double staircase_misfit(const struct fit_problem *p)
{
    double square = 0.0, rows = 0.0;
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        double largest = 0.0;
        for (size_t k = channel->row; k < channel->row + channel->n; k++)
            largest = fmax(largest, p->weight[k]);
        for (size_t k = channel->row; k < channel->row + channel->n; k++) {
            square += p->residual[k] * p->residual[k];
            rows += largest > 0.0 ? pow(p->weight[k] / largest, 2.0) : 0.0;
        }
    }
    return rows > 0.0 ? sqrt(square / rows) : 0.0;
}

/* A window down to the floor, and when that is explained, down to the noise: what comes next hangs on how well this is known. */
static enum bf_status careful_step(struct fit_problem *p, double decay_ps, double x[], struct optimise_result *out,
                                   double *misfit, struct bf_error *err)
{
    enum bf_status status = step_until(p, decay_ps, 1.0, STEP_ITERATIONS, x, out, err);
    *misfit = HUGE_VAL;
    if (status || out->end == OPTIMISE_INTERRUPTED)
        return status;
    *misfit = staircase_misfit(p);
    if (*misfit > 1.0)
        return BF_OK;
    status = fit_problem_stage(p, decay_ps, 0.0, x, err);
    const struct optimise_options options = {.iterations = 12, .tolerance = 0.5, .relative = 1e-4};
    const struct least_squares view = fit_problem_view(p);
    if (!status)
        fit_problem_weigh_priors(p, x);
    return status ? status : optimise_local(&view, &options, x, out, err);
}

/* Rows that cannot be predicted from p->explained are left out; x[] becomes that θ. *cut: there were some. */
static enum bf_status leave_out_unpredictable(struct fit_problem *p, const struct staircase *stairs, double x[],
                                              bool *cut, struct bf_error *err)
{
    *cut = false;
    if (!stairs->predict)
        return BF_OK;
    const enum bf_status status = horizon_find(p, stairs->predict, p->explained, cut, err);
    starts_to_x(p, p->explained, x);
    return status;
}

/* Windows of a nonlinear motion, each s of e^(−s t). */
struct windows {
    double s, factor;           /* the next one; that of the last one over it */
    double known, known_noises; /* the longest one explained, 0: the last one was not; what it left of the noise */
};

static const double usual_factor = 3.0, last_share = 0.7;

static bool is_window(const struct staircase *stairs, double s)
{
    return s * stairs->longest_s > last_share;
}

static void explained_until(struct fit_problem *p, struct windows *w, double s, const double x[])
{
    w->known = p->explained_ps = s;
    memcpy(p->explained, p->theta, p->n_refs * sizeof *p->explained);
    fit_problem_to_theta(p, x, p->explained);
}

/*
 * x explains the window that is known. Longer ones that it explains as it is need no step, and the next one is the longest that it predicts to
 * a fifth of the signal: Newton's steps converge from there. Cost: a prediction without derivatives for each, and one of the first that it does not.
 */
static enum bf_status look_ahead(struct fit_problem *p, const struct staircase *stairs, const double x[],
                                 struct windows *w, struct bf_error *err)
{
    static const double converges = 10.0; /* floors */
    enum bf_status status = BF_OK;
    double misfit = 0.0, square;
    for (double s = w->known / usual_factor; misfit <= converges && is_window(stairs, s); s /= usual_factor) {
        status = fit_problem_stage(p, s, floor_share, x, err);
        if (!status)
            status = fit_problem_evaluate(p, x, false, &square, err);
        if (status || fit_problem_interrupted(p))
            break;
        misfit = staircase_misfit(p);
        if (misfit <= 1.0)
            explained_until(p, w, s, x);
        if (misfit <= converges)
            w->s = misfit <= 1.0 ? s / usual_factor : s;
    }
    return status == BF_NUMERIC ? BF_OK : status; /* a motion without bound is not near */
}

/* A window has been left at x with this misfit, in floors: it is explained, or the next ones are taken as they come. */
static enum bf_status next_window(struct fit_problem *p, const struct staircase *stairs, const double x[],
                                  double misfit, struct windows *w, struct bf_error *err)
{
    const double s = w->s;
    w->known = 0.0;
    w->factor = misfit > 1.0 ? usual_factor : fmin(w->factor * w->factor, usual_factor);
    w->s /= w->factor;
    if (misfit > 1.0)
        return BF_OK;
    explained_until(p, w, s, x);
    return w->factor < usual_factor ? BF_OK : look_ahead(p, stairs, x, w, err);
}

/*
 * Windows for a nonlinear motion, whose phase drifts faster and which may jump from one branch to another. A window that is
 * not explained although the one before was: what cannot be predicted is left out, or it is tried again less long. When
 * even a little longer is not explained, it is the model that lacks something, and the rest is done in large steps.
 */
static enum bf_status careful_windows(struct fit_problem *p, const struct staircase *stairs, struct progress *bar,
                                      double x[], struct optimise_result *out, struct bf_error *err)
{
    static const double least = 1.15, misfit_growth = 2.0;
    int retries = 6;
    bool looked = false, cut;
    struct windows w = {.s = stairs->first_ps, .factor = usual_factor};
    double misfit, *trial = bf_alloc(p->n_unknowns, sizeof *trial);
    enum bf_status status = BF_OK;
    p->explained_ps = 0.0;
    for (size_t r = 0; r < p->n_records; r++)
        p->horizon_s[r] = HUGE_VAL;
    while (!status && is_window(stairs, w.s)) {
        fit_problem_rescale(p, x);
        memcpy(trial, x, p->n_unknowns * sizeof *trial);
        status = careful_step(p, w.s, trial, out, &misfit, err);
        if (status || out->end == OPTIMISE_INTERRUPTED)
            break;
        say(bar, w.s, stairs, p);
        const double noises = p->floor > 0.0 ? HUGE_VAL : staircase_misfit(p);
        if ((misfit > 1.0 || noises > misfit_growth * w.known_noises) && w.known > 0.0 && !looked) {
            status = leave_out_unpredictable(p, stairs, x, &cut, err);
            looked = true;
            if (cut)
                continue;
        }
        if (misfit > 1.0 && w.known > 0.0 && w.factor > least && retries-- > 0) {
            w.factor = sqrt(w.factor);
            w.s = w.known / w.factor;
            continue;
        }
        memcpy(x, trial, p->n_unknowns * sizeof *trial);
        w.known_noises = noises;
        status = next_window(p, stairs, x, misfit, &w, err);
    }
    free(trial);
    return status;
}

/* Given up in a window: x is judged by whole records, as every other end. */
static enum bf_status judge_whole(struct fit_problem *p, double x[], struct optimise_result *out, struct bf_error *err)
{
    enum bf_status status = fit_problem_whole(p, x, err);
    out->end = OPTIMISE_GAVE_UP;
    if (!status)
        status = fit_problem_evaluate(p, x, false, &out->half_square, err);
    phases_wrap(p, x);
    return status;
}

enum bf_status staircase_run(struct fit_problem *p, const struct staircase *stairs, struct progress *bar, double x[],
                             struct optimise_result *out, struct bf_error *err)
{
    double s = stairs->first_ps;
    enum bf_status status = BF_OK;
    const bool give_up =
        !phases_any(p, 0); /* a sinusoid, left out until the last stage, may explain what windows leave */
    phases_hold(p, x);
    if (stairs->gentle)
        status = careful_windows(p, stairs, bar, x, out, err);
    while (!status && !stairs->gentle && s * stairs->longest_s > 1.0) {
        status = whole_step(p, s, x, out, err);
        if (status || out->end == OPTIMISE_INTERRUPTED)
            return status;
        if (give_up && p->abandon_above > 0.0 && out->half_square > give_up_above(p))
            return judge_whole(p, x, out, err);
        const double misfit = sqrt(fit_problem_mean_square(p));
        if (stairs->tried)
            tried_add_x(stairs->tried, p, x);
        say(bar, s, stairs, p);
        s /= next_factor(misfit);
    }
    if (!status && phases_any(p, 0) && !fit_problem_interrupted(p))
        status = staircase_last(p, stairs, x, out,
                                err); /* lines are looked for in what the rest of the model leaves of whole records */
    if (!status && !fit_problem_interrupted(p))
        status = phases_find(p, x, err);
    if (!status && !fit_problem_interrupted(p))
        status = staircase_last(p, stairs, x, out, err);
    phases_wrap(p, x);
    say(bar, 0.0, stairs, p);
    return status;
}
