/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Held-out records of a model that fits the others: what they show of it may be a matter of values. A damping that noisy records leave open to 8 % predicts quiet ones
 * at several times their noise, though nothing is missing. So the model is fitted to all records from where it stands; with physics missing it cannot have both.
 */
#include "diagnose_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* The fitted records and those held out, with the noise of their channels. */
struct all_records {
    size_t n;
    struct record *records; /* [n] views */
    double *sigma;          /* [n_channels + n_check_channels]: channels are in the order of the records */
};

static struct all_records all_new(const struct diagnose_state *w)
{
    const struct diagnosis *d = w->d;
    struct all_records all = {.n = d->n_records + d->n_checks};
    all.records = bf_alloc(all.n, sizeof *all.records);
    all.sigma = bf_alloc(d->n_channels + w->n_check_channels, sizeof *all.sigma);
    memcpy(all.records, d->records, d->n_records * sizeof *all.records);
    memcpy(all.records + d->n_records, d->checks, d->n_checks * sizeof *all.records);
    memcpy(all.sigma, w->sigma, d->n_channels * sizeof *all.sigma);
    memcpy(all.sigma + d->n_channels, w->check_sigma, w->n_check_channels * sizeof *all.sigma);
    return all;
}

/* Channels first … first + n of the refit, against the noise. */
static bool are_noise(const struct refit_result *fit, size_t first, size_t n, const struct noise_estimate noise[],
                      const double sigma[], bool held_out)
{
    struct hypothesis_errors e = {
        .n_channels = n, .doubt = bf_alloc(n, sizeof *e.doubt), .record = bf_alloc(n, sizeof *e.record)};
    double square = 0.0;
    for (size_t c = 0; c < n; c++) {
        const struct predict_channel *channel = &fit->channels[first + c];
        const double ratio = root_mean_square(fit->residual + channel->row, channel->n) / sigma[c];
        e.record[c] = channel->record;
        e.doubt[c] = noise[c].rms > 0.0 ? noise_doubt(&noise[c]) : 0.0;
        e.worst_ratio = fmax(e.worst_ratio, ratio / (1.0 + e.doubt[c]));
        square += ratio * ratio;
    }
    e.noise_ratio = sqrt(square / (double)n);
    const bool noise_only = diagnose_errors_are_noise(&e, held_out);
    free(e.doubt), free(e.record);
    return noise_only;
}

enum bf_status diagnose_together(const struct diagnose_state *w, struct hypothesis *h, struct bf_error *err)
{
    const struct diagnosis *d = w->d;
    h->open_values = false;
    if (d->n_checks == 0 || !diagnose_errors_are_noise(&h->fitted, false) || diagnose_errors_are_noise(&h->check, true))
        return BF_OK;
    struct all_records all = all_new(w);
    struct refit_result fit;
    const struct refit_options options = {.sigma = all.sigma,
                                          .threads = w->threads,
                                          .near = true,
                                          .first_new = h->model.n_effects,
                                          .predict = w->options->predict};
    const enum bf_status status = refit_run(&h->model, all.records, all.n, &options, &fit, err);
    if (!status && fit.n_channels == d->n_channels + w->n_check_channels)
        h->open_values = are_noise(&fit, 0, d->n_channels, d->noise, w->sigma, false) &&
                         are_noise(&fit, d->n_channels, w->n_check_channels, w->check_noise, w->check_sigma, true);
    if (!status)
        refit_free(&fit);
    free(all.records), free(all.sigma);
    return status == BF_NUMERIC ? BF_OK : status; /* no value for all: then values do not tell */
}
