/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The model as given, fitted: what every hypothesis is measured against. */
#include "diagnose_relatives.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "estimate/estimate.h"
#include "facts.h"
#include "maths/maths.h"

static const double guess = 1e-3; /* of the signal: stands for a noise that cannot be seen, as in a fit */

static enum bf_status noise_of(const struct model *model, const struct record records[], size_t n_records,
                               const struct predict_options *predict, struct noise_estimate **noise, double **sigma,
                               size_t *n_channels, struct bf_error *err)
{
    struct predictor *predictor;
    const struct predict_channel *channels;
    enum bf_status status = predictor_new(model, records, n_records, predict, &predictor, err);
    if (status)
        return status;
    *n_channels = predictor_channels(predictor, &channels);
    *noise = bf_alloc(*n_channels, sizeof **noise);
    *sigma = bf_alloc(*n_channels, sizeof **sigma);
    for (size_t c = 0; c < *n_channels && !status; c++) {
        const struct predict_channel *channel = &channels[c];
        status =
            noise_of_channel(model, &records[channel->record], model->outputs[channel->output].name, &(*noise)[c], err);
        (*sigma)[c] = (*noise)[c].rms > 0.0 ? (*noise)[c].rms
                                            : fmax(guess * root_mean_square(channel->measured, channel->n), 1e-300);
    }
    predictor_free(predictor);
    return status;
}

enum bf_status diagnose_noise(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    enum bf_status status =
        noise_of(d->model, d->records, d->n_records, &w->options->predict, &d->noise, &w->sigma, &d->n_channels, err);
    if (!status && d->n_checks > 0)
        status = noise_of(d->model, d->checks, d->n_checks, &w->options->predict, &w->check_noise, &w->check_sigma,
                          &w->n_check_channels, err);
    w->whiteners = bf_alloc(d->n_channels, sizeof *w->whiteners);
    for (size_t c = 0; c < d->n_channels && !status; c++) {
        w->whiteners[c] = (struct whitener){.ar.sigma = w->sigma[c], .n_eff_share = 1.0};
        if (d->noise[c].rms > 0.0)
            status = whitener_from_noise(&d->noise[c], &w->whiteners[c], err);
    }
    return status;
}

/*
 * One fact a mode: the frequencies of the fitted baseline part the bands; of the model as given, where what is missing has driven that to where it has none. And what the
 * baseline leaves in each.
 */
static enum bf_status find_facts(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    enum bf_status status = diagnose_modes_in_band(d, &d->baseline.model, d->mode_Hz, &d->n_modes, err);
    if (status == BF_NUMERIC)
        status = diagnose_modes_in_band(d, d->model, d->mode_Hz, &d->n_modes, err);
    if (status)
        return status;
    struct misfit_channel *channels = hypothesis_channels(d, &d->baseline);
    facts_of_channels(d, channels, w->sigma, d->mode_Hz, d->n_modes);
    status = facts_measure(d, channels, &d->baseline, err);
    free(channels);
    return status;
}

/* The fit that the caller has, of the model as given. Where the noise of a channel is not known it was weighted otherwise than here. */
static const struct fit_result *known_fit(const struct diagnose_state *w)
{
    const struct diagnosis *d = w->d;
    for (size_t c = 0; c < d->n_channels; c++)
        if (!(d->noise[c].rms > 0.0))
            return NULL;
    return d->model == &d->rig ? NULL : w->options->fitted;
}

/* fit_run() knows how to begin far off. */
static enum bf_status fit_given(struct diagnose_state *w, struct hypothesis *h, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    const struct fit_options options = {
        .quiet = true, .never_search = true, .sigma = w->sigma, .predict = w->options->predict};
    static const struct fit_check nothing_held_out;
    struct fit_result own = {0};
    const struct fit_result *fit = known_fit(w);
    enum bf_status status = BF_OK;
    if (fit == NULL) {
        status = fit_run(d->model, d->records, d->n_records, &options, &own, err);
        fit = &own;
    }
    if (!status)
        status = model_copy(d->model, &h->model, err);
    if (!status) {
        fit_into_model(fit, d->records, &nothing_held_out, &h->model);
        d->evaluations += fit->evaluations;
        d->converged = fit->converged;
        d->interrupted = fit->interrupted;
    }
    fit_free(&own);
    return status;
}

