/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "refit_law.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fit_stages.h"

static const double floor_share = 0.02;
static const double slower = 3.0; /* s of one window over that of the next */

static bool of_new_law(const struct fit_problem *p, size_t first_effect, size_t i)
{
    const struct parameter_ref *ref = &p->refs[p->unknowns[i].ref];
    return ref->role == ROLE_EFFECT && ref->owner >= first_effect && p->model->effects[ref->owner].effect->law;
}

bool law_is_new(const struct fit_problem *p, size_t first_effect)
{
    for (size_t i = 0; i < p->n_unknowns; i++)
        if (of_new_law(p, first_effect, i) && is_strength(effect_parameter(p, i)))
            return true;
    return false;
}

/*
 * θ of the longest window that the model without its new laws explains (to a floor), and the s of the
 * window after it. The first window counts even when it is not explained.
 */
static enum bf_status fit_without(struct fit_problem *p, size_t first_effect, double first_ps, double last_ps,
                                  const double theta0[], double theta[], double *next_ps, struct bf_error *err)
{
    static const double explained = 1.0; /* floors */
    double *x = bf_alloc(p->n_unknowns, sizeof *x);
    enum bf_status status = BF_OK;
    memcpy(theta, theta0, p->n_refs * sizeof *theta);
    for (size_t i = 0; i < p->n_unknowns; i++) {
        if (!of_new_law(p, first_effect, i))
            continue;
        fit_problem_hold(p, i, true);
        if (is_strength(effect_parameter(p, i)))
            theta[p->unknowns[i].ref] = effect_parameter(p, i)->neutral;
    }
    starts_to_x(p, theta, x);
    *next_ps = first_ps;
    for (double s = first_ps; s > last_ps && !status && !fit_problem_interrupted(p); s /= slower) {
        struct optimise_result found;
        status = staircase_step(p, s, 20, x, &found, err);
        if (status || (s < first_ps && staircase_misfit(p) > explained))
            break;
        fit_problem_to_theta(p, x, theta);
        *next_ps = s / slower;
    }
    for (size_t i = 0; i < p->n_unknowns; i++) {
        if (!of_new_law(p, first_effect, i))
            continue;
        fit_problem_hold(p, i, false);
        theta[p->unknowns[i].ref] = theta0[p->unknowns[i].ref];
    }
    free(x);
    return status;
}

static enum bf_status scan(struct fit_problem *p, size_t first_effect, size_t values, double decay_ps,
                           const double base[], struct starts *out, struct bf_error *err)
{
    double *theta = bf_alloc(p->n_refs, sizeof *theta), *x = bf_alloc(p->n_unknowns, sizeof *x);
    struct start_grid grid = start_grid_new(p, first_effect, p->model->n_effects, 2, true);
    memcpy(theta, base, p->n_refs * sizeof *theta);
    starts_to_x(p, theta, x);
    enum bf_status status = fit_problem_stage(p, decay_ps, floor_share, x, err);
    const size_t stride = (grid.n + values - 1) / values;
    for (size_t k = 0; k < grid.n && !status && !fit_problem_interrupted(p); k += stride) {
        double square;
        start_grid_at(&grid, p, k, theta);
        starts_to_x(p, theta, x);
        status = fit_problem_evaluate(p, x, false, &square, err);
        if (!status)
            starts_add(out, theta, square);
        else if (status == BF_NUMERIC)
            status = BF_OK; /* a size without a value is no start */
    }
    start_grid_free(&grid);
    free(theta), free(x);
    return status;
}

enum bf_status law_starts(struct fit_problem *p, size_t first_effect, size_t values, double first_ps, double last_ps,
                          const double theta0[], struct starts *out, double *scanned_ps, struct bf_error *err)
{
    double *base = bf_alloc(p->n_refs, sizeof *base);
    enum bf_status status = fit_without(p, first_effect, first_ps, last_ps, theta0, base, scanned_ps, err);
    if (!status)
        status = scan(p, first_effect, values, *scanned_ps, base, out, err);
    free(base);
    return status;
}
