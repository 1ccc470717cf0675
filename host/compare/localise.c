/* SPDX-License-Identifier: GPL-3.0-or-later */
/* localise.c — shares of the misfit above the noise, band by band, and their dependence on time and amplitude. */
#include "compare.h"
#include "localise_text.h"
#include "maths/maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WINDOW_PERIODS = 3 };            /* of a band's lower edge, over which motion and misfit are averaged */
static const double least_share = 0.02; /* of the whole misfit above the noise, for a part to be kept */
static const double shows = 5.0;        /* standard errors of the noise that an excess must exceed */
static const double exponent = 0.3;     /* of relative misfit against motion, from which it is said to grow or fall */
static const double level_ratio = 3.0;  /* between records or parts of one, for such an exponent */

/* A band of a channel before shares are known. */
struct localised_band {
    struct localised part;
    size_t from, to;        /* bins */
    double weight;          /* excess over noise variance, times samples */
    double noise;           /* mean square of the noise in the band */
    double motion, misfit;  /* rms of the measured signal, and of the misfit above the noise */
    double exponent_inside; /* of relative misfit against motion within the record; 0 when it cannot be told */
};

struct localised_bands {
    size_t n_bands;
    struct localised_band *bands;
};

/* ---- One channel: its spectra, and the excess of each band ---- */

struct channel_work {
    const struct misfit_channel *c;
    const struct fft *plan;
    double complex *R, *Z; /* [n/2 + 1] */
};

static enum bf_status channel_new(const struct misfit_channel *c, struct channel_work *out, struct bf_error *err)
{
    *out = (struct channel_work){.c = c};
    const enum bf_status status = fft_get(c->n, &out->plan, err);
    if (status != BF_OK)
        return status;
    out->R = bf_alloc(c->n / 2 + 1, sizeof *out->R);
    out->Z = bf_alloc(c->n / 2 + 1, sizeof *out->Z);
    fft_forward(out->plan, c->residual, out->R);
    fft_forward(out->plan, c->measured, out->Z);
    return BF_OK;
}

static void channel_free(struct channel_work *w)
{
    free(w->R);
    free(w->Z);
}

/* Bins [from, to) of a band; the last band has the Nyquist bin. */
static void bins_of(const struct channel_work *w, double from_Hz, double to_Hz, size_t *from, size_t *to)
{
    const double bins_a_Hz = (double)w->c->n * w->c->dt_s;
    *from = (size_t)ceil(from_Hz * bins_a_Hz - 1e-9);
    *to = to_Hz >= 0.5 / w->c->dt_s ? w->c->n / 2 + 1 : (size_t)ceil(to_Hz * bins_a_Hz - 1e-9);
}

/* Mean square of the part of a signal between two bins. */
static double band_power(const double complex *X, size_t n, size_t from, size_t to)
{
    double sum = 0.0;
    for (size_t k = from; k < to; k++)
        sum += (k == 0 || 2 * k == n ? 1.0 : 2.0) * (creal(X[k]) * creal(X[k]) + cimag(X[k]) * cimag(X[k]));
    return sum / ((double)n * (double)n);
}

/* x[n]: that part in time. */
static void band_signal(const struct channel_work *w, const double complex *X, size_t from, size_t to, double *x)
{
    const size_t m = w->c->n / 2 + 1;
    double complex *part = bf_alloc(m, sizeof *part);
    for (size_t k = from; k < to && k < m; k++)
        part[k] = X[k];
    fft_inverse(w->plan, part, x);
    free(part);
}

/* ---- Time and amplitude within one record ---- */

static double rms_above(double power, double noise)
{
    return sqrt(fmax(power - noise, 0.0));
}

/* Share of the band's excess in the second half of its motion's energy. */
static double late_share(const double *z, const double *r, size_t n, double noise)
{
    double energy = 0.0, total = 0.0, early = 0.0, late = 0.0;
    for (size_t i = 0; i < n; i++)
        total += z[i] * z[i];
    for (size_t i = 0; i < n; i++) {
        energy += z[i] * z[i];
        *(energy < 0.5 * total ? &early : &late) += r[i] * r[i] - noise;
    }
    early = fmax(early, 0.0);
    late = fmax(late, 0.0);
    return early + late > 0.0 ? late / (early + late) : 0.5;
}