/* `start` is taken over. Lower than the baseline by more than the last steps to the same minimum: *lower, and it is the baseline. */
static enum bf_status restart_from(struct diagnose_state *w, struct model *start, bool near, bool *lower, bool *same,
                                   struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct hypothesis *h = &d->baseline, again = {.n_base = h->n_base, .refitted = true, .model = *start};
    const struct refit_options options = {.sigma = w->sigma,
                                          .threads = w->threads,
                                          .first_new = h->model.n_effects,
                                          .near = near,
                                          .predict = w->options->predict};
    const double last_steps = 1.0 - search_limits.hundredth;
    enum bf_status status = refit_run(&again.model, d->records, d->n_records, &options, &again.fit, err);
    d->evaluations += again.fit.evaluations;
    *lower = !status && again.fit.chi2_per_row < last_steps * h->fit.chi2_per_row;
    *same = !status && again.fit.converged && last_steps * again.fit.chi2_per_row < h->fit.chi2_per_row;
    if (*lower) {
        refit_into_model(d->records, d->n_records, again.fit.value, again.fit.sd, &again.model);
        status = hypothesis_measure(w, &again, err);
    }
    if (*lower && !status) {
        const struct hypothesis old = *h;
        *h = again, again = old;
        d->converged = h->fit.converged;
    }
    hypothesis_free(&again);
    return status == BF_NUMERIC ? BF_OK : status; /* no value there: the baseline stays */
}

/*
 * Residual and errors in the form of every hypothesis: by way of windows where the fit did not converge. What has ended at values that no window can be predicted
 * with is taken as it is.
 */
static enum bf_status refit_given(const struct diagnose_state *w, struct hypothesis *h, struct bf_error *err)
{
    const struct diagnosis *d = w->d;
    struct refit_options options = {.sigma = w->sigma,
                                    .threads = w->threads,
                                    .first_new = h->model.n_effects,
                                    .near = d->converged,
                                    .errors = true,
                                    .predict = w->options->predict};
    enum bf_status status = refit_run(&h->model, d->records, d->n_records, &options, &h->fit, err);
    if (status != BF_NUMERIC || options.near)
        return status;
    options.near = true;
    return refit_run(&h->model, d->records, d->n_records, &options, &h->fit, err);
}

enum bf_status diagnose_baseline(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct hypothesis *h = &d->baseline;
    enum bf_status status = fit_given(w, h, err);
    if (status)
        return status;
    h->n_base = h->model.n_effects;
    status = refit_given(w, h, err);
    if (status)
        return status;
    refit_into_model(d->records, d->n_records, h->fit.value, h->fit.sd, &h->model);
    h->refitted = true;
    d->converged = d->converged || h->fit.converged;
    d->evaluations += h->fit.evaluations;
    status = find_facts(w, err);
    return status ? status : hypothesis_measure(w, h, err);
}

/* The parameters of the baseline come first in every hypothesis: new effects are appended. */
static enum bf_status without_its_effects(const struct diagnosis *d, const struct hypothesis *best, struct model *out,
                                          struct bf_error *err)
{
    const enum bf_status status = model_copy(&d->baseline.model, out, err);
    if (!status)
        refit_into_model(d->records, d->n_records, best->fit.value, NULL, out);
    return status;
}

/*
 * The best, and whatever else takes nearly all alone: where effects that have nothing to do with each other do, it was the baseline that stood off, and one that is next
 * to nothing has found its values.
 */
static bool may_stand_lower(const struct diagnosis *d, size_t i)
{
    const struct hypothesis *h = &d->hypotheses[i], *best = &d->hypotheses[0];
    return i == 0 || (h->n_effects == 1 && h->explained >= search_limits.nearly_all &&
                      !diagnose_is_kin(h->effects[0], best->effects[0], d->model));
}

static enum bf_status restart_without(struct diagnose_state *w, const struct hypothesis *h, bool *lower, bool *same,
                                      struct bf_error *err)
{
    struct model start;
    const enum bf_status status = without_its_effects(w->d, h, &start, err);
    return status ? status : restart_from(w, &start, w->d->converged, lower, same, err);
}

enum bf_status diagnose_restart(struct diagnose_state *w, bool *lower, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    enum bf_status status = BF_OK;
    size_t n = 0;
    *lower = false;
    for (size_t i = 0; i < d->n_hypotheses && n < SEARCH_FEW && !status; i++) {
        bool fell = false, same = false;
        if (!may_stand_lower(d, i))
            continue;
        n++;
        status = restart_without(w, &d->hypotheses[i], &fell, &same, err);
        *lower = *lower || fell;
        if (!status && !fell) /* the same minimum, found twice */
            d->converged = d->converged || same;
    }
    return status;
}

enum bf_status diagnose_also_from(struct diagnose_state *w, struct model *start, bool *lower, struct bf_error *err)
{
    bool same;
    *lower = false;
    const enum bf_status status = restart_from(w, start, false, lower, &same, err);
    return !status && *lower ? find_facts(w, err) : status;
}

enum bf_status diagnose_not_above(struct diagnose_state *w, const struct hypothesis *narrower, struct model *start,
                                  struct bf_error *err)
{
    bool lower;
    if (w->d->baseline.fit.chi2_per_row > narrower->fit.chi2_per_row)
        return diagnose_also_from(w, start, &lower, err);
    model_free(start);
    return BF_OK;
}
