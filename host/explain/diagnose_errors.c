/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How far a hypothesis is from the records, fitted and held out, measured by their noise. */
#include "diagnose_state.h"
#include "plausible.h"
#include "facts.h"

#include <math.h>
#include <stdlib.h>

#include "estimate/estimate.h"
#include "maths/maths.h"

/* Rows of a channel before the horizon of its record: what a chaotic motion does later, no model can predict. */
static size_t rows_in_use(const struct refit_result *fit, const struct predict_channel *channel)
{
    const double rows = fit->horizon_s[channel->record] / channel->dt_s;
    return rows < (double)channel->n ? (size_t)rows : channel->n;
}

/* The fitted channels and what the hypothesis leaves of them, in the rows in use; free() the array. */
struct misfit_channel *hypothesis_channels(const struct diagnosis *d, const struct hypothesis *h)
{
    struct misfit_channel *channels = bf_alloc(h->fit.n_channels, sizeof *channels);
    for (size_t c = 0; c < h->fit.n_channels; c++) {
        const struct predict_channel *channel = &h->fit.channels[c];
        channels[c] = (struct misfit_channel){.file = d->records[channel->record].path,
                                              .channel = d->model->outputs[channel->output].name,
                                              .record = channel->record,
                                              .n = rows_in_use(&h->fit, channel),
                                              .dt_s = channel->dt_s,
                                              .measured = channel->measured,
                                              .residual = h->fit.residual + channel->row,
                                              .noise = &d->noise[c]};
    }
    return channels;
}

/* One more channel; hum: rms of the mains in its residual over the noise's. Totals stay sums of squares until all are there. */
static void add_channel(struct hypothesis_errors *e, size_t c, double ratio, double hum, double doubt)
{
    const double humless =
        hum > 0.0 ? sqrt(fmax(ratio * ratio - hum * hum, 0.0)) : ratio; /* NaN where no noise is known */
    e->ratio[c] = ratio, e->doubt[c] = doubt;
    e->worst_ratio =
        fmax(e->worst_ratio, ratio / (1.0 + doubt)); /* two standard errors of the noise's level taken off */
    e->humless_worst = fmax(e->humless_worst, humless / (1.0 + doubt));
    e->humless_ratio += humless * humless;
}

static void measure_fitted(const struct diagnose_state *w, struct hypothesis *h)
{
    const struct refit_result *fit = &h->fit;
    struct hypothesis_errors *e = &h->fitted;
    *e = (struct hypothesis_errors){.n_channels = fit->n_channels,
                                    .ratio = bf_alloc(fit->n_channels, sizeof(double)),
                                    .doubt = bf_alloc(fit->n_channels, sizeof(double)),
                                    .record = bf_alloc(fit->n_channels, sizeof(size_t))};
    double nrmse = 0.0, ratio = 0.0, silent = 0.0;
    for (size_t c = 0; c < fit->n_channels; c++) {
        const struct predict_channel *channel = &fit->channels[c];
        const size_t n = rows_in_use(fit, channel);
        const double rms = root_mean_square(fit->residual + channel->row, n),
                     size = root_mean_square(channel->measured, n);
        const double hum = mains_power(w->d->model, &w->d->records[channel->record], fit->residual + channel->row, n);
        e->record[c] = channel->record;
        add_channel(e, c, rms / w->sigma[c], sqrt(hum) / w->sigma[c],
                    w->d->noise[c].rms > 0.0 ? noise_doubt(&w->d->noise[c]) : 0.0); /* a guess has none */
        ratio += e->ratio[c] * e->ratio[c];
        silent += size * size / (w->sigma[c] * w->sigma[c]);
        nrmse += size > 0.0 ? rms * rms / (size * size) : 0.0;
    }
    e->nrmse = sqrt(nrmse / (double)fit->n_channels);
    e->noise_ratio = sqrt(ratio / (double)fit->n_channels);
    e->silent_ratio = sqrt(silent / (double)fit->n_channels);
    e->humless_ratio = sqrt(e->humless_ratio / (double)fit->n_channels);
    struct misfit_channel *channels = hypothesis_channels(w->d, h);
    misfit_measure(channels, w->whiteners, fit->n_channels, &e->misfit);
    free(channels);
    /* rows beyond a horizon count as those before it, so that hypotheses of different horizons compare */
    const double all = (double)fit->n_rows / fmax((double)e->misfit.n, 1.0);
    e->misfit.chi_square *= all;
    e->misfit.n_eff *= all;
    e->misfit.n = fit->n_rows;
}

