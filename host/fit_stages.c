/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_stages.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "progress.h"

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
    struct staircase s = {.first_ps = 4.5 * rough_first_Hz(model), .iterations = 40, .rounds = 6, .relative = 1e-4};
    double longest_dt_s = 0.0;
    for (size_t r = 0; r < n_records; r++) {
        s.longest_s = fmax(s.longest_s, (double)records[r].n * records[r].dt_s);
        longest_dt_s = fmax(longest_dt_s, records[r].dt_s);
    }
    s.first_ps = fmin(s.first_ps, 0.05 / longest_dt_s);
    return s;
}

static void say(struct progress *bar, double fraction, const struct fit_problem *p)
{
    if (!bar)
        return;
    char note[64];
    snprintf(note, sizeof note, "window s = %.3g/s, misfit %.3g", p->decay_ps, sqrt(fit_problem_mean_square(p)));
    progress_update(bar, fraction, note);
}

enum bf_status staircase_last(struct fit_problem *p, const struct staircase *stairs, double x[],
                              struct optimise_result *out, struct bf_error *err)
{
    static const double settled = 1e-3; /* the reduced space is exact to second order in this */
    fit_problem_rescale(p, x);
    enum bf_status status = fit_problem_stage(p, 0.0, 0.0, x, err);
    int values = 0, derivatives = 0;
    for (int round = 0; round < stairs->rounds && !status; round++) {
        const struct optimise_options options = {.iterations = stairs->iterations,
                                                 .tolerance = 1e-4,
                                                 .relative = stairs->relative / (double)p->n_rows,
                                                 .hopeless = 0.5 * p->abandon_above * (double)p->n_rows};
        const struct least_squares view = fit_problem_view(p);
        status = optimise_local(&view, &options, x, out, err);
        values += out->values, derivatives += out->derivatives;
        if (status || out->end == OPTIMISE_INTERRUPTED || out->end == OPTIMISE_HOPELESS ||
            fit_problem_moved(p, x) < settled)
            break;
        status = fit_problem_rebase(p, x, err);
    }
    out->values = values, out->derivatives = derivatives;
    return status;
}

/*
 * Early stages only need to bring x into the valley of the next one, and a model that lacks something must not be driven
 * by the little it cannot explain: the floor caps the weights at a share of the signal.
 */
enum bf_status staircase_step(struct fit_problem *p, double decay_ps, double floor, double x[],
                              struct optimise_result *out, struct bf_error *err)
{
    fit_problem_rescale(p, x);
    enum bf_status status = fit_problem_stage(p, decay_ps, floor, x, err);
    const struct optimise_options options = {.iterations = 20, .tolerance = 1e-2, .relative = 1e-2};
    const struct least_squares view = fit_problem_view(p);
    if (!status)
        status = optimise_local(&view, &options, x, out, err);
    return status;
}

/* What is explained to below the floor can be stretched further. */
static double next_factor(double misfit)
{
    if (misfit < 0.5)
        return 30.0;
    return misfit < 1.0 ? 10.0 : 3.0;
}

enum bf_status staircase_run(struct fit_problem *p, const struct staircase *stairs, struct progress *bar, double x[],
                             struct optimise_result *out, struct bf_error *err)
{
    static const double floor = 0.02;
    double s = stairs->first_ps;
    enum bf_status status = BF_OK;
    const double span = log(fmax(s * stairs->longest_s, 2.0));
    phases_hold(p, x);
    while (!status && s * stairs->longest_s > 1.0) {
        status = staircase_step(p, s, floor, x, out, err);
        if (status || out->end == OPTIMISE_INTERRUPTED)
            return status;
        const double misfit = sqrt(fit_problem_mean_square(p));
        say(bar, 0.8 * (1.0 - log(fmax(s * stairs->longest_s, 1.0)) / span), p);
        s /= stairs->gentle ? 3.0 : next_factor(misfit);
    }
    if (!status)
        status = phases_find(p, x, err);
    if (!status)
        status = staircase_last(p, stairs, x, out, err);
    say(bar, 0.9, p);
    return status;
}
