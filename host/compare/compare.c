/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "factor_pair.h"
#include "compare_parts.h"
#include "compare_predict.h"
#include "estimate/estimate.h"
#include "beam/beam.h"
#include "maths/maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_LAGS = 120, INPUT_LAGS = COMPARE_INPUT_LAGS, AMPLITUDE_WINDOWS = COMPARE_WINDOWS };

/* A residual of up to this many times the noise is taken for noise. */
static const double noise_ratio_of_noise = 1.05;

/* ---- One channel ---- */

void compare_set_scale(struct comparison_channel *c, double zz, double zy, double yy)
{
    c->scale = yy > 0.0 ? zy / yy : 0.0;
    c->alignment = zz > 0.0 && yy > 0.0 ? zy / sqrt(zz * yy) : 0.0;
}

static void judge_scale(struct comparison_channel *c)
{
    double zz = 0.0, zy = 0.0, yy = 0.0;
    for (size_t i = 0; i < c->n; i++) {
        zz += c->measured[i] * c->measured[i];
        zy += c->measured[i] * c->predicted[i];
        yy += c->predicted[i] * c->predicted[i];
    }
    compare_set_scale(c, zz, zy, yy);
}

void compare_set_bands(const struct comparison *all, struct comparison_channel *c, const double edge[], size_t n_edges,
                       const double share[])
{
    free(c->bands);
    c->n_bands = n_edges - 1;
    c->bands = bf_alloc(c->n_bands, sizeof *c->bands);
    for (size_t b = 0; b < c->n_bands; b++) {
        struct comparison_band *band = &c->bands[b];
        *band = (struct comparison_band){.from_Hz = edge[b], .to_Hz = edge[b + 1], .share = share[b]};
        const double noise = noise_power(&c->noise, edge[b], edge[b + 1]);
        band->noise_ratio = noise > 0.0 ? sqrt(share[b] / noise) * c->residual_rms : nan("");
        for (size_t m = 0; m < all->n_modes; m++) /* the last: rigid motions come first */
            if (all->frequency_Hz[m] >= edge[b] && all->frequency_Hz[m] < edge[b + 1])
                band->mode = m + 1;
    }
}

size_t compare_edges_room(const struct comparison *all)
{
    return all->n_modes + 2 > 12 ? all->n_modes + 2 : 12;
}

static enum bf_status find_bands(const struct comparison *all, struct comparison_channel *c, struct bf_error *err)
{
    const size_t room = compare_edges_room(all);
    double *edge = bf_alloc(room, sizeof *edge), *share = bf_alloc(room, sizeof *share);
    const size_t n_edges = residual_band_edges(all->frequency_Hz, all->n_modes, c->dt_s, edge);
    const enum bf_status status = residual_band_shares(c->residual, c->n, c->dt_s, edge, n_edges, share, err);
    compare_set_bands(all, c, edge, n_edges, share);
    free(edge);
    free(share);
    return status;
}

void compare_set_coherence(const struct cross_spectrum *s, struct comparison_input *input)
{
    double top = 0.0, bottom = 0.0;
    input->coherence = nan("");
    for (size_t k = 1; k < s->n_bins; k++) {
        top += s->pyy[k] * coherence(s, k);
        bottom += s->pyy[k];
    }
    if (s->steadiness * (double)s->n_segments >= 3.0 && bottom > 0.0) {
        input->coherence = top / bottom;
        input->coherence_bound = coherence_bound(s, 0.05);
    }
}

static void find_coherence(const double *u, struct comparison_channel *c, struct comparison_input *input)
{
    struct cross_spectrum s;
    struct bf_error ignored;
    input->coherence = nan("");
    if (spectrum_cross(u, c->measured, c->n, c->dt_s, 0, &s, &ignored) != BF_OK)
        return;
    compare_set_coherence(&s, input);
    cross_spectrum_free(&s);
}

static enum bf_status find_inputs(const struct model *model, const struct record *record, struct comparison_channel *c,
                                  struct bf_error *err)
{
    const double *own = record_column(record, c->name);
    const size_t offset = (size_t)(c->measured - own); /* of a free decay, which has no input */
    const size_t lags = c->n > 4 * INPUT_LAGS ? INPUT_LAGS : c->n / 4;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < model->n_inputs && c->n_inputs < COMPARE_INPUTS && status == BF_OK; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        if (u == NULL || !(root_mean_square(u + offset, c->n) > 0.0))
            continue;
        struct comparison_input *input = &c->inputs[c->n_inputs++];
        input->name = model->inputs[i].name;
        find_coherence(u + offset, c, input);
        status = residual_input_correlation(u + offset, c->residual, c->n, lags, &input->correlation, err);
    }
    return status;
}

