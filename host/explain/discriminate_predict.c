/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a rival predicts for an experiment, in units of the expected noise, and what is known of its parameters by now. */
#include "discriminate_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

static const double unseen_noise = 0.004; /* of the signal: a sensor that no record tells about */
static const double guess = 1e-3;  /* of a recorded signal: stands for a noise that cannot be seen, as in a fit */
static const double ridge = 1e-12; /* relative to a unit diagonal: keeps Cholesky alive on null directions */

/* ---- Prediction ---- */

static enum bf_status run(const struct discriminate_state *w, struct predictor *predictor, bool with_jacobian,
                          struct forecast *f, struct bf_error *err)
{
    const size_t n_channels = w->n_outputs + w->d->n_sensors, rows = n_channels * w->n;
    double *theta = bf_alloc(f->n_parameters, sizeof *theta);
    bool *want = bf_alloc(f->n_parameters, sizeof *want);
    struct prediction prediction;
    for (size_t i = 0; i < f->n_parameters; i++) {
        theta[i] = f->refs[i].value;
        want[i] = !f->refs[i].info->fixed;
    }
    enum bf_status status = predictor_run(predictor, theta, with_jacobian ? want : NULL, &prediction, err);
    if (!status && prediction.n_rows != rows)
        status = bf_fail(err, BF_NUMERIC, "the experiment predicts %zu samples, not %zu", prediction.n_rows, rows);
    for (size_t k = 0; !status && k < rows; k++)
        if (!isfinite(prediction.y[k]))
            status = bf_fail(err, BF_NUMERIC, "the prediction of an experiment is not finite");
    if (!status) {
        f->y = bf_alloc(rows, sizeof *f->y);
        memcpy(f->y, prediction.y, rows * sizeof *f->y);
    }
    if (!status && with_jacobian) {
        f->jacobian = bf_alloc(f->n_parameters * rows, sizeof *f->jacobian);
        for (size_t i = 0; i < f->n_parameters; i++) {
            if (!want[i])
                continue;
            memcpy(f->jacobian + i * rows, prediction.jacobian + i * rows, rows * sizeof *f->y);
        }
    }
    free(theta), free(want);
    return status;
}

enum bf_status forecast_make(const struct discriminate_state *w, const struct model *rival, const struct drive *drive,
                             bool with_jacobian, struct forecast *out, struct bf_error *err)
{
    struct predict_options how = w->options->predict;
    struct predictor *predictor = NULL;
    struct record stage;
    *out = (struct forecast){0};
    enum bf_status status = menu_model(w, rival, drive, &out->model, err);
    if (status)
        return status;
    menu_record(w, drive, true, &stage);
    const char *name = record_base_name(&stage);
    out->n_parameters = model_parameters(&out->model, &name, 1, &out->refs);
    how.threads = 1;
    how.quiet = true;
    status = predictor_new(&out->model, &stage, 1, &how, &predictor, err);
    if (!status)
        status = run(w, predictor, with_jacobian, out, err);
    if (predictor)
        predictor_free(predictor);
    record_free(&stage);
    return status;
}

void forecast_free(struct forecast *forecast)
{
    free(forecast->refs), free(forecast->y), free(forecast->jacobian);
    model_free(&forecast->model);
    *forecast = (struct forecast){0};
}

/* ---- Noise ---- */

static void learn(struct expected_noise *noise, double rms, double signal, const struct noise_estimate *colour)
{
    struct bf_error none;
    if (signal > 0.0)
        noise->share = noise->share > 0.0 ? fmin(noise->share, rms / signal) : rms / signal;
    if (noise->least > 0.0 && noise->least <= rms)
        return;
    noise->least = rms;
    if (colour == NULL || whitener_from_noise(colour, &noise->unit, &none) != BF_OK)
        noise->unit = (struct whitener){.ar.sigma = rms, .n_eff_share = 1.0};
    noise->unit.ar.sigma /= rms;
}