static void errors_free(struct hypothesis_errors *e)
{
    free(e->ratio), free(e->bins), free(e->doubt), free(e->record);
}

/* Of a whole channel of n samples. */
static double all_bins(const struct noise_estimate *noise, size_t n)
{
    const double nyquist_Hz = noise->df_Hz * ((double)noise->n_bins - 1.0);
    return nyquist_Hz > 0.0 ? noise_bins(noise, 0.0, nyquist_Hz, 0.5 * (double)n / nyquist_Hz)
                            : fmax(1.0, 0.5 * (double)n);
}

void hypothesis_take_check(struct hypothesis *h, const struct fit_channel_error channels[],
                           const struct noise_estimate noise[], size_t n)
{
    struct hypothesis_errors *e = &h->check;
    e->n_channels = n;
    e->ratio = bf_alloc(n, sizeof *e->ratio);
    e->bins = bf_alloc(n, sizeof *e->bins), e->doubt = bf_alloc(n, sizeof *e->doubt);
    e->record = bf_alloc(n, sizeof *e->record);
    e->worst_ratio = e->humless_ratio = e->humless_worst = 0.0;
    double silent = 0.0;
    fit_totals(channels, n, &e->nrmse, &e->noise_ratio);
    for (size_t c = 0; c < n; c++) {
        const double ratio = channels[c].noise_ratio, silent_ratio = ratio / channels[c].nrmse;
        silent += silent_ratio * silent_ratio;
        e->record[c] = channels[c].record;
        e->bins[c] = all_bins(&noise[c], channels[c].n);
        add_channel(e, c, ratio, channels[c].hum_ratio, isfinite(ratio) ? noise_doubt(&noise[c]) : 0.0);
    }
    e->humless_ratio = sqrt(e->humless_ratio / (double)n);
    e->silent_ratio = sqrt(silent / (double)n);
}

static enum bf_status measure_check(const struct diagnose_state *w, struct hypothesis *h, struct bf_error *err)
{
    const struct diagnosis *d = w->d;
    errors_free(&h->check);
    h->check = (struct hypothesis_errors){
        .nrmse = NAN, .noise_ratio = NAN, .worst_ratio = NAN, .humless_ratio = NAN, .humless_worst = NAN};
    if (d->n_checks == 0)
        return BF_OK;
    const struct fit_options options = {.quiet = true, .sigma = w->check_sigma, .predict = w->options->predict};
    struct own_values own;
    struct fit_channel_error *channels = NULL;
    size_t n = 0;
    enum bf_status status = own_values_find(&h->model, d->checks, d->n_checks, &options, &own, err);
    if (!status)
        status = fit_errors(own.model, d->checks, d->n_checks, &options, &channels, &n, err);
    own_values_free(&own);
    if (!status)
        hypothesis_take_check(h, channels, w->check_noise, n);
    free(channels);
    return status;
}

enum bf_status hypothesis_measure_apart(const struct diagnose_state *w, struct hypothesis *h, struct bf_error *err)
{
    measure_fitted(w, h);
    struct misfit_channel *channels = hypothesis_channels(w->d, h);
    const enum bf_status status = facts_measure(w->d, channels, h, err);
    free(channels);
    return status ? status : measure_check(w, h, err);
}

double hypothesis_excess(const struct hypothesis_errors *e)
{
    return fmax(e->noise_ratio * e->noise_ratio - 1.0, 0.0);
}

double hypothesis_misfit(const struct hypothesis_errors *baseline)
{
    const double silent = baseline->silent_ratio * baseline->silent_ratio - 1.0, left = hypothesis_excess(baseline);
    return silent > 0.0 && silent < left ? silent : left;
}

double hypothesis_left_of_all(const struct hypothesis *h)
{
    return hypothesis_excess(&h->fitted) + hypothesis_excess(&h->check);
}

bool diagnose_is_far(const struct hypothesis *h)
{
    return h->fitted.noise_ratio > search_limits.far;
}

