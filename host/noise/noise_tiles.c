/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_tiles.h"
#include "maths/maths.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { TILE_TIMES = 2, TILE_BINS = 4 };

/* About 16 segments a record: resonances and harmonics are resolved in frequency, impacts and sweeps in time. */
static void lay_tiles(size_t n, struct noise_tiles *w)
{
    size_t segment = n / 16 < 32 ? 32 : n / 16 > 512 ? 512 : n / 16;
    segment -= segment % (2 * TILE_BINS);
    while (fft_good_size(segment) != segment)
        segment -= 2 * TILE_BINS;
    w->segment = segment;
    w->n_rows = segment / 2 / TILE_BINS;
    w->n_times = ((n - segment) / (segment / 2) + 1) / TILE_TIMES;
    if (w->n_times < 1)
        w->n_times = 1;
    w->n_tiles = w->n_times * w->n_rows;
    w->cells_per_tile = 0.5 * (double)n / (double)w->n_tiles;
    w->n_bins = n / 2 + 1;
    w->power = bf_alloc(w->n_tiles, sizeof *w->power);
    w->gain = bf_alloc(w->n_tiles, sizeof *w->gain);
    w->quiet = bf_alloc(w->n_tiles, sizeof *w->quiet);
    w->usable = bf_alloc(w->n_tiles, sizeof *w->usable);
    w->chosen = bf_alloc(w->n_tiles, sizeof *w->chosen);
    w->periodogram = bf_alloc(w->n_bins, sizeof *w->periodogram);
    for (int d = 0; d < NOISE_DRAWS; d++)
        w->draw[d] = bf_alloc(w->n_tiles, sizeof *w->draw[d]);
}

/* tile: [n_times · n_rows] mean power; 1 everywhere for white noise of variance 1. */
static enum bf_status tile_powers(const struct noise_tiles *p, const double *r, size_t n, double *tile,
                                  struct bf_error *err)
{
    const struct fft *plan;
    const size_t m = p->segment, hop = m / 2;
    enum bf_status status = fft_get(m, &plan, err);
    if (status != BF_OK)
        return status;
    double *w = bf_alloc(m, sizeof *w), *x = bf_alloc(m, sizeof *x), energy = 0.0;
    double complex *X = bf_alloc(m / 2 + 1, sizeof *X);
    window_fill(WINDOW_BLACKMAN_HARRIS, m, w);
    for (size_t i = 0; i < m; i++)
        energy += w[i] * w[i];
    memset(tile, 0, p->n_times * p->n_rows * sizeof *tile);
    for (size_t s = 0; s < p->n_times * TILE_TIMES && s * hop + m <= n; s++) {
        for (size_t i = 0; i < m; i++)
            x[i] = w[i] * r[s * hop + i];
        fft_forward(plan, x, X);
        double *row = tile + (s / TILE_TIMES) * p->n_rows;
        for (size_t k = 0; k <= p->n_rows * TILE_BINS; k++) { /* a bin on the edge of two rows belongs half to each */
            const double power = creal(X[k] * conj(X[k])) / (energy * TILE_BINS * TILE_TIMES);
            const size_t at = k / TILE_BINS;
            const bool edge = k % TILE_BINS == 0;
            if (at < p->n_rows)
                row[at] += edge ? 0.5 * power : power;
            if (edge && at > 0)
                row[at - 1] += 0.5 * power;
        }
    }
    free(w);
    free(x);
    free(X);
    return BF_OK;
}

/* Reproducible normal deviates: the same record gives the same estimate on every run. */
static double normal_deviate(uint64_t *state)
{
    double sum = 0.0;
    for (int i = 0; i < 4; i++) { /* SplitMix64 (Steele et al. 2014); four uniforms of 16 bits each a word */
        uint64_t x = *state += 0x9e3779b97f4a7c15U;
        x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
        x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
        x ^= x >> 31;
        for (int j = 0; j < 4; j++, x >>= 16)
            sum += (double)(x & 0xffffU);
    }
    return (sum / 65535.0 - 8.0) * sqrt(12.0 / 16.0);
}