static void measure_in_time(const struct channel_work *w, struct localised_band *band)
{
    const size_t n = w->c->n;
    double *z = bf_alloc(n, sizeof *z), *r = bf_alloc(n, sizeof *r);
    band_signal(w, w->Z, band->from, band->to, z);
    band_signal(w, w->R, band->from, band->to, r);
    band->part.late_share = late_share(z, r, n, band->noise);
    const double middle_Hz = sqrt(fmax(band->part.from_Hz, 0.25 * band->part.to_Hz) * band->part.to_Hz);
    const double wanted = WINDOW_PERIODS / (middle_Hz * w->c->dt_s);
    const size_t window = wanted < (double)n / 8.0 ? (size_t)wanted + 1 : n / 8 + 1;
    struct amplitude_shares a;
    struct bf_error ignored;
    const double power = band_power(w->R, n, band->from, band->to);
    if (n >= 64 && residual_amplitude_shares(z, r, n, window, &a, &ignored) == BF_OK) {
        double motion[3], excess[3];
        const double cells = fmax(1.0, (double)(band->to - band->from) / 3.0);
        for (int g = 0; g < 3; g++) { /* mean squares of a third of the samples */
            const double mean = 3.0 * a.share[g] * power;
            motion[g] = a.relative[g] > 0.0 ? sqrt(mean) / a.relative[g] : 0.0;
            excess[g] = mean - band->noise > shows * band->noise / sqrt(cells) ? rms_above(mean, band->noise) : 0.0;
        }
        if (excess[1] > 0.0 && motion[2] > level_ratio * motion[1] && motion[1] > 0.0)
            band->exponent_inside = log(excess[2] / excess[1]) / log(motion[2] / motion[1]) - 1.0;
    }
    free(z);
    free(r);
}

/* ---- All ---- */

static enum bf_status fill_bands(const struct misfit_channel channels[], size_t i, const double frequency_Hz[],
                                 size_t n_modes, struct localised_bands *out, struct bf_error *err)
{
    const struct misfit_channel *c = &channels[i];
    struct channel_work w;
    enum bf_status status = channel_new(c, &w, err);
    double *edge = bf_alloc(n_modes + 12, sizeof *edge);
    size_t used = 0; /* modes below the Nyquist frequency */
    while (used < n_modes && frequency_Hz[used] < 0.5 / c->dt_s)
        used++;
    const size_t n_edges = residual_band_edges(frequency_Hz, used, c->dt_s, edge);
    for (size_t b = 0; b + 1 < n_edges && status == BF_OK; b++) {
        struct localised_band *band = &out->bands[out->n_bands++];
        *band = (struct localised_band){.part = {.channel = i, .from_Hz = edge[b], .to_Hz = edge[b + 1]}};
        bins_of(&w, edge[b], edge[b + 1], &band->from, &band->to);
        const double power = band_power(w.R, c->n, band->from, band->to);
        const double cells = fmax(1.0, (double)(band->to - band->from));
        band->noise = noise_power(c->noise, edge[b], edge[b + 1]);
        band->motion = sqrt(band_power(w.Z, c->n, band->from, band->to));
        const double doubt = hypot(band->noise / sqrt(cells), 2.0 * band->noise * c->noise->rms_sd / c->noise->rms);
        const double excess = power - band->noise > 3.0 * doubt ? power - band->noise : 0.0;
        band->misfit = sqrt(excess);
        band->weight = excess / (c->noise->rms * c->noise->rms) * (double)c->n;
        band->part.noise_ratio = band->noise > 0.0 ? sqrt(power / band->noise) : 1.0;
        band->part.relative = band->motion > 0.0 ? band->misfit / band->motion : 0.0;
        for (size_t m = 0; m < used; m++) /* the last: rigid motions come first */
            if (frequency_Hz[m] >= edge[b] && frequency_Hz[m] < edge[b + 1])
                band->part.mode = m + 1;
        if (excess > 0.0)
            measure_in_time(&w, band);
    }
    free(edge);
    channel_free(&w);
    return status;
}

