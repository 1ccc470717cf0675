/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_work.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include "maths/maths.h"
#include "noise/noise.h"

static const double guess = 1e-3; /* of the signal: stands for a noise that cannot be seen */

void fit_work_free(struct fit_work *w)
{
    fit_problem_free(&w->problem);
    predictor_free(w->predictor);
    lines_free(w->lines);
    free(w->names), free(w->refs), free(w->sigma), free(w->noise), free(w->x);
}

/* w->noise[c]; *doubt: of its power. */
static enum bf_status find_channel_noise(struct fit_work *w, const struct predict_channel *channel, size_t c,
                                         const struct fit_options *options, double *doubt, struct bf_error *err)
{
    struct noise_estimate estimate;
    if (options->sigma) {
        w->noise[c] = options->sigma[c];
        return BF_OK;
    }
    const enum bf_status status = noise_of_channel(w->model, &w->records[channel->record],
                                                   w->model->outputs[channel->output].name, &estimate, err);
    if (status)
        return status;
    w->noise[c] = estimate.rms;
    *doubt = estimate.rms > 0.0 ? noise_doubt(&estimate) : 0.0;
    noise_free(&estimate);
    return BF_OK;
}

static enum bf_status find_noise(struct fit_work *w, const struct fit_options *options, struct bf_error *err)
{
    const struct predict_channel *channels;
    if (w->predictor == NULL)
        return BF_OK;
    const size_t n = predictor_channels(w->predictor, &channels);
    double *doubt = bf_alloc(n, sizeof *doubt);
    size_t *record = bf_alloc(n, sizeof *record);
    enum bf_status status = BF_OK;
    w->sigma = bf_alloc(n, sizeof *w->sigma), w->noise = bf_alloc(n, sizeof *w->noise);
    for (size_t c = 0; c < n && !status; c++) {
        record[c] = channels[c].record;
        status = find_channel_noise(w, &channels[c], c, options, &doubt[c], err);
        w->sigma[c] = w->noise[c] > 0.0 ? w->noise[c] : guess * root_mean_square(channels[c].measured, channels[c].n);
    }
    w->noise_doubt = noise_ratio_doubt(doubt, record, n);
    free(doubt), free(record);
    return status;
}

/* Refs, and the problem of records that are here. */
static enum bf_status pose(struct fit_work *w, const struct fit_options *options, struct bf_error *err)
{
    const size_t n = w->n_records;
    w->n_sampled = lines_behind(w->records, n);
    if (w->n_sampled == SIZE_MAX)
        return bf_fail(err, BF_USAGE, "lists of frequencies and spectra without phase stand behind all other records");
    enum bf_status status = BF_OK;
    struct predict_options how = options->predict;
    how.pieces = true;
    if (w->n_sampled > 0)
        status = predictor_new(w->model, w->records, w->n_sampled, &how, &w->predictor, err);
    if (!status)
        status =
            lines_new(w->model, w->records, w->n_sampled, n, w->refs, w->n_refs, &options->predict, &w->lines, err);
    if (!status)
        status = find_noise(w, options, err);
    if (!status)
        status = fit_problem_new_with_lines(&w->problem, w->model, w->predictor, w->lines, w->records, n, w->names,
                                            w->refs, w->n_refs, w->sigma, err);
    return status;
}

/* The problem of records that shares have. */
static enum bf_status pose_shared(struct fit_work *w, const struct fit_shares *shares, struct bf_error *err)
{
    w->n_sampled = w->n_records;
    return fit_problem_new_shared(&w->problem, w->model, shares, w->names, w->refs, w->n_refs, err);
}

enum bf_status fit_work_new(struct fit_work *w, const struct model *model, const struct record records[],
                            size_t n_records, const struct fit_options *options, struct bf_error *err)
{
    *w = (struct fit_work){.model = model, .records = records, .n_records = n_records};
    w->names = record_base_names(records, n_records);
    w->n_refs = model_parameters(model, w->names, n_records, &w->refs);
    const enum bf_status status =
        options->shares != NULL ? pose_shared(w, options->shares, err) : pose(w, options, err);
    if (status)
        return status;
    double *theta = bf_alloc(w->n_refs, sizeof *theta);
    for (size_t i = 0; i < w->n_refs; i++)
        theta[i] = w->refs[i].value;
    w->problem.most_runs = options->most_runs;
    w->x = bf_alloc(w->problem.n_unknowns, sizeof *w->x);
    fit_problem_to_x(&w->problem, theta, w->x);
    free(theta);
    return BF_OK;
}
