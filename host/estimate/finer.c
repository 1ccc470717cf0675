/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <stdlib.h>
#include <string.h>

#include "fit_problem.h"

enum { USUAL_SPLINES = 160 };

struct finer {
    const char **names;
    struct parameter_ref *refs;
    struct predictor *predictor;
    struct fit_problem problem;
    double *x;
};

static void finer_free(struct finer *f)
{
    fit_problem_free(&f->problem);
    predictor_free(f->predictor);
    free(f->names), free(f->refs), free(f->x);
}

enum bf_status predict_finer(const struct model *model, const struct record records[], size_t n_records,
                             struct predict_options *options, struct bf_error *err)
{
    struct predictor *predictor;
    struct predict_options quiet = *options;
    quiet.quiet = true;
    const enum bf_status status = predictor_new(model, records, n_records, &quiet, &predictor, err);
    if (status)
        return status;
    options->modes = 2 * predictor_modes(predictor);
    options->fine_splines = 2 * (options->fine_splines > 0 ? options->fine_splines : USUAL_SPLINES);
    if (model_has_law(model))
        options->oversample = 2 * predict_steps(model, options);
    predictor_free(predictor);
    return BF_OK;
}

static enum bf_status finer_new(const struct model *model, const struct record records[], size_t n_records,
                                const struct fit_options *options, struct finer *f, struct bf_error *err)
{
    *f = (struct finer){.names = record_base_names(records, n_records)};
    const size_t n = model_parameters(model, f->names, n_records, &f->refs);
    struct predict_options predict = options->predict;
    predict.quiet = true;
    enum bf_status status = predictor_new(model, records, n_records, &predict, &f->predictor, err);
    if (!status)
        status = fit_problem_new(&f->problem, model, f->predictor, records, n_records, f->names, f->refs, n,
                                 options->sigma, err);
    if (!status)
        f->x = bf_alloc(f->problem.n_unknowns, sizeof *f->x);
    return status;
}

static void take(const struct fit_problem *p, struct finer_prediction *out)
{
    out->n_channels = p->n_channels;
    out->channels = bf_alloc(p->n_channels, sizeof *out->channels);
    out->fitted = bf_alloc(p->n_rows, sizeof *out->fitted);
    memcpy(out->channels, p->channels, p->n_channels * sizeof *out->channels);
    memcpy(out->fitted, p->fitted, p->n_rows * sizeof *out->fitted);
}

enum bf_status fit_predict(const struct model *model, const struct record records[], size_t n_records,
                           const struct fit_options *options, const double theta[], struct finer_prediction *out,
                           struct bf_error *err)
{
    struct finer f;
    double square;
    *out = (struct finer_prediction){0};
    enum bf_status status = finer_new(model, records, n_records, options, &f, err);
    if (!status) {
        fit_problem_to_x(&f.problem, theta, f.x);
        status = fit_problem_stage(&f.problem, 0.0, 0.0, f.x, err);
    }
    if (!status)
        status = fit_problem_evaluate(&f.problem, f.x, false, &square, err);
    if (!status)
        take(&f.problem, out);
    out->runs = f.problem.runs;
    finer_free(&f);
    return status;
}

enum bf_status fit_finer(const struct model *model, const struct record records[], size_t n_records,
                         const struct fit_options *options, const double theta[], struct finer_prediction *out,
                         struct bf_error *err)
{
    struct fit_options finer = *options;
    *out = (struct finer_prediction){0};
    const enum bf_status status = predict_finer(model, records, n_records, &finer.predict, err);
    return status ? status : fit_predict(model, records, n_records, &finer, theta, out, err);
}

void finer_prediction_free(struct finer_prediction *finer)
{
    free(finer->channels), free(finer->fitted);
    *finer = (struct finer_prediction){0};
}
