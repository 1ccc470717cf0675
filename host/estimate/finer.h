/* SPDX-License-Identifier: GPL-3.0-or-later */
/* finer.h — a fitted model predicted once more, twice as finely: how large is the error of the computation? */
#ifndef BEAMFIT_FINER_H
#define BEAMFIT_FINER_H

#include "fit.h"

struct finer_prediction {
    size_t n_channels; /* order of predictor_channels() */
    size_t *row;       /* [n_channels] first row of each channel */
    double *fitted;    /* stacked rows, linear unknowns solved again */
    size_t runs;       /* evaluations of the prediction */
};

/*
 * Twice the modes and fine splines and, where a law steps through time, half the step. theta: in the order of
 * model_parameters(); options: sigma must be given. BF_NUMERIC: no value in the finer space. Free with
 * finer_prediction_free(), also after a failure. Cost: two predictors and one prediction.
 */
enum bf_status fit_finer(const struct model *model, const struct record records[], size_t n_records,
                         const struct fit_options *options, const double theta[], struct finer_prediction *out,
                         struct bf_error *err);
void finer_prediction_free(struct finer_prediction *finer);

#endif
