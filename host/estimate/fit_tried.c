/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_tried.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fit_starts.h"

void tried_add(struct tried *tried, const struct fit_problem *p, const double theta[])
{
    const size_t n = tried->n, n_refs = p->n_refs;
    tried->n_refs = n_refs;
    tried->theta = bf_grow(tried->theta, (n + 1) * n_refs, sizeof *tried->theta);
    tried->half_square = bf_grow(tried->half_square, n + 1, sizeof *tried->half_square);
    memcpy(tried->theta + n * n_refs, theta, n_refs * sizeof *theta);
    tried->half_square[n] = nan("");
    tried->n++;
}

double *tried_theta(const struct fit_problem *p, const double x[])
{
    double *theta = bf_alloc(p->n_refs, sizeof *theta);
    memcpy(theta, p->theta, p->n_refs * sizeof *theta);
    fit_problem_to_theta(p, x, theta);
    return theta;
}

void tried_add_x(struct tried *tried, const struct fit_problem *p, const double x[])
{
    double *theta = tried_theta(p, x);
    tried_add(tried, p, theta);
    free(theta);
}

void tried_free(struct tried *tried)
{
    free(tried->theta), free(tried->half_square);
    *tried = (struct tried){0};
}

enum bf_status tried_value(struct tried *tried, struct fit_problem *p, struct bf_error *err)
{
    double *x = bf_alloc(p->n_unknowns + 1, sizeof *x);
    enum bf_status status = BF_OK;
    for (size_t k = 0; k < tried->n && !status && !fit_problem_interrupted(p); k++) {
        double *value = &tried->half_square[k];
        if (!isnan(*value))
            continue;
        starts_to_x(p, tried->theta + k * tried->n_refs, x);
        const struct least_squares view = fit_problem_view(p);
        status = fit_problem_whole(p, x, err);
        if (!status)
            status = view.value(view.context, x, value, err);
        if (status || !isfinite(*value))
            *value = HUGE_VAL;
        if (status == BF_NUMERIC) /* a point without a value is no rival */
            status = BF_OK;
    }
    free(x);
    return status;
}