/*
 * Against other records of the same channel: in which of them the same band moves more, and is the misfit a larger share of
 * the motion there? Relative misfit ~ motion^p between the weakest and the strongest record of the band; records of one
 * level: the exponent within the record.
 */
static enum localise_amplitude judge_amplitude(const struct localised_bands *w, const struct misfit_channel channels[],
                                               const struct localised_band *band)
{
    const struct localised_band *weak = band, *strong = band;
    for (size_t i = 0; i < w->n_bands; i++) {
        const struct localised_band *b = &w->bands[i];
        const bool same = strcmp(channels[b->part.channel].channel, channels[band->part.channel].channel) == 0 &&
                          fabs(b->part.from_Hz - band->part.from_Hz) < 1e-6 * band->part.to_Hz;
        if (!same || !(b->motion > 0.0))
            continue;
        weak = b->motion < weak->motion ? b : weak;
        strong = b->motion > strong->motion ? b : strong;
    }
    double p = band->exponent_inside;
    if (strong->motion > level_ratio * weak->motion) {
        const double floor_weak = 0.5 * sqrt(weak->noise), floor_strong = 0.5 * sqrt(strong->noise);
        const double low = fmax(weak->misfit, floor_weak) / weak->motion;
        const double high = fmax(strong->misfit, floor_strong) / strong->motion;
        p = log(high / low) / log(strong->motion / weak->motion);
    }
    return p > exponent ? AMPLITUDE_LARGE : p < -exponent ? AMPLITUDE_SMALL : AMPLITUDE_ALL;
}

static int by_share(const void *a, const void *b)
{
    const struct localised *x = a, *y = b;
    if (x->share < y->share || x->share > y->share)
        return x->share < y->share ? 1 : -1;
    return (x->channel > y->channel) - (x->channel < y->channel);
}

static void keep_parts(const struct localised_bands *w, const struct misfit_channel channels[], size_t rows,
                       struct localisation *out)
{
    double total = 0.0;
    for (size_t i = 0; i < w->n_bands; i++)
        total += w->bands[i].weight;
    out->excess = rows > 0 ? total / (double)rows : 0.0;
    out->parts = bf_alloc(w->n_bands + 1, sizeof *out->parts);
    for (size_t i = 0; i < w->n_bands; i++) {
        struct localised_band *band = &w->bands[i];
        if (!(band->weight > least_share * total))
            continue;
        band->part.share = band->weight / total;
        band->part.amplitude = judge_amplitude(w, channels, band);
        out->parts[out->n++] = band->part;
    }
    qsort(out->parts, out->n, sizeof *out->parts, by_share);
}

enum bf_status localise_misfit(const struct misfit_channel channels[], size_t n_channels, const double frequency_Hz[],
                               size_t n_modes, struct localisation *out, struct bf_error *err)
{
    struct localised_bands w = {0};
    enum bf_status status = BF_OK;
    size_t rows = 0;
    *out = (struct localisation){0};
    w.bands = bf_alloc(n_channels * (n_modes + 12) + 1, sizeof *w.bands);
    for (size_t i = 0; i < n_channels && status == BF_OK; i++) {
        if (channels[i].noise->method == NOISE_NONE || !(channels[i].noise->rms > 0.0) || channels[i].n < 2)
            continue;
        rows += channels[i].n;
        status = fill_bands(channels, i, frequency_Hz, n_modes, &w, err);
    }
    if (status == BF_OK) {
        keep_parts(&w, channels, rows, out);
        localise_describe(channels, n_channels, out);
    }
    free(w.bands);
    return status;
}

void localise_free(struct localisation *localisation)
{
    free(localisation->parts);
    *localisation = (struct localisation){0};
}
