/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * gradient_check.h — every column of the Jacobian against extrapolated differences of the prediction (Ridders: central
 * differences over a falling step, extrapolated by Neville, with an error estimate of their own). Include after cmocka.h.
 */
#ifndef GRADIENT_CHECK_H
#define GRADIENT_CHECK_H

#include "predict_case.h"
#include "signals.h"

enum { LEVELS = 12, CHANNELS = 3, SAMPLES = 192 };
static const double shrink = 1.4, linear_goal = 1e-8;

/* Worst relative deviation of a channel, and the reference's own error estimate there. */
struct deviation {
    double error, estimate;
};

/* The point of the derivative: the initial states. */
struct point {
    double *amplitude;
};

/* y + Σ amplitude · column. */
static inline void whole_prediction(const struct predict_case *c, const struct point *at, double y[])
{
    size_t rows = c->out.n_rows;
    memcpy(y, c->out.y, rows * sizeof *y);
    for (size_t k = 0; k < c->out.n_nuisance; k++) {
        const double *column = c->out.nuisance + k * rows;
        for (size_t i = 0; i < rows; i++)
            y[i] += at->amplitude[k] * column[i];
    }
}

/* A step may be too large for the model (a law that grows without bound): then a smaller one is taken. */
static inline bool predict_at(struct predict_case *c, const double direction[], double t, const struct point *at,
                              double y[])
{
    struct bf_error err;
    double *theta = bf_alloc(c->n, sizeof *theta);
    for (size_t i = 0; i < c->n; i++)
        theta[i] = c->theta[i] + t * direction[i];
    enum bf_status status = predictor_run(c->predictor, theta, NULL, &c->out, &err);
    free(theta);
    if (status == BF_OK)
        whole_prediction(c, at, y);
    return status == BF_OK;
}

static inline double channel_norm(const double a[], const double b[], size_t channel, size_t n)
{
    double sum = 0.0;
    for (size_t i = channel * n; i < (channel + 1) * n; i++)
        sum += (a[i] - (b != NULL ? b[i] : 0.0)) * (a[i] - (b != NULL ? b[i] : 0.0));
    return sqrt(sum);
}

/* best[rows] and its estimated error in each channel (2-norms), improved from a first step h. */
static inline void ridders(struct predict_case *c, const double direction[], const struct point *at, double h,
                           double best[], double estimate[CHANNELS])
{
    size_t rows = c->out.n_rows, n = rows / CHANNELS;
    double *table = bf_alloc((2 * LEVELS + 2) * rows, sizeof *table), *old = table + LEVELS * rows;
    double *up = old + LEVELS * rows, *down = up + rows;
    size_t level = 0;
    for (size_t step = 0; step < LEVELS; step++, h /= shrink) {
        memcpy(old, table, LEVELS * rows * sizeof *old);
        if (!predict_at(c, direction, h, at, up) || !predict_at(c, direction, -h, at, down)) {
            level = 0;
            continue;
        }
        for (size_t i = 0; i < rows; i++)
            table[i] = (up[i] - down[i]) / (2.0 * h);
        double factor = shrink * shrink;
        for (size_t j = 1; j <= level; j++, factor *= shrink * shrink) {
            double *now = table + j * rows;
            const double *left = now - rows, *before = old + (j - 1) * rows;
            for (size_t i = 0; i < rows; i++)
                now[i] = (factor * left[i] - before[i]) / (factor - 1.0);
            for (size_t ch = 0; ch < CHANNELS; ch++) {
                double e = fmax(channel_norm(now, left, ch, n), channel_norm(now, before, ch, n));
                if (e < estimate[ch]) {
                    estimate[ch] = e;
                    memcpy(best + ch * n, now + ch * n, n * sizeof *best);
                }
            }
        }
        level++;
    }
    free(table);
}

static inline bool has_kinks(const struct model *model)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (model->effects[e].effect->law != NULL || model->effects[e].effect->drive != NULL)
            return true;
    return false;
}

