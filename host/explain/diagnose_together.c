/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Held-out records of a model that is at the noise of the others: what they show of it may be a matter of values. A damping that noisy records leave open to 8 % predicts quiet
 * ones at several times their noise, though nothing is missing. So the model is fitted to all records from where it stands; with physics missing it cannot have both.
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

/* out->check: errors of n channels of the refit, from `first` on; records are counted from first_record. */
static void take_errors(const struct refit_result *fit, size_t first, size_t n, size_t first_record,
                        const double sigma[], const struct noise_estimate noise[], struct hypothesis *out)
{
    struct fit_channel_error *errors = bf_alloc(n, sizeof *errors);
    for (size_t c = 0; c < n; c++) {
        const struct predict_channel *channel = &fit->channels[first + c];
        const double rms = root_mean_square(fit->residual + channel->row, channel->n),
                     size = root_mean_square(channel->measured, channel->n);
        errors[c] = (struct fit_channel_error){.record = channel->record - first_record,
                                               .n = channel->n,
                                               .nrmse = size > 0.0 ? rms / size : 0.0,
                                               .noise_ratio = noise[c].rms > 0.0 ? rms / sigma[c] : (double)NAN};
    }
    hypothesis_take_check(out, errors, noise, n);
    free(errors);
}

/* Both sets come down to the noise: what the held-out ones leave then is what they say of the model. */
static void take_together(const struct diagnose_state *w, const struct refit_result *fit, struct hypothesis *h)
{
    const struct diagnosis *d = w->d;
    struct hypothesis fitted = {0}, held_out = {0};
    take_errors(fit, 0, d->n_channels, 0, w->sigma, d->noise, &fitted);
    take_errors(fit, d->n_channels, w->n_check_channels, d->n_records, w->check_sigma, w->check_noise, &held_out);
    h->open_values =
        diagnose_errors_are_noise(&fitted.check, false) && diagnose_errors_are_noise(&held_out.check, true);
    if (h->open_values) {
        const struct hypothesis_errors old = h->check;
        h->check = held_out.check, held_out.check = old;
    }
    hypothesis_free(&fitted), hypothesis_free(&held_out);
}

/* model: that of h, with what belongs to the held-out records alone. */
static enum bf_status fit_to_all(const struct diagnose_state *w, const struct model *model, struct hypothesis *h,
                                 struct bf_error *err)
{
    struct all_records all = all_new(w);
    struct refit_result fit;
    const struct refit_options options = {.sigma = all.sigma,
                                          .threads = w->threads,
                                          .near = true,
                                          .first_new = model->n_effects,
                                          .predict = w->options->predict};
    const enum bf_status status = refit_run(model, all.records, all.n, &options, &fit, err);
    if (!status && fit.n_channels == w->d->n_channels + w->n_check_channels)
        take_together(w, &fit, h);
    if (!status)
        refit_free(&fit);
    free(all.records), free(all.sigma);
    return status == BF_NUMERIC ? BF_OK : status; /* no value for all: then values do not tell */
}

enum bf_status hypothesis_measure(const struct diagnose_state *w, struct hypothesis *h, struct bf_error *err)
{
    const struct diagnosis *d = w->d;
    const struct fit_options options = {.quiet = true, .sigma = w->check_sigma, .predict = w->options->predict};
    struct own_values own;
    enum bf_status status = hypothesis_measure_apart(w, h, err);
    h->open_values = false;
    if (status || !diagnose_errors_are_noise(&h->fitted, false) || diagnose_errors_are_noise(&h->check, true))
        return status;
    status = own_values_find(&h->model, d->checks, d->n_checks, &options, &own, err);
    if (!status)
        status = fit_to_all(w, own.model, h, err);
    own_values_free(&own);
    return status;
}
