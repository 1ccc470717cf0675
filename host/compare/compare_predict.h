/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_predict.h — the prediction of a model as it is, with its linear unknowns solved. Private to compare/. */
#ifndef BEAMFIT_COMPARE_PREDICT_H
#define BEAMFIT_COMPARE_PREDICT_H

#include "response/response.h"

struct solved_prediction {
    struct predictor *predictor; /* owns channels */
    size_t n_channels;
    const struct predict_channel *channels;
    double *y;     /* all rows */
    double *level; /* [n_records] factor of the excitation; 1 where it is known */
};

/* noise[channel]: rms by which channels of one record are weighted; 0: weighted by the channel's own rms. */
enum bf_status solved_prediction_new(const struct model *model, const struct record records[], size_t n_records,
                                     const struct predict_options *options, struct solved_prediction *out,
                                     struct bf_error *err);
enum bf_status solved_prediction_run(const struct model *model, const struct record records[], size_t n_records,
                                     const double noise[], struct solved_prediction *out, struct bf_error *err);
void solved_prediction_free(struct solved_prediction *prediction);

/* The level of the record's excitation is not known: said by the record, or by an input of the model. */
bool excitation_level_unknown(const struct model *model, const struct record *record);

#endif
