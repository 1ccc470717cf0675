/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_plot_misfit.c — the misfit over the noise, by band of a mode and by amplitude of the motion. */
#include "diagnose_pictures.h"
#include "show.h"
#include "plot.h"
#include "maths/maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Amplitudes in steps of a factor two; a level needs LEAST_SAMPLES to be drawn. Running rms over n/WINDOWS samples. */
enum { LEVELS = 14, LEAST_SAMPLES = 30, WINDOWS = 64 };

/* Σ of squares and their weight, for each of the four states. */
struct sums {
    size_t n;
    double *top[PLOT_STATES], *bottom[PLOT_STATES]; /* [n] */
};

static void sums_alloc(struct sums *sums, size_t n)
{
    sums->n = n;
    for (int s = 0; s < PLOT_STATES; s++) {
        sums->top[s] = bf_alloc(n, sizeof(double));
        sums->bottom[s] = bf_alloc(n, sizeof(double));
    }
}

/* top becomes √(top/bottom), NAN where there is nothing. */
static void sums_finish(struct sums *sums, double least)
{
    for (int s = 0; s < PLOT_STATES; s++)
        for (size_t k = 0; k < sums->n; k++)
            sums->top[s][k] = sums->bottom[s][k] > least ? sqrt(sums->top[s][k] / sums->bottom[s][k]) : nan("");
}

static void sums_free(struct sums *sums)
{
    for (int s = 0; s < PLOT_STATES; s++)
        free(sums->top[s]), free(sums->bottom[s]);
}

/* The channel's part of each band's mean square over the noise's; edges are the baseline's, so that both models share them. */
static enum bf_status add_bands(const struct comparison_channel *edges, const struct comparison_channel *c, int state,
                                struct sums *sums, struct bf_error *err)
{
    double *edge = bf_alloc(edges->n_bands + 1, sizeof *edge), *share = bf_alloc(edges->n_bands, sizeof *share);
    for (size_t b = 0; b < edges->n_bands; b++) {
        edge[b] = edges->bands[b].from_Hz;
        edge[b + 1] = edges->bands[b].to_Hz;
    }
    const enum bf_status status =
        residual_band_shares(c->residual, c->n, c->dt_s, edge, edges->n_bands + 1, share, err);
    for (size_t b = 0; b < edges->n_bands && b < sums->n && !status; b++) {
        /* noise in the band = residual there / noise_ratio, both of the baseline */
        const double ratio = edges->bands[b].noise_ratio;
        const double noise = edges->bands[b].share * edges->residual_rms * edges->residual_rms / (ratio * ratio);
        if (!(noise > 0.0) || !isfinite(noise))
            continue;
        sums->top[state][b] += share[b] * c->residual_rms * c->residual_rms / noise;
        sums->bottom[state][b] += 1.0;
    }
    free(edge), free(share);
    return status;
}

/* Running rms of z over `window` samples, centred; size: [n]. */
static void running_rms(const double *z, size_t n, size_t window, double *size)
{
    double sum = 0.0;
    const size_t half = window / 2;
    for (size_t k = 0; k < n + half; k++) {
        if (k < n)
            sum += z[k] * z[k];
        if (k > 2 * half)
            sum -= z[k - 2 * half - 1] * z[k - 2 * half - 1];
        if (k >= half)
            size[k - half] = sqrt(fmax(0.0, sum) / (double)(2 * half + 1));
    }
}

static double largest_motion(const struct comparison *all, const char *channel)
{
    double largest = 0.0;
    for (size_t i = 0; i < all->n_channels; i++) {
        const struct comparison_channel *c = &all->channels[i];
        if (strcmp(c->name, channel) != 0)
            continue;
        double *size = bf_alloc(c->n, sizeof *size);
        running_rms(c->measured, c->n, c->n / WINDOWS, size);
        for (size_t k = 0; k < c->n; k++)
            largest = fmax(largest, size[k]);
        free(size);
    }
    return largest;
}

static void add_levels(const struct comparison_channel *c, double largest, int state, struct sums *sums)
{
    if (!(largest > 0.0) || !(c->noise.rms > 0.0))
        return;
    double *size = bf_alloc(c->n, sizeof *size);
    running_rms(c->measured, c->n, c->n / WINDOWS, size);
    for (size_t k = 0; k < c->n; k++) {
        const double octaves = size[k] > 0.0 ? -log2(size[k] / largest) : (double)LEVELS, r = c->residual[k];
        const size_t level = octaves <= 0.0 ? 0 : (size_t)octaves;
        if (level >= LEVELS)
            continue;
        sums->top[state][level] += r * r / (c->noise.rms * c->noise.rms);
        sums->bottom[state][level] += 1.0;
    }
    free(size);
}

static enum bf_status collect(const struct diagnose_pictures *p, struct sums *bands, struct sums *levels,
                              struct bf_error *err)
{
    const struct comparison *sides[2] = {&p->before, &p->after};
    enum bf_status status = BF_OK;
    for (int side = 0; side < 2; side++)
        for (size_t i = 0; i < sides[side]->n_channels && i < p->before.n_channels && !status; i++) {
            const struct comparison_channel *c = &sides[side]->channels[i];
            const int state = (side == 0 ? PLOT_BEFORE : PLOT_AFTER) + (c->held_out ? 1 : 0);
            status = add_bands(&p->before.channels[i], c, state, bands, err);
            add_levels(c, largest_motion(&p->before, c->name), state, levels);
        }
    return status;
}

enum bf_status diagnose_plot_misfit(const struct diagnose_pictures *p, struct bf_error *err)
{
    const struct comparison_channel *widest = NULL;
    for (size_t i = 0; i < p->before.n_channels; i++)
        if (widest == NULL || p->before.channels[i].n_bands > widest->n_bands)
            widest = &p->before.channels[i];
    const size_t n_bands = widest != NULL ? widest->n_bands : 0;
    const bool modes = p->before.n_modes >= n_bands && n_bands > 0;
    double *band_Hz = bf_alloc(n_bands, sizeof *band_Hz), level[LEVELS];
    char title[280];
    struct sums bands = {0}, levels = {0};
    (void)snprintf(title, sizeof title, "Misfit %s", p->heading);
    sums_alloc(&bands, n_bands);
    sums_alloc(&levels, LEVELS);
    for (size_t b = 0; b < n_bands; b++)
        band_Hz[b] = modes ? p->before.frequency_Hz[b] : widest->bands[b].to_Hz;
    for (int k = 0; k < LEVELS; k++)
        level[k] = exp2(-0.5 - k);
    enum bf_status status = collect(p, &bands, &levels, err);
    sums_finish(&bands, 0.0);
    sums_finish(&levels, LEAST_SAMPLES);
    struct plot_misfit picture = {.directory = p->directory,
                                  .stem = "diagnose-misfit",
                                  .title = title,
                                  .n_bands = n_bands,
                                  .band_Hz = band_Hz,
                                  .bands_are_modes = modes,
                                  .n_levels = LEVELS,
                                  .level = level};
    for (int s = 0; s < PLOT_STATES; s++) {
        picture.band[s] = bands.top[s];
        picture.at_level[s] = levels.top[s];
    }
    if (!status)
        status = plot_misfit(&picture, err);
    sums_free(&bands);
    sums_free(&levels);
    free(band_Hz);
    return status;
}