/* Three periods of the lowest mode, between 120 lags and 1200 or a quarter of the record. */
static size_t autocorrelation_lags(const struct comparison *all, const struct comparison_channel *c)
{
    const double wanted = all->n_modes > 0 ? 3.0 / (all->frequency_Hz[0] * c->dt_s) : 0.0;
    const size_t lags = wanted < LEAST_LAGS ? LEAST_LAGS : wanted > COMPARE_LAGS ? COMPARE_LAGS : (size_t)wanted;
    return lags < c->n / 4 ? lags : c->n / 4;
}

static enum bf_status analyse_channel(const struct comparison *all, const struct solved_prediction *s, size_t i,
                                      struct comparison_channel *c, struct bf_error *err)
{
    const struct predict_channel *from = &s->channels[i];
    const struct record *record = &all->records[from->record];
    const bool decay = record_is_free_decay(record);
    c->predicted = bf_alloc(c->n, sizeof *c->predicted);
    c->residual = bf_alloc(c->n, sizeof *c->residual);
    memcpy(c->predicted, s->y + from->row, c->n * sizeof *c->predicted);
    for (size_t k = 0; k < c->n; k++)
        c->residual[k] = c->measured[k] - c->predicted[k];
    c->rms = root_mean_square(c->measured, c->n);
    c->residual_rms = root_mean_square(c->residual, c->n);
    c->nrmse = residual_nrmse(c->measured, c->predicted, c->n);
    c->noise_ratio = c->noise.rms > 0.0 ? c->residual_rms / c->noise.rms : nan("");
    judge_scale(c);
    if (!decay && !excitation_level_unknown(all->model, record))
        (void)factor_scale_words(all->model, c, true, c->warning);
    residual_time_shares(c->residual, c->n, c->time_share);
    c->n_autocorrelation = autocorrelation_lags(all, c) + 1;
    c->autocorrelation = bf_alloc(c->n_autocorrelation, sizeof *c->autocorrelation);
    enum bf_status status = find_bands(all, c, err);
    if (status == BF_OK && c->n >= 3)
        status =
            residual_amplitude_shares(c->measured, c->residual, c->n, c->n / AMPLITUDE_WINDOWS, &c->amplitude, err);
    if (status == BF_OK)
        status = residual_whiteness(c->residual, c->n, &c->whiteness, err);
    if (status == BF_OK)
        status = residual_autocorrelation(c->residual, c->n, c->n_autocorrelation, c->autocorrelation, err);
    if (status == BF_OK && !decay && c->n >= 8)
        status = find_inputs(all->model, record, c, err);
    return status;
}

/* ---- All channels ---- */

static void identify_channels(const struct solved_prediction *s, struct comparison *out)
{
    out->n_channels = s->n_channels;
    out->channels = bf_alloc(s->n_channels, sizeof *out->channels);
    for (size_t i = 0; i < s->n_channels; i++) {
        const struct predict_channel *from = &s->channels[i];
        const struct record *record = &out->records[from->record];
        struct comparison_channel *c = &out->channels[i];
        c->record = from->record;
        c->name = out->model->outputs[from->output].name;
        c->held_out = from->record >= out->n_records - out->n_held_out;
        c->n = from->n;
        c->dt_s = record->dt_s;
        c->measured = from->measured;
        c->t0_s = record->t0_s + (double)(from->measured - record_column(record, c->name)) * record->dt_s;
    }
}

static enum bf_status find_modes(struct comparison *out, struct bf_error *err)
{
    double nyquist_Hz = 0.0;
    struct reduced reduced;
    for (size_t r = 0; r < out->n_records; r++)
        nyquist_Hz = fmax(nyquist_Hz, 0.5 / out->records[r].dt_s);
    const struct reduced_options options = {.top_rad = 2.0 * M_PI * nyquist_Hz, .max_modes = 40};
    const enum bf_status status = reduced_new(out->model, &options, &reduced, err);
    if (status != BF_OK)
        return status;
    out->frequency_Hz = bf_alloc(reduced.n_modes, sizeof *out->frequency_Hz);
    for (size_t m = 0; m < reduced.n_modes; m++) {
        const double f = reduced.frequency_rad[m] / (2.0 * M_PI);
        if (f > 1e-6 * nyquist_Hz && f < nyquist_Hz) /* rigid-body modes of a free beam have no band */
            out->frequency_Hz[out->n_modes++] = f;
    }
    reduced_free(&reduced);
    return BF_OK;
}

