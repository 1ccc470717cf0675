/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_best.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fit_starts.h"

static size_t lowest(const struct tried *tried)
{
    size_t best = 0;
    for (size_t k = 1; k < tried->n; k++)
        if (tried->half_square[k] < tried->half_square[best])
            best = k;
    return best;
}

/* Down from `start`; theta[n_refs] and *found: that end, where it is the lower one. */
static enum bf_status go_down(struct fit_problem *p, const struct staircase *stairs, const double start[],
                              double theta[], struct optimise_result *found, struct bf_error *err)
{
    struct optimise_result end;
    double *x = bf_alloc(p->n_unknowns + 1, sizeof *x);
    starts_to_x(p, start, x);
    const enum bf_status status = staircase_last(p, stairs, x, &end, err);
    if (!status && end.half_square < found->half_square) {
        fit_problem_to_theta(p, x, theta);
        *found = end;
    }
    free(x);
    return status == BF_NUMERIC ? BF_OK : status;
}

/* x[] of θ, the problem in the stage of whole records there. */
static enum bf_status whole_records(struct fit_problem *p, const double theta[], double x[], struct bf_error *err)
{
    starts_to_x(p, theta, x);
    return fit_problem_whole(p, x, err);
}

static bool none_below(const struct tried *tried, double half_square)
{
    for (size_t k = 0; k < tried->n; k++)
        if (!(tried->half_square[k] >= half_square)) /* NaN: not known yet */
            return false;
    return true;
}

enum bf_status best_of_tried(struct tried *tried, struct fit_problem *p, const struct staircase *stairs, double x[],
                             struct optimise_result *found, struct bf_error *err)
{
    if (p->n_unknowns == 0 || none_below(tried, found->half_square))
        return BF_OK;
    double *theta = tried_theta(p, x);
    enum bf_status status = tried_value(tried, p, err);
    const size_t best = lowest(tried);
    if (!status && !fit_problem_interrupted(p) && tried->half_square[best] < found->half_square)
        status = go_down(p, stairs, tried->theta + best * tried->n_refs, theta, found, err);
    if (!status)
        status = whole_records(p, theta, x, err);
    free(theta);
    return status;
}

enum bf_status best_raise_vanished(struct fit_problem *p, const struct staircase *stairs, double x[],
                                   struct optimise_result *found, struct bf_error *err)
{
    if (starts_none_vanished(p, x))
        return BF_OK;
    double *theta = tried_theta(p, x), *raised = tried_theta(p, x);
    enum bf_status status = starts_restore_vanished(p, raised, err);
    if (!status && memcmp(theta, raised, p->n_refs * sizeof *theta) != 0)
        status = go_down(p, stairs, raised, theta, found, err);
    if (!status || status == BF_NUMERIC)
        status = whole_records(p, theta, x, err);
    free(theta), free(raised);
    return status;
}

enum bf_status best_polish(struct fit_problem *p, double x[], double half_square, double *gain, struct bf_error *err)
{
    const struct least_squares view = fit_problem_view(p);
    const double before = fmax(fit_problem_moved(p, x), fit_problem_unmoved);
    double *given = bf_alloc(p->n_unknowns, sizeof *given), square = half_square;
    memcpy(given, x, p->n_unknowns * sizeof *given);
    enum bf_status status = optimise_polish(&view, 4, x, gain, err);
    if (!status && fit_problem_moved(p, x) > before) {
        status = fit_problem_rebase(p, x, err);
        if (!status && *gain > 0.0)
            status = view.value(view.context, x, &square, err);
        if (!status && *gain > 0.0 && square > half_square) {
            memcpy(x, given, p->n_unknowns * sizeof *given);
            *gain = 0.0;
            status = fit_problem_rebase(p, x, err);
        }
    }
    free(given);
    return status;
}
