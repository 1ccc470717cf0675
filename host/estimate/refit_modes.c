/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A model fitted to measured modes: to poles and residues, not to samples. It takes milliseconds, and a frequency that is off pulls by as much as it is off: there is no
 * phase that could lock in to a wrong cycle.
 *
 *   r = [ (ln|p| − ln|p_k|)/σ_f ;  (ln ζ − ln ζ_k)/σ_ζ ;  (R − R_k)/(σ_R size_k) for each path ;  priors ]
 *
 * Measured modes and the model's are paired in order of frequency; the pairs are made anew in each round.
 */
#include "estimate.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "fit_problem.h"

/* All that is set by hand. */
static const struct modal_errors {
    double frequency, damping,
        residue;  /* relative: what a good model may differ by for other reasons, as a rig's errors */
    double small; /* of the rms of a path's residues: what a residue may be off by that is small itself */
    double
        unseen; /* ln of a frequency: a measured mode is rather left without one of the model's than with one so far away */
    double lacking; /* standard errors of a frequency: what such a mode counts */
    double rebase;  /* a move of an unknown that asks for another reduced space */
} limits = {
    .frequency = 1e-3, .damping = 0.05, .residue = 0.1, .small = 0.1, .unseen = 0.7, .lacking = 10.0, .rebase = 0.1};
enum { SILENT = 16, SPLINES = 48, ITERATIONS = 12, ROUNDS = 8, ROUGH_ROUNDS = 1 };
static const double above = 1.3; /* times the highest measured mode: up to there the model's modes are made */

struct modal_fit {
    double frequency, damping; /* standard errors */
    int rounds;
    const struct measured_modes *modes;
    struct model *model;
    struct record silence;
    const char **names;
    struct parameter_ref *refs;
    size_t n_refs;
    struct predictor *predictor;
    struct fit_problem p;   /* unknowns, bounds and priors; no rows of its own */
    bool based;             /* the predictor has a base */
    size_t n_order, *order; /* of the model's poles by size */
    size_t *mode;           /* [modes->n] which of these; SIZE_MAX: none */
    size_t n_paths, n_rows;
    double *scale; /* [modes->n][n_paths] of each residue, unit of it; 0: it does not count */
    double *r, *J; /* [n_rows], [n_unknowns][n_rows] */
    double complex *d;
};

/* ---- Which belongs to which ---- */

static void sort_poles(struct modal_fit *w)
{
    free(w->order);
    w->n_order = transfer_poles_by_size(w->predictor, &w->order);
}

/* In order, by the least Σ |ln f − ln f_k|, a mode that is left out on either side at the price of `unseen`. */
static void pair_modes(struct modal_fit *w)
{
    const double complex *p;
    sort_poles(w);
    const size_t n_model = w->n_order, n = w->modes->n, stride = n_model + 1;
    double *cost = bf_alloc((n + 1) * stride, sizeof *cost);
    (void)transfer_poles(w->predictor, &p);
    for (size_t i = 0; i <= n; i++)
        for (size_t k = 0; k <= n_model; k++) {
            /* above the last measured mode the model has as many as it likes */
            const double skip = i < n ? limits.unseen : 0.0;
            double least = i == 0 && k == 0 ? 0.0 : HUGE_VAL;
            if (i > 0)
                least = fmin(least, cost[(i - 1) * stride + k] + limits.unseen);
            if (k > 0)
                least = fmin(least, cost[i * stride + k - 1] + skip);
            if (i > 0 && k > 0)
                least = fmin(least, cost[(i - 1) * stride + k - 1] +
                                        fabs(log(cabs(w->modes->pole[i - 1]) / cabs(p[w->order[k - 1]]))));
            cost[i * stride + k] = least;
        }
    for (size_t i = n, k = n_model; i > 0;) {
        const double here = cost[i * stride + k];
        if (k > 0 && here >= cost[i * stride + k - 1] + (i < n ? limits.unseen : 0.0))
            k--;
        else if (k > 0 && here < cost[(i - 1) * stride + k] + limits.unseen)
            w->mode[--i] = --k;
        else
            w->mode[--i] = SIZE_MAX;
    }
    free(cost);
}

/* ---- Rows ---- */

static double complex measured_residue(const struct modal_fit *w, size_t k, size_t path)
{
    return w->modes->residue[k * w->n_paths + path];
}

