/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <math.h>

/* Of what is left, and never less than this part of the noise: 0.5 % of the rms. */
static const double enough = 0.1;

static double square_of(double x)
{
    return x * x;
}

/* The two predictions differ by more than a part of what the finer one leaves, on any channel. */
static bool differ(const struct finer_prediction *coarse, const struct finer_prediction *fine, const double sigma[],
                   const double horizon_s[])
{
    for (size_t c = 0; c < fine->n_channels; c++) {
        const struct predict_channel *channel = &fine->channels[c];
        const double *a = coarse->fitted + channel->row, *b = fine->fitted + channel->row;
        const double rows = horizon_s ? horizon_s[channel->record] / channel->dt_s : HUGE_VAL;
        double change = 0.0, left = 0.0, n = 0.0;
        for (size_t k = 0; k < channel->n && (double)k < rows; k++, n++) {
            change += square_of(a[k] - b[k]);
            left += square_of(channel->measured[k] - b[k]);
        }
        if (change > enough * enough * fmax(left, n * sigma[c] * sigma[c]))
            return true;
    }
    return false;
}

enum bf_status fit_steps(const struct model *model, const struct record records[], size_t n_records,
                         const struct fit_options *options, const double theta[], const double horizon_s[], int *steps,
                         struct bf_error *err)
{
    struct fit_options finer = *options;
    struct finer_prediction coarse, fine;
    *steps = 0;
    if (!model_has_law(model) || options->predict.oversample > 0)
        return BF_OK;
    int n = predict_steps(model, &options->predict);
    const int first = n;
    if (2 * n > MODEL_STEPS_MOST)
        return BF_OK;
    enum bf_status status = fit_predict(model, records, n_records, &finer, theta, &coarse, err);
    for (; !status && 2 * n <= MODEL_STEPS_MOST; n *= 2) {
        finer.predict.oversample = 2 * n;
        status = fit_predict(model, records, n_records, &finer, theta, &fine, err);
        const bool more = !status && differ(&coarse, &fine, options->sigma, horizon_s);
        finer_prediction_free(&coarse);
        coarse = fine;
        if (!more)
            break;
    }
    finer_prediction_free(&coarse);
    *steps = n > first ? n : 0;
    return status;
}
