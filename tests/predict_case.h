/* SPDX-License-Identifier: GPL-3.0-or-later */
/* predict_case.h — a record made in memory for the model of model_fixture.h, and a predictor on it. */
#ifndef PREDICT_CASE_H
#define PREDICT_CASE_H

#include <math.h>
#include <string.h>

#include "model_fixture.h"
#include "response/response.h"

struct predict_case {
    struct model model;
    struct record record;
    struct predictor *predictor;
    struct parameter_ref *refs;
    size_t n; /* parameters */
    double *theta;
    struct prediction out;
};

/* (1 + cos)/2 of half width `half_s` about `at_s`. */
static inline double case_bump(double t_s, double at_s, double half_s)
{
    double x = (t_s - at_s) / half_s;
    return fabs(x) < 1.0 ? 0.5 + 0.5 * cos(acos(-1.0) * x) : 0.0;
}

/* cos⁴ of the same support: four times smoother, so band limited at 1024 Hz for half_s ≥ 8 ms. */
static inline double case_smooth_bump(double t_s, double at_s, double half_s)
{
    double b = case_bump(t_s, at_s, half_s);
    return b * b;
}

/* A swept drive (V) inside a smooth window. */
static inline double case_drive(double t_s, double duration_s)
{
    double phase = 2.0 * acos(-1.0) * (8.0 * t_s + 0.5 * 150.0 / duration_s * t_s * t_s);
    return 30.0 * case_smooth_bump(t_s, 0.5 * duration_s, 0.5 * duration_s) * sin(phase);
}

static inline double case_hammer(double t_s, double level_N)
{
    return level_N * case_smooth_bump(t_s, 0.02, 0.012);
}

/* hammer_N, drive_V and three outputs whose samples are zero; inputs false: outputs only. */
static inline struct record case_record(const char *name, size_t n, double dt_s, double level_N, bool inputs)
{
    struct record r = {.path = strdup(name), .n = n, .dt_s = dt_s};
    double *x = bf_alloc(n, sizeof *x), *u = bf_alloc(n, sizeof *u), *zero = bf_alloc(n, sizeof *zero);
    for (size_t k = 0; k < n; k++) {
        x[k] = case_hammer((double)k * dt_s, level_N);
        u[k] = case_drive((double)k * dt_s, 0.8 * (double)n * dt_s);
    }
    if (inputs) {
        record_add_column(&r, "hammer_N", x);
        record_add_column(&r, "drive_V", u);
    } else {
        record_add_meta(&r, "excitation", "free_decay");
    }
    record_add_column(&r, "piezo_V", zero);
    record_add_column(&r, "accel_mps2", zero);
    record_add_column(&r, "tip_mps", zero);
    free(x);
    free(u);
    free(zero);
    return r;
}

/* The model's parameters as they are now; to be called again after a change of theta's source. */
static inline void case_parameters(struct predict_case *c)
{
    const char *name = c->record.path;
    c->n = model_parameters(&c->model, &name, 1, &c->refs);
    c->theta = bf_alloc(c->n, sizeof *c->theta);
    for (size_t i = 0; i < c->n; i++)
        c->theta[i] = c->refs[i].value;
}

/* c->model and c->record are set. */
static inline enum bf_status case_open(struct predict_case *c, const struct predict_options *options,
                                       struct bf_error *err)
{
    case_parameters(c);
    return predictor_new(&c->model, &c->record, 1, options, &c->predictor, err);
}

static inline void case_close(struct predict_case *c)
{
    predictor_free(c->predictor);
    free(c->refs);
    free(c->theta);
    record_free(&c->record);
    model_free(&c->model);
}

static inline void case_run(struct predict_case *c, const bool want[])
{
    struct bf_error err;
    if (predictor_run(c->predictor, c->theta, want, &c->out, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static inline size_t case_index(const struct predict_case *c, const char *label)
{
    for (size_t i = 0; i < c->n; i++)
        if (strcmp(c->refs[i].label, label) == 0)
            return i;
    fail_msg("no parameter %s", label);
    return 0;
}

#endif