static void find_scales(struct modal_fit *w, double sharpness)
{
    for (size_t path = 0; path < w->n_paths; path++) {
        double square = 0.0, known = 0.0;
        for (size_t k = 0; k < w->modes->n; k++) {
            const double size = measured_modes_weight(w->modes, w->model, k, path) * cabs(measured_residue(w, k, path));
            if (isfinite(size))
                square += size * size, known += 1.0;
        }
        for (size_t k = 0; k < w->modes->n; k++) {
            const double size = cabs(measured_residue(w, k, path));
            const double least =
                limits.small * sqrt(square / fmax(known, 1.0)) / measured_modes_weight(w->modes, w->model, k, path);
            w->scale[k * w->n_paths + path] = isfinite(size) ? limits.residue / sharpness * hypot(size, least) : 0.0;
        }
    }
}

/* A mode that the model lacks: its residues are left. */
static void fill_lacking(struct modal_fit *w, size_t k, size_t row)
{
    w->r[row] = limits.lacking * limits.frequency / w->frequency;
    for (size_t path = 0; path < w->n_paths; path++) {
        const double scale = w->scale[k * w->n_paths + path];
        if (!(scale > 0.0))
            continue;
        const double complex left = measured_residue(w, k, path) / scale;
        w->r[row + 2 + 2 * path] = creal(left), w->r[row + 3 + 2 * path] = cimag(left);
    }
}

/* As records with this clock show a pole or a residue. */
struct clock {
    double value;
    const double *by; /* [n_refs] */
};

static struct clock clock_of(const struct modal_fit *w)
{
    struct clock clock;
    clock.value = transfer_clock(w->predictor, &clock.by);
    return clock;
}

static double complex shown_change(const struct clock *clock, double complex x, double complex dx, size_t parameter)
{
    return clock->value * dx + clock->by[parameter] * x;
}

/* The frequency and the damping of one measured mode. */
static void fill_pole(struct modal_fit *w, size_t k, size_t row, size_t pole, bool derivatives)
{
    const struct fit_problem *p = &w->p;
    const struct clock clock = clock_of(w);
    const double complex *poles, measured = w->modes->pole[k];
    (void)transfer_poles(w->predictor, &poles);
    const double complex s = clock.value * poles[pole];
    const double damping = fmax(-creal(s) / cabs(s), 1e-9);
    w->r[row] = log(cabs(s) / cabs(measured)) / w->frequency;
    w->r[row + 1] = log(damping * cabs(measured) / -creal(measured)) / w->damping;
    for (size_t i = 0; i < p->n_unknowns && derivatives; i++) {
        const size_t j = p->unknowns[i].ref;
        const double complex *d = transfer_pole_derivative(w->predictor, j);
        const double complex ds = shown_change(&clock, poles[pole], d != NULL ? d[pole] : 0.0, j);
        const double relative = creal(ds / s), slope = fit_problem_slope(p, i, p->at);
        w->J[i * w->n_rows + row] = slope * relative / w->frequency;
        w->J[i * w->n_rows + row + 1] = creal(s) < 0.0 ? slope * (creal(ds) / creal(s) - relative) / w->damping : 0.0;
    }
}

/* The real and imaginary part of each residue. */
static void fill_residues(struct modal_fit *w, size_t k, size_t row, size_t pole, bool derivatives)
{
    const struct fit_problem *p = &w->p;
    const struct clock clock = clock_of(w);
    const size_t n_inputs = w->model->n_inputs;
    for (size_t path = 0; path < w->n_paths; path++) {
        const double scale = w->scale[k * w->n_paths + path];
        const size_t at = row + 2 * path;
        if (!(scale > 0.0))
            continue;
        const double complex R =
            transfer_residue(w->predictor, p->theta, path / n_inputs, path % n_inputs, pole, derivatives ? w->d : NULL);
        const double complex off = (clock.value * R - measured_residue(w, k, path)) / scale;
        w->r[at] = creal(off), w->r[at + 1] = cimag(off);
        for (size_t i = 0; i < p->n_unknowns && derivatives; i++) {
            const size_t j = p->unknowns[i].ref;
            const double complex slope = fit_problem_slope(p, i, p->at) / scale * shown_change(&clock, R, w->d[j], j);
            w->J[i * w->n_rows + at] = creal(slope), w->J[i * w->n_rows + at + 1] = cimag(slope);
        }
    }
}

/* Of one measured mode, from `row` on. */
static void fill_mode(struct modal_fit *w, size_t k, size_t row, bool derivatives)
{
    if (w->mode[k] >= w->n_order) {
        fill_lacking(w, k, row);
        return;
    }
    fill_pole(w, k, row, w->order[w->mode[k]], derivatives);
    fill_residues(w, k, row + 2, w->order[w->mode[k]], derivatives);
}