static enum bf_status simulate_noise(struct noise_tiles *w, const struct local_rational *fit, size_t n,
                                     struct bf_error *err)
{
    uint64_t state = 1;
    double *x = bf_alloc(n, sizeof *x);
    enum bf_status status = BF_OK;
    for (int d = 0; d < NOISE_DRAWS && status == BF_OK; d++) {
        for (size_t i = 0; i < n; i++)
            x[i] = normal_deviate(&state);
        status = local_rational_residual(fit, x, x, err);
        if (status == BF_OK)
            status = tile_powers(w, x, n, w->draw[d], err);
        for (size_t i = 0; i < w->n_tiles; i++)
            w->gain[i] += w->draw[d][i] / NOISE_DRAWS;
    }
    for (size_t i = 0; i < w->n_tiles; i++)
        w->usable[i] = w->gain[i] > 0.3;
    free(x);
    return status;
}

/* quiet[tile] = Σ power/floor over the eight neighbours ÷ Σ gain over them. floor NULL: 1. */
static void levels_of(const struct noise_tiles *w, const double *power, const double *floor, double *quiet)
{
    const long nt = (long)w->n_times, nr = (long)w->n_rows;
    for (long t = 0; t < nt; t++)
        for (long r = 0; r < nr; r++) {
            double top = 0.0, bottom = 0.0;
            for (long dt = -1; dt <= 1; dt++)
                for (long dr = -1; dr <= 1; dr++) {
                    const long a = t + dt, b = r + dr, i = a * nr + b;
                    if ((dt == 0 && dr == 0) || a < 0 || a >= nt || b < 0 || b >= nr || !w->usable[i])
                        continue;
                    top += power[i] / (floor ? floor[b] : 1.0);
                    bottom += w->gain[i];
                }
            quiet[t * nr + r] = bottom > 0.0 ? top / bottom : HUGE_VAL;
        }
}

void noise_tiles_neighbours(struct noise_tiles *w, const double *floor)
{
    levels_of(w, w->power, floor, w->quiet);
}

void noise_tiles_threshold(struct noise_tiles *w, double threshold)
{
    w->threshold = threshold;
    double top = 0.0, bottom = 0.0;
    for (int d = 0; d < NOISE_DRAWS; d++) {
        levels_of(w, w->draw[d], NULL, w->quiet);
        for (size_t i = 0; i < w->n_tiles; i++)
            if (w->usable[i] && w->quiet[i] < threshold) {
                top += w->draw[d][i];
                bottom += w->gain[i];
            }
    }
    w->bias = bottom > 0.0 ? top / bottom : 1.0;
}

enum bf_status noise_tiles_fill(const struct local_rational *fit, const double *z, size_t n, struct noise_tiles *w,
                                struct bf_error *err)
{
    *w = (struct noise_tiles){0};
    lay_tiles(n, w);
    double *r = bf_alloc(n, sizeof *r);
    enum bf_status status = simulate_noise(w, fit, n, err);
    if (status == BF_OK)
        status = local_rational_residual(fit, z, r, err);
    if (status == BF_OK)
        status = tile_powers(w, r, n, w->power, err);
    if (status == BF_OK)
        status = spectrum_amplitude(r, n, WINDOW_NONE, w->periodogram, err);
    for (size_t k = 0; k < w->n_bins; k++)
        w->periodogram[k] *= w->periodogram[k];
    free(r);
    return status;
}

void noise_tiles_free(struct noise_tiles *w)
{
    for (int d = 0; d < NOISE_DRAWS; d++)
        free(w->draw[d]);
    free(w->power);
    free(w->gain);
    free(w->quiet);
    free(w->usable);
    free(w->chosen);
    free(w->periodogram);
    *w = (struct noise_tiles){0};
}
