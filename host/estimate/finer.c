/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <stdlib.h>
#include <string.h>

#include "fit_problem.h"

enum { USUAL_SPLINES = 160, USUAL_OVERSAMPLE = 8 };

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

static enum bf_status finer_predictor(const struct model *model, const struct record records[], size_t n_records,
                                      const struct fit_options *given, struct predictor **out, struct bf_error *err)
{
    struct predict_options options = given->predict;
    options.quiet = true;
    enum bf_status status = predictor_new(model, records, n_records, &options, out, err);
    if (status)
        return status;
    options.modes = 2 * predictor_modes(*out);
    options.fine_splines = 2 * (options.fine_splines > 0 ? options.fine_splines : USUAL_SPLINES);
    options.oversample = 2 * (options.oversample > 0 ? options.oversample : USUAL_OVERSAMPLE);
    predictor_free(*out);
    *out = NULL;
    return predictor_new(model, records, n_records, &options, out, err);
}

static enum bf_status finer_new(const struct model *model, const struct record records[], size_t n_records,
                                const struct fit_options *options, struct finer *f, struct bf_error *err)
{
    *f = (struct finer){.names = record_base_names(records, n_records)};
    const size_t n = model_parameters(model, f->names, n_records, &f->refs);
    enum bf_status status = finer_predictor(model, records, n_records, options, &f->predictor, err);
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
    out->row = bf_alloc(p->n_channels, sizeof *out->row);
    out->fitted = bf_alloc(p->n_rows, sizeof *out->fitted);
    for (size_t c = 0; c < p->n_channels; c++)
        out->row[c] = p->channels[c].row;
    memcpy(out->fitted, p->fitted, p->n_rows * sizeof *out->fitted);
}

enum bf_status fit_finer(const struct model *model, const struct record records[], size_t n_records,
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

void finer_prediction_free(struct finer_prediction *finer)
{
    free(finer->row), free(finer->fitted);
    *finer = (struct finer_prediction){0};
}