static void fill(struct modal_fit *w, const double x[], bool derivatives)
{
    struct fit_problem *p = &w->p;
    memset(w->r, 0, w->n_rows * sizeof *w->r);
    if (derivatives)
        memset(w->J, 0, w->n_rows * p->n_unknowns * sizeof *w->J);
    memcpy(p->at, x, p->n_unknowns * sizeof *x);
    sort_poles(w);
    for (size_t k = 0; k < w->modes->n; k++)
        fill_mode(w, k, k * (2 + 2 * w->n_paths), derivatives);
    for (size_t i = 0; i < p->n_unknowns; i++) { /* the last rows are those of the priors */
        const struct unknown *u = &p->unknowns[i];
        const size_t row = w->n_rows - p->n_unknowns + i;
        if (!(u->prior > 0.0))
            continue;
        w->r[row] = (x[i] - u->prior_x) / u->prior;
        if (derivatives)
            w->J[i * w->n_rows + row] = 1.0 / u->prior;
    }
}

static enum bf_status run(struct modal_fit *w, const double x[], bool derivatives, struct bf_error *err)
{
    struct prediction y;
    struct fit_problem *p = &w->p;
    if (!w->based)
        return bf_fail(err, BF_NUMERIC, "the model cannot be evaluated here");
    fit_problem_to_theta(p, x, p->theta);
    const enum bf_status status = predictor_run(w->predictor, p->theta, derivatives ? p->want : NULL, &y, err);
    if (status == BF_OK)
        fill(w, x, derivatives);
    return status;
}

/* A predictor without a base cannot run: after a failure it is the last one's again, if there was one. */
static enum bf_status rebase(struct modal_fit *w, const double x[], struct bf_error *err)
{
    struct fit_problem *p = &w->p;
    struct bf_error ignored;
    fit_problem_to_theta(p, x, p->theta);
    const enum bf_status status = predictor_rebase(w->predictor, p->theta, err);
    if (status == BF_OK) {
        memcpy(p->base, x, p->n_unknowns * sizeof *x);
        w->based = true;
    } else if (w->based) {
        fit_problem_to_theta(p, p->base, p->theta);
        w->based = predictor_rebase(w->predictor, p->theta, &ignored) == BF_OK;
    }
    return status;
}

/* ---- The search ---- */

static enum bf_status value(void *context, const double x[], double *half_square, struct bf_error *err)
{
    struct modal_fit *w = context;
    const enum bf_status status = run(w, x, false, err);
    *half_square = 0.5 * dense_dot(w->n_rows, w->r, w->r);
    return status;
}

static enum bf_status derivative(void *context, const double x[], double *half_square, double gradient[], double gram[],
                                 struct bf_error *err)
{
    struct modal_fit *w = context;
    const size_t n = w->p.n_unknowns;
    enum bf_status status = fit_problem_moved(&w->p, x) > limits.rebase ? rebase(w, x, err) : BF_OK;
    if (status == BF_OK)
        status = run(w, x, true, err);
    *half_square = 0.5 * dense_dot(w->n_rows, w->r, w->r);
    dense_gram(w->n_rows, n, w->J, gram);
    dense_gemv(true, w->n_rows, n, 1.0, w->J, w->r, 0.0, gradient);
    return status;
}

/* Silence on all channels, over a band that reaches above what was measured. */
static void make_silence(struct modal_fit *w)
{
    const double nothing[SILENT] = {0.0};
    const double highest_rad = cabs(w->modes->pole[w->modes->n - 1]);
    w->silence = (struct record){.n = SILENT, .dt_s = M_PI / (above * highest_rad), .path = bf_strdup("modes")};
    for (size_t i = 0; i < w->model->n_inputs; i++)
        record_add_column(&w->silence, w->model->inputs[i].name, nothing);
    for (size_t o = 0; o < w->model->n_outputs; o++)
        record_add_column(&w->silence, w->model->outputs[o].name, nothing);
    record_add_meta(&w->silence, "excitation", RECORD_RESPONSE);
}

static void close_fit(struct modal_fit *w)
{
    fit_problem_free(&w->p);
    predictor_free(w->predictor);
    record_free(&w->silence);
    free(w->names), free(w->refs), free(w->order), free(w->mode), free(w->scale), free(w->r), free(w->J), free(w->d);
}