bool hypothesis_has_law(const struct hypothesis *h)
{
    for (size_t i = 0; i < h->n_effects; i++)
        if (h->effects[i]->law != NULL)
            return true;
    return false;
}

/* Without a level of noise the units are those of the baseline, whose channels count alike. */
double diagnose_floor(const struct diagnosis *d)
{
    const struct hypothesis_errors *e = &d->baseline.fitted;
    if (d->attainable.modes == 0 || isfinite(d->attainable.noise_ratio))
        return d->attainable.noise_ratio;
    return e->nrmse > 0.0 ? d->attainable.nrmse / e->nrmse * e->noise_ratio : nan("");
}

/* The noise may be less than its estimate: where a free linear model leaves clearly less, something else may explain more. */
static bool is_near_floor(const struct diagnosis *d, const struct hypothesis *h)
{
    return d->attainable.modes == 0 || h->fitted.noise_ratio <= search_limits.alike * diagnose_floor(d);
}

typedef bool judgement(const struct diagnosis *d, const struct hypothesis *h);

/* Of the hypotheses with so many effects one is that, and no stand-in: a spring that attracts explains nothing, what it stands for is still to be found. */
static bool any_is(const struct diagnosis *d, size_t n_effects, judgement *is)
{
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (h->n_effects == n_effects && !is_stand_in(h) && is(d, h))
            return true;
    }
    return false;
}

static bool explains(const struct diagnosis *d, const struct hypothesis *h)
{
    return h->explains && is_near_floor(d, h);
}

bool diagnose_explained(const struct diagnosis *d, size_t n_effects)
{
    return any_is(d, n_effects, explains);
}

bool diagnose_has_ended(const struct diagnosis *d, const struct beam_effect *effect)
{
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects == 1 && d->hypotheses[i].effects[0] == effect && d->hypotheses[i].fit.converged)
            return true;
    return false;
}

bool hypothesis_takes_nearly_all(const struct diagnosis *d, const struct hypothesis *h)
{
    const bool fitted =
        hypothesis_excess(&h->fitted) <= search_limits.thousandth * hypothesis_misfit(&d->baseline.fitted);
    const bool held_out =
        hypothesis_excess(&h->check) <= search_limits.thousandth * hypothesis_misfit(&d->baseline.check);
    return h->fit.converged && fitted && (h->check.n_channels == 0 || held_out);
}

bool diagnose_far_ahead(const struct diagnosis *d, size_t n_effects)
{
    return any_is(d, n_effects, hypothesis_takes_nearly_all) || diagnose_explained(d, n_effects);
}

bool diagnose_predicts_as_linear(const struct diagnosis *d, const struct hypothesis *h)
{
    return h->check.noise_ratio <= search_limits.alike * d->attainable.held_out_noise_ratio;
}

bool hypothesis_is_answer(const struct diagnosis *d, const struct hypothesis *h)
{
    return h->explained >= search_limits.answer &&
           (!(h->held_out_explained < search_limits.answer) || diagnose_predicts_as_linear(d, h));
}

bool diagnose_has_answer(const struct diagnosis *d, size_t n_effects)
{
    return any_is(d, n_effects, hypothesis_is_answer);
}

/* It has come near the noise, and takes as much of the fitted records as an answer does. */
static bool is_nearly_there(const struct diagnosis *d, const struct hypothesis *h)
{
    const bool near = !diagnose_is_far(h) && !(h->check.noise_ratio > search_limits.far);
    return near &&
           hypothesis_excess(&h->fitted) <= (1.0 - search_limits.answer) * hypothesis_misfit(&d->baseline.fitted);
}

bool diagnose_nearly_there(const struct diagnosis *d, size_t n_effects)
{
    return any_is(d, n_effects, is_nearly_there) || diagnose_far_ahead(d, n_effects);
}

double diagnose_best_left(const struct diagnosis *d, size_t n_effects)
{
    double best = d->baseline.fitted.noise_ratio;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects == n_effects)
            best = fmin(best, d->hypotheses[i].fitted.noise_ratio);
    return best;
}

void hypothesis_free(struct hypothesis *h)
{
    model_free(&h->model);
    refit_free(&h->fit);
    errors_free(&h->fitted), errors_free(&h->check);
    free(h->left);
    *h = (struct hypothesis){0};
}