/* Root mean square over the channels that are, or are not, held out; NAN when there is none. */
static void total(const struct comparison *all, bool held_out, double *nrmse, double *noise_ratio)
{
    double errors = 0.0, ratios = 0.0, n = 0.0, n_ratios = 0.0;
    for (size_t i = 0; i < all->n_channels; i++) {
        const struct comparison_channel *c = &all->channels[i];
        if (c->held_out != held_out)
            continue;
        n += 1.0;
        errors += c->nrmse * c->nrmse;
        if (isfinite(c->noise_ratio)) {
            n_ratios += 1.0;
            ratios += c->noise_ratio * c->noise_ratio;
        }
    }
    *nrmse = n > 0.0 ? sqrt(errors / n) : nan("");
    *noise_ratio = n_ratios > 0.0 ? sqrt(ratios / n_ratios) : nan("");
}

void compare_totals(struct comparison *out)
{
    total(out, false, &out->nrmse, &out->noise_ratio);
    total(out, true, &out->check_nrmse, &out->check_noise_ratio);
}

static enum bf_status find_noise(struct comparison *out, double *rms, struct bf_error *err)
{
    for (size_t i = 0; i < out->n_channels; i++) {
        struct comparison_channel *c = &out->channels[i];
        const enum bf_status status = noise_of_channel(out->model, &out->records[c->record], c->name, &c->noise, err);
        if (status != BF_OK)
            return status;
        rms[i] = c->noise.rms;
    }
    return BF_OK;
}

enum bf_status compare_run(const struct model *model, const struct record records[], size_t n_records,
                           size_t n_held_out, const struct predict_options *options, struct comparison *out,
                           struct bf_error *err)
{
    struct solved_prediction s;
    *out = (struct comparison){.model = model, .records = records, .n_records = n_records, .n_held_out = n_held_out};
    struct own_values own;
    struct fit_options fit = {.quiet = true};
    if (options != NULL)
        fit.predict = *options;
    enum bf_status status = own_values_find(model, records, n_records, &fit, &own, err);
    if (status == BF_OK)
        status = solved_prediction_new(own.model, records, n_records, options, &s, err);
    if (status != BF_OK) {
        own_values_free(&own);
        return status;
    }
    identify_channels(&s, out);
    double *noise = bf_alloc(out->n_channels, sizeof *noise);
    status = find_modes(out, err);
    if (status == BF_OK)
        status = find_noise(out, noise, err);
    if (status == BF_OK)
        status = solved_prediction_run(own.model, records, n_records, noise, &s, err);
    for (size_t i = 0; i < out->n_channels && status == BF_OK; i++)
        status = analyse_channel(out, &s, i, &out->channels[i], err);
    out->level = s.level;
    s.level = NULL;
    out->notes = own.notes, out->n_notes = own.n_notes;
    own.notes = NULL, own.n_notes = 0;
    compare_totals(out);
    free(noise);
    solved_prediction_free(&s);
    own_values_free(&own);
    return status;
}

void compare_free(struct comparison *comparison)
{
    for (size_t i = 0; i < comparison->n_channels; i++) {
        struct comparison_channel *c = &comparison->channels[i];
        for (size_t j = 0; j < c->n_inputs; j++)
            input_correlation_free(&c->inputs[j].correlation);
        noise_free(&c->noise);
        free(c->predicted);
        free(c->residual);
        free(c->bands);
        free(c->autocorrelation);
    }
    for (size_t i = 0; i < comparison->n_notes; i++)
        free(comparison->notes[i]);
    attainable_free(&comparison->attainable);
    free(comparison->notes);
    free(comparison->channels);
    free(comparison->frequency_Hz);
    free(comparison->level);
    *comparison = (struct comparison){0};
}

const struct comparison_band *compare_worst_band(const struct comparison_channel *c)
{
    const struct comparison_band *worst = NULL;
    for (size_t b = 0; b < c->n_bands; b++)
        if (worst == NULL || c->bands[b].share > worst->share)
            worst = &c->bands[b];
    return worst;
}

bool compare_is_noise(double noise_ratio)
{
    return noise_ratio <= noise_ratio_of_noise;
}

bool compare_channel_is_noise(const struct comparison_channel *channel)
{
    return channel->noise_ratio <= noise_ratio_of_noise + noise_doubt(&channel->noise);
}