static enum bf_status open_fit(struct modal_fit *w, const struct predict_options *predict, double sharpness,
                               struct bf_error *err)
{
    struct predict_options options = *predict;
    options.fine_splines = SPLINES, options.quiet = true, options.threads = 1;
    make_silence(w);
    w->names = record_base_names(&w->silence, 1);
    w->n_refs = model_parameters(w->model, w->names, 1, &w->refs);
    double *ones = bf_alloc(w->model->n_outputs + 1, sizeof *ones);
    for (size_t o = 0; o < w->model->n_outputs; o++)
        ones[o] = 1.0;
    enum bf_status status = predictor_new(w->model, &w->silence, 1, &options, &w->predictor, err);
    if (status == BF_OK)
        status =
            fit_problem_new(&w->p, w->model, w->predictor, &w->silence, 1, w->names, w->refs, w->n_refs, ones, err);
    free(ones);
    if (status != BF_OK)
        return status;
    const size_t n = w->modes->n;
    w->n_paths = w->model->n_inputs * w->model->n_outputs;
    w->n_rows = n * (2 + 2 * w->n_paths) + w->p.n_unknowns;
    w->mode = bf_alloc(n, sizeof *w->mode);
    w->scale = bf_alloc(n * w->n_paths + 1, sizeof *w->scale);
    w->r = bf_alloc(w->n_rows, sizeof *w->r);
    w->J = bf_alloc(w->n_rows * w->p.n_unknowns + 1, sizeof *w->J);
    w->d = bf_alloc(w->n_refs + 1, sizeof *w->d);
    find_scales(w, sharpness);
    return BF_OK;
}

static enum bf_status search(struct modal_fit *w, double x[], double *half_square, struct bf_error *err)
{
    const struct least_squares view = {.n = w->p.n_unknowns,
                                       .lower = w->p.lower,
                                       .upper = w->p.upper,
                                       .context = w,
                                       .value = value,
                                       .derivative = derivative};
    const struct optimise_options options = {.iterations = ITERATIONS, .tolerance = 0.1, .relative = 1e-2};
    struct optimise_result found = {0};
    enum bf_status status = BF_OK;
    for (int round = 0; round < w->rounds && status == BF_OK; round++) {
        fit_problem_rescale(&w->p, x); /* a strength may be far larger than its start */
        status = rebase(w, x, err);
        if (status == BF_OK)
            status = run(w, x, false, err);
        if (status != BF_OK)
            break;
        pair_modes(w);
        status = optimise_local(&view, &options, x, &found, err);
        *half_square = found.half_square;
        if (found.end != OPTIMISE_ITERATIONS && fit_problem_moved(&w->p, x) < fit_problem_unmoved)
            break;
    }
    return status;
}

/* At the last run, next to the end. */
static void tell_residues(const struct modal_fit *w, double complex fitted[])
{
    const size_t n_inputs = w->model->n_inputs;
    const double clock = clock_of(w).value;
    for (size_t k = 0; k < w->modes->n; k++)
        for (size_t path = 0; path < w->n_paths; path++)
            fitted[k * w->n_paths + path] = w->mode[k] < w->n_order
                                                ? clock * transfer_residue(w->predictor, w->p.theta, path / n_inputs,
                                                                           path % n_inputs, w->order[w->mode[k]], NULL)
                                                : 0.0;
}

enum bf_status refit_to_modes(struct model *model, const struct measured_modes *modes,
                              const struct modal_options *options, double *left, struct bf_error *err)
{
    const double sharpness = options->sharpness > 0.0 ? options->sharpness : 1.0;
    struct modal_fit w = {.modes = modes,
                          .model = model,
                          .frequency = limits.frequency / sharpness,
                          .damping = limits.damping / sharpness,
                          .rounds = options->rough ? ROUGH_ROUNDS : ROUNDS};
    double half_square = HUGE_VAL;
    enum bf_status status = open_fit(&w, &options->predict, sharpness, err);
    if (status == BF_OK) {
        double *x = bf_alloc(w.p.n_unknowns + 1, sizeof *x), *theta = bf_alloc(w.n_refs + 1, sizeof *theta);
        for (size_t i = 0; i < w.n_refs; i++)
            theta[i] = w.refs[i].value;
        fit_problem_to_x(&w.p, theta, x);
        status = search(&w, x, &half_square, err);
        if (status == BF_OK) {
            fit_problem_to_theta(&w.p, x, theta);
            model_set_parameters(model, w.refs, w.n_refs, theta, NULL, w.names);
            *left = sqrt(2.0 * half_square / (double)w.n_rows) / sharpness;
            if (options->fitted != NULL)
                tell_residues(&w, options->fitted);
        }
        free(x), free(theta);
    }
    close_fit(&w);
    return status;
}