/* Column along a direction against the reference; J and y are of the run at c->theta. */
static inline struct deviation deviation_along(struct predict_case *c, const double direction[], const double J[],
                                               const double y[], const struct point *at)
{
    size_t rows = c->out.n_rows, n = rows / CHANNELS;
    double *column = bf_alloc(2 * rows, sizeof *column), *best = column + rows, estimate[CHANNELS];
    for (size_t j = 0; j < c->n; j++)
        for (size_t i = 0; i < rows; i++)
            column[i] += direction[j] * J[j * rows + i];
    for (size_t ch = 0; ch < CHANNELS; ch++)
        estimate[ch] = INFINITY;
    ridders(c, direction, at, 0.1, best, estimate);
    if (has_kinks(&c->model))
        ridders(c, direction, at, 1e-3, best, estimate); /* inside one piece */
    struct deviation worst = {0.0, 0.0};
    for (size_t ch = 0; ch < CHANNELS; ch++) {
        double size = fmax(channel_norm(best, NULL, ch, n), 1e-5 * channel_norm(y, NULL, ch, n));
        if (!(size > 0.0))
            size = 1.0;
        worst.error = fmax(worst.error, channel_norm(column, best, ch, n) / size);
        worst.estimate = fmax(worst.estimate, estimate[ch] / size);
    }
    free(column);
    return worst;
}

/*
 * A tenth of this is the largest step: enough to change y by a tenth where the parameter's range allows that, because the
 * rounding of y (not of the Jacobian) limits the reference.
 */
static inline double natural_scale(const struct predict_case *c, size_t i, const double J[], const double y[])
{
    const struct parameter_ref *ref = &c->refs[i];
    size_t rows = c->out.n_rows, n = rows / CHANNELS;
    double scale = INFINITY, size = fabs(c->theta[i]);
    for (size_t ch = 0; ch < CHANNELS; ch++)
        scale = fmin(scale, channel_norm(y, NULL, ch, n) / channel_norm(J + i * rows, NULL, ch, n));
    if (ref->role == ROLE_RESIDUAL)
        return isfinite(scale) ? scale : 1.0;
    if (ref->role == ROLE_EFFECT && c->model.effects[ref->owner].effect->parameters[ref->slot].role == BEAM_ROLE_PLACE)
        return 0.09; /* m: a tenth of it stays inside one element */
    size = size > 0.0 ? size : 1.0;
    if (ref->role == ROLE_LENGTH || ref->role == ROLE_PATCH_FROM || ref->role == ROLE_PATCH_TO)
        return 0.02 * size; /* a high mode turns far within a per cent of the length */
    return fmin(fmax(scale, size), 9.0 * size);
}

struct summary {
    struct deviation worst;
    char label[160];
    bool refused;
};

static inline void note(struct summary *s, const struct deviation *d, const char *label)
{
    if (d->error < s->worst.error)
        return;
    s->worst = *d;
    snprintf(s->label, sizeof s->label, "%s", label);
}

/* The Jacobian and y at the case's parameters, copied. */
static inline void run_at_point(struct predict_case *c, struct point *at, double **J, double **y)
{
    uint64_t seed = signal_seed(7);
    bool *want = bf_alloc(c->n, sizeof *want);
    memset(want, 1, c->n * sizeof *want);
    case_run(c, want);
    size_t rows = c->out.n_rows, unknowns = c->out.n_nuisance;
    at->amplitude = bf_alloc(unknowns, sizeof(double));
    for (size_t k = 0; k < unknowns; k++)
        at->amplitude[k] = 1e-3 * signal_normal(&seed);
    if (unknowns > 0) {
        predictor_set_nuisance(c->predictor, at->amplitude);
        case_run(c, want);
    }
    *J = bf_alloc((c->n + 1) * rows, sizeof(double));
    *y = *J + c->n * rows;
    memcpy(*J, c->out.jacobian, c->n * rows * sizeof(double));
    whole_prediction(c, at, *y);
    free(want);
}

/* Own parameters one by one (or all of them), and one random direction through everything of the beam. */
static inline struct summary check_case(struct predict_case *c, bool every_parameter)
{
    struct summary s = {.label = ""};
    uint64_t seed = signal_seed(5);
    struct point at;
    double *J, *y, *direction = bf_alloc(c->n, sizeof *direction);
    run_at_point(c, &at, &J, &y);
    for (size_t i = 0; i < c->n; i++) {
        if (!every_parameter && c->refs[i].role != ROLE_EFFECT)
            continue;
        direction[i] = natural_scale(c, i, J, y);
        struct deviation d = deviation_along(c, direction, J, y, &at);
        direction[i] = 0.0;
        note(&s, &d, c->refs[i].label);
    }
    for (size_t i = 0; i < c->n; i++) /* the beam's parameters act through the effect too */
        if (c->refs[i].role < ROLE_RESIDUAL)
            direction[i] = fabs(c->theta[i]) * (2.0 * signal_uniform(&seed) - 1.0);
    struct deviation d = deviation_along(c, direction, J, y, &at);
    note(&s, &d, "all of the beam's");
    free(at.amplitude);
    free(J);
    free(direction);
    return s;
}

#endif
