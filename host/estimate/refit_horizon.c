/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "refit_horizon.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"
#include "fit_starts.h"

enum { SPAN = 16 };
static const double other_motion = 0.02; /* of the channel's rms: not the same motion any more */
static const double same_motion = 0.1;   /* of the noise: no difference that matters */

/* First row of a channel from which two predictions differ; n when they do not. difference: [n]. */
static size_t first_difference(const double difference[], size_t n, double sigma, double rms)
{
    const double limit = hypot(sigma, other_motion * rms);
    size_t crossing = n;
    for (size_t k = 0; k + SPAN <= n && crossing == n; k++)
        if (dense_norm(SPAN, difference + k) > limit * sqrt((double)SPAN))
            crossing = k;
    size_t first = crossing;
    while (crossing < n && 2 * first > crossing &&
           dense_norm(SPAN, difference + first) > same_motion * sigma * sqrt((double)SPAN))
        first--;
    return first;
}

static void take_horizons(struct fit_problem *p, const double other[], bool *any)
{
    double *difference = bf_alloc(p->n_rows, sizeof *difference);
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        const size_t row = channel->row, n = channel->n;
        for (size_t k = row; k < row + n; k++)
            difference[k] = p->fitted[k] - p->levels[channel->record] * other[k];
        const double rms = dense_norm(n, channel->measured) / sqrt((double)n);
        const size_t first = first_difference(difference + row, n, p->sigma[c], rms);
        if (first == n)
            continue;
        *any = true;
        p->horizon_s[channel->record] = fmin(p->horizon_s[channel->record], (double)first * channel->dt_s);
    }
    free(difference);
}

enum bf_status horizon_find(struct fit_problem *p, const struct predict_options *predict, const double theta[],
                            bool *any, struct bf_error *err)
{
    struct predict_options finer = *predict;
    struct predictor *predictor = NULL;
    struct prediction y;
    struct model model;
    double *x = bf_alloc(p->n_unknowns, sizeof *x), square;
    *any = false;
    finer.quiet = true;
    finer.oversample = 2 * predict_steps(p->model, predict);
    for (size_t r = 0; r < p->n_records; r++)
        p->horizon_s[r] = HUGE_VAL;
    starts_to_x(p, theta, x);
    enum bf_status status = model_copy(p->model, &model, err);
    if (!status) {
        model_set_parameters(&model, p->refs, p->n_refs, theta, NULL, p->names);
        status = predictor_new(&model, p->records, p->n_records, &finer, &predictor, err);
        model_free(&model);
    }
    if (!status)
        status = fit_problem_stage(p, 0.0, 0.0, x, err);
    if (!status)
        status = fit_problem_evaluate(p, x, false, &square, err);
    if (!status)
        status = predictor_run_solved(predictor, theta, &(struct predict_target){.weight = p->weight}, &y, err);
    if (!status)
        take_horizons(p, y.y, any);
    predictor_free(predictor);
    free(x);
    return status;
}