/* Colour only from records sampled like the experiment. */
static enum bf_status learn_outputs(struct discriminate_state *w, struct bf_error *err)
{
    struct predictor *predictor;
    const struct predict_channel *channels;
    enum bf_status status = predictor_new(w->baseline, w->records, w->n_records, &w->options->predict, &predictor, err);
    if (status)
        return status;
    const size_t n = predictor_channels(predictor, &channels);
    w->sigma = bf_alloc(n, sizeof *w->sigma);
    for (size_t c = 0; c < n; c++) {
        const size_t o = channels[c].output;
        const double signal = root_mean_square(channels[c].measured, channels[c].n);
        struct noise_estimate noise;
        status =
            noise_of_channel(w->baseline, &w->records[channels[c].record], w->baseline->outputs[o].name, &noise, err);
        if (status)
            break;
        w->sigma[c] = noise.rms > 0.0 ? noise.rms : fmax(guess * signal, 1e-300);
        learn(&w->noise[o], w->sigma[c], signal, noise.rms > 0.0 && channels[c].dt_s == w->dt_s ? &noise : NULL);
        noise_free(&noise);
    }
    predictor_free(predictor);
    return status;
}

enum bf_status noise_from_records(struct discriminate_state *w, struct bf_error *err)
{
    const size_t n_channels = w->n_outputs + w->d->n_sensors;
    enum bf_status status = BF_OK;
    w->noise = bf_alloc(n_channels, sizeof *w->noise);
    if (w->n_records > 0)
        status = learn_outputs(w, err);
    for (size_t c = 0; c < n_channels; c++) {
        const enum output_kind kind =
            c < w->n_outputs ? w->baseline->outputs[c].kind : w->d->sensors[c - w->n_outputs].kind;
        if (w->noise[c].share > 0.0)
            continue;
        w->noise[c] = (struct expected_noise){.unit = {.ar.sigma = 1.0, .n_eff_share = 1.0}, .share = unseen_noise};
        for (size_t o = 0; o < w->n_outputs && o < c; o++)
            if (w->baseline->outputs[o].kind == kind && w->noise[o].least > 0.0) {
                w->noise[c].least = w->noise[o].least;
                w->noise[c].share = w->noise[o].share;
            }
    }
    return status;
}

void noise_of_experiment(const struct discriminate_state *w, const struct forecast forecasts[], size_t n,
                         struct whitener whiteners[])
{
    for (size_t c = 0; c < w->n_outputs + w->d->n_sensors; c++) {
        double signal = 0.0;
        for (size_t i = 0; i < n; i++)
            signal = fmax(signal, root_mean_square(forecasts[i].y + c * w->n, w->n));
        const double rms = fmax(w->noise[c].least, w->noise[c].share * signal);
        whiteners[c] = w->noise[c].unit;
        whiteners[c].ar.sigma *= rms > 0.0 ? rms : 1.0; /* a channel without signal or noise tells nothing */
    }
}

void forecast_whiten(const struct discriminate_state *w, const struct whitener whiteners[], struct forecast *forecast)
{
    const size_t n_channels = w->n_outputs + w->d->n_sensors,
                 n_columns = forecast->jacobian ? forecast->n_parameters : 0;
    for (size_t c = 0; c < n_channels; c++) {
        whitener_apply(&whiteners[c], forecast->y + c * w->n, w->n, forecast->y + c * w->n);
        for (size_t i = 0; i < n_columns; i++) {
            double *column = forecast->jacobian + (i * n_channels + c) * w->n;
            if (!forecast->refs[i].info->fixed)
                whitener_apply(&whiteners[c], column, w->n, column);
        }
    }
}

/* ---- What is known of the parameters ---- */

/* Schur complement: H of the shared parameters when those of single records are free. G: [n²], scaled in place. */
static enum bf_status marginal(size_t n, double G[], const struct parameter_ref refs[], double **out,
                               struct bf_error *err)
{
    size_t n_shared = 0, n_own = 0;
    size_t *shared = bf_alloc(n, sizeof *shared), *own = bf_alloc(n, sizeof *own);
    for (size_t i = 0; i < n; i++) {
        if (refs[i].record < 0)
            shared[n_shared++] = i;
        else if (G[i + i * n] > 0.0)
            own[n_own++] = i;
    }
    double *A = bf_alloc(n_own * n_own, sizeof *A), *B = bf_alloc(n_own * n_shared, sizeof *B);
    double *X = bf_alloc(n_own * n_shared, sizeof *X), *H = bf_alloc(n_shared * n_shared, sizeof *H);
    for (size_t j = 0; j < n_own; j++) {
        for (size_t i = 0; i < n_own; i++)
            A[i + j * n_own] = G[own[i] + own[j] * n] / sqrt(G[own[i] * (n + 1)] * G[own[j] * (n + 1)]);
        A[j * (n_own + 1)] += ridge;
        for (size_t k = 0; k < n_shared; k++)
            B[j + k * n_own] = X[j + k * n_own] = G[own[j] + shared[k] * n] / sqrt(G[own[j] * (n + 1)]);
    }
    for (size_t j = 0; j < n_shared; j++)
        for (size_t i = 0; i < n_shared; i++)
            H[i + j * n_shared] = G[shared[i] + shared[j] * n];
    enum bf_status status = n_own > 0 ? dense_cholesky_solve(n_own, n_shared, A, X, err) : BF_OK;
    if (!status && n_own > 0)
        dense_gemm(true, false, n_shared, n_shared, n_own, -1.0, B, X, 1.0, H);
    free(shared), free(own), free(A), free(B), free(X);
    *out = H;
    return status;
}

static void add_gram(size_t n, const struct prediction *p, const struct predict_channel *c, double sigma,
                     const bool want[], double G[])
{
    double *J = bf_alloc(n * c->n, sizeof *J), *one = bf_alloc(n * n, sizeof *one);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; want[i] && k < c->n; k++)
            J[i * c->n + k] = p->jacobian[i * p->n_rows + c->row + k] / sigma;
    dense_gram(c->n, n, J, one);
    for (size_t i = 0; i < n * n; i++)
        G[i] += one[i];
    free(J), free(one);
}

enum bf_status present_information(const struct discriminate_state *w, const struct model *model, double **out,
                                   struct bf_error *err)
{
    struct predictor *predictor;
    struct prediction prediction;
    struct parameter_ref *refs;
    const struct predict_channel *channels;
    struct predict_options how = w->options->predict;
    how.quiet = true;
    enum bf_status status = predictor_new(model, w->records, w->n_records, &how, &predictor, err);
    if (status)
        return status;
    const char **names = record_base_names(w->records, w->n_records);
    const size_t n = model_parameters(model, names, w->n_records, &refs);
    const size_t n_channels = predictor_channels(predictor, &channels);
    double *theta = bf_alloc(n, sizeof *theta), *G = bf_alloc(n * n, sizeof *G);
    bool *want = bf_alloc(n, sizeof *want);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value, want[i] = !refs[i].info->fixed;
    status = predictor_run(predictor, theta, want, &prediction, err);
    for (size_t c = 0; !status && c < n_channels; c++)
        if (record_has_known_inputs(&w->records[channels[c].record]))
            add_gram(n, &prediction, &channels[c], w->sigma[c], want, G);
    if (!status)
        status = marginal(n, G, refs, out, err);
    predictor_free(predictor);
    free(names), free(refs), free(theta), free(G), free(want);
    return status;
}

void forecast_information(const struct discriminate_state *w, const struct forecast *forecast, const double *present,
                          const struct drive *drive, double H[])
{
    const size_t n = forecast->n_parameters;
    const bool moved = drive->at_m != w->baseline->inputs[drive->input].at_m;
    size_t *at = bf_alloc(n, sizeof *at), n_shared = 0;
    memset(H, 0, n * n * sizeof *H);
    for (size_t i = 0; i < n; i++) {
        const struct parameter_ref *ref = &forecast->refs[i];
        const struct parameter *info = ref->info;
        if (ref->record < 0)
            at[n_shared++] = i;
        if (info->prior > 0.0 && info->prior_value != 0.0 && ref->record < 0)
            H[i * (n + 1)] += pow(info->prior * info->prior_value, -2.0);
    }
    for (size_t l = 0; present != NULL && l < n_shared; l++)
        for (size_t k = 0; k < n_shared; k++)
            H[at[k] + at[l] * n] += present[k + l * n_shared];
    /* the local deformation at a new place is unknown: nothing said so far holds for it */
    for (size_t i = 0; moved && i < n; i++) {
        const struct parameter_ref *ref = &forecast->refs[i];
        if (ref->role != ROLE_RESIDUAL || forecast->model.residuals[ref->owner].input != drive->input)
            continue;
        for (size_t k = 0; k < n; k++)
            H[i + k * n] = H[k + i * n] = 0.0;
    }
    free(at);
}
