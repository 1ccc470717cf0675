/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_floor.h"
#include "noise_tiles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double strong_evidence =
    6.0; /* of the criterion, for a coloured spectrum to be preferred to a white one (Kass & Raftery 1995) */
static const double loud_threshold = 4.0; /* of a tile itself; noise alone exceeds it less than once in 10⁴ tiles */

/* ---- The smooth spectrum through the chosen tiles ---- */

/* (diag(d) + λ DᵀD) x = b for the first-difference D; x replaces b. Thomas' algorithm; rows ≤ FLOOR_ROWS_MAX. */
static void solve_smooth(const double *d, double lambda, size_t n, double *b)
{
    double c[FLOOR_ROWS_MAX] = {0};
    for (size_t i = 0; i < n; i++) {
        const double neighbours = (i > 0 ? 1.0 : 0.0) + (i + 1 < n ? 1.0 : 0.0);
        const double pivot = d[i] + lambda * neighbours + (i > 0 ? lambda * c[i - 1] : 0.0);
        c[i] = -lambda / pivot;
        b[i] = (b[i] + (i > 0 ? lambda * b[i - 1] : 0.0)) / pivot;
    }
    for (size_t i = n; i > 1; i--)
        b[i - 2] -= c[i - 2] * b[i - 1];
}

/* Trace of (diag(d) + λ DᵀD)⁻¹ diag(d): how many free numbers the smooth curve has. */
static double free_numbers(const double *d, double lambda, size_t n)
{
    double trace = 0.0;
    for (size_t i = 0; i < n; i++) {
        double e[FLOOR_ROWS_MAX] = {0};
        e[i] = d[i];
        solve_smooth(d, lambda, n, e);
        trace += e[i];
    }
    return trace;
}

/*
 * Whittle: minimise Σ count (η + mean e^(−η)) + ½ λ Σ (Δη)² by Fisher scoring. η starts as given. Returns twice the
 * likelihood part. mean, count, eta: [n].
 */
static double whittle(const double *mean, const double *count, double lambda, size_t n, double *eta)
{
    double deviance = 0.0;
    for (int pass = 0; pass < 40; pass++) {
        double next[FLOOR_ROWS_MAX], change = 0.0;
        for (size_t i = 0; i < n; i++)
            next[i] = count[i] * (eta[i] + fmin(2.0, mean[i] * exp(-eta[i]) - 1.0));
        solve_smooth(count, lambda, n, next);
        for (size_t i = 0; i < n; i++) {
            change = fmax(change, fabs(next[i] - eta[i]));
            eta[i] = next[i];
        }
        if (change < 1e-9)
            break;
    }
    for (size_t i = 0; i < n; i++)
        deviance += 2.0 * count[i] * (eta[i] + mean[i] * exp(-eta[i]));
    return deviance;
}

/* variance: [n] smooth; returns whether the white spectrum has the best criterion. count 0 where a row says nothing. */
static bool smooth_rows(const double *mean, const double *count, size_t n, bool white_only, double *variance)
{
    double total = 0.0, power = 0.0;
    for (size_t i = 0; i < n; i++) {
        total += count[i];
        power += count[i] * mean[i];
        variance[i] = 0.0;
    }
    if (!(power > 0.0))
        return true;
    const double level = log(power / total);
    double best = 2.0 * total * (level + 1.0) + log(total) - strong_evidence;
    bool white = true;
    for (size_t i = 0; i < n; i++)
        variance[i] = power / total;
    for (int step = 0; step < 11 && !white_only; step++) { /* from nearly straight to nearly free */
        const double lambda = ldexp(30.0 * total / (double)n, -step);
        double eta[FLOOR_ROWS_MAX];
        for (size_t i = 0; i < n; i++)
            eta[i] = level;
        const double deviance = whittle(mean, count, lambda, n, eta);
        const double criterion = deviance + log(total) * free_numbers(count, lambda, n);
        if (criterion < best) {
            best = criterion;
            white = false;
            for (size_t i = 0; i < n; i++)
                variance[i] = exp(eta[i]);
        }
    }
    return white;
}

/* ---- Choosing tiles ---- */

/* Sums over the chosen tiles of each row; rows with less than `support` of their tiles chosen say nothing. */
static double collect_rows(const struct noise_tiles *w, double bias, double support, double *mean, double *count)
{
    const size_t nr = w->n_rows;
    double total = 0.0;
    for (size_t r = 0; r < nr; r++) {
        double top = 0.0, bottom = 0.0;
        size_t chosen = 0, usable = 0;
        for (size_t i = r; i < w->n_tiles; i += nr) {
            usable += w->usable[i];
            if (!w->chosen[i])
                continue;
            chosen++;
            top += w->power[i];
            bottom += w->gain[i];
        }
        const bool enough = bottom > 0.0 && (double)chosen >= support * (double)usable;
        mean[r] = enough ? top / (bottom * bias) : 0.0;
        count[r] = enough ? bottom * w->cells_per_tile : 0.0;
        total += count[r];
    }
    return total;
}

/* The given quantile of all tiles. */
static double low_level(const struct noise_tiles *w, double quantile)
{
    double *level = bf_alloc(w->n_tiles, sizeof *level);
    size_t n = 0;
    for (size_t i = 0; i < w->n_tiles; i++)
        if (w->usable[i])
            level[n++] = w->power[i] / w->gain[i];
    sort_ascending(n, level);
    const double x = n > 0 ? level[(size_t)(quantile * (double)(n - 1))] : 0.0;
    free(level);
    return x;
}

static void choose_tiles(struct noise_tiles *w, const double *variance)
{
    const size_t nr = w->n_rows;
    noise_tiles_neighbours(w, variance);
    for (size_t r = 0; r < nr; r++)
        for (size_t i = r; i < w->n_tiles; i += nr)
            w->chosen[i] =
                w->usable[i] && w->quiet[i] < w->threshold && w->power[i] < loud_threshold * w->gain[i] * variance[r];
}

static void report(const struct noise_tiles *w, const double *count, bool white, struct noise_floor *out)
{
    double total = 0.0, sum = 0.0, variance = 0.0; /* of the estimated row variances: S²/count */
    for (size_t r = 0; r < w->n_rows; r++) {
        total += count[r];
        sum += count[r] > 0.0 ? out->variance[r] : 0.0;
        variance += count[r] > 0.0 ? out->variance[r] * out->variance[r] / count[r] : 0.0;
    }
    size_t n_chosen = 0, n_usable = 0;
    for (size_t i = 0; i < w->n_tiles; i++) {
        n_chosen += w->chosen[i];
        n_usable += w->usable[i];
    }
    out->n_rows = w->n_rows;
    out->n_cells = (size_t)total;
    out->relative_sd = white ? 0.5 / sqrt(total) : 0.5 * sqrt(variance) / sum;
    out->used_share = (double)n_chosen / (double)n_usable;
    out->white = white;
}

/* A level for all rows: choice and level are iterated to their fixed point from below. false: nothing was chosen. */
static bool white_floor(struct noise_tiles *w, struct noise_floor *out)
{
    const size_t nr = w->n_rows;
    double mean[FLOOR_ROWS_MAX] = {0.0}, count[FLOOR_ROWS_MAX] = {0.0}, total = 0.0;
    double level = 1.3 * low_level(w, 0.05);
    for (int pass = 0; pass < 60; pass++) {
        const double old = level;
        for (size_t r = 0; r < nr; r++)
            out->variance[r] = level;
        choose_tiles(w, out->variance);
        total = collect_rows(w, w->bias, 0.0, mean, count);
        if (total < 4.0)
            level *= 1.3;
        else
            smooth_rows(mean, count, nr, true, out->variance);
        level = total < 4.0 ? level : out->variance[0];
        if (fabs(level / old - 1.0) < 1e-9)
            break;
    }
    report(w, count, true, out);
    return total >= 4.0;
}

/* Variance over squared mean of the tiles of a row over time, over what simulated noise has; 0 for too few tiles. */
static double time_scatter(const struct noise_tiles *w, size_t r)
{
    const size_t nr = w->n_rows;
    double n = 0.0, mean = 0.0, scatter = 0.0, expected = 0.0;
    for (size_t i = r; i < w->n_tiles; i += nr)
        if (w->usable[i]) {
            n += 1.0;
            mean += w->power[i] / w->gain[i];
        }
    mean /= n > 0.0 ? n : 1.0;
    if (n < 6.0 || !(mean > 0.0))
        return 0.0;
    for (size_t i = r; i < w->n_tiles; i += nr) {
        if (!w->usable[i])
            continue;
        const double x = w->power[i] / w->gain[i] / mean - 1.0;
        scatter += x * x / (n - 1.0);
        for (int d = 0; d < NOISE_DRAWS; d++) {
            const double y = w->draw[d][i] / w->gain[i] - 1.0;
            expected += y * y / (n * NOISE_DRAWS);
        }
    }
    return scatter / expected;
}

/* How far a row's scatter over time, and over the bins of the whole record inside it, is above what noise has; 1: the limit. */
static double unsteadiness(const struct noise_tiles *w, size_t r)
{
    static const double most_in_time = 2.8;
    const size_t nr = w->n_rows;
    const size_t from = 1 + r * (w->n_bins - 1) / nr, to = 1 + (r + 1) * (w->n_bins - 1) / nr;
    const double n = (double)(to - from);
    double mean = 0.0, square = 0.0;
    for (size_t k = from; k < to; k++) {
        mean += w->periodogram[k] / n;
        square += w->periodogram[k] * w->periodogram[k] / n;
    }
    const double most_over_bins = (2.0 + 10.0 / sqrt(n)) * mean * mean;
    return fmax(time_scatter(w, r) / most_in_time, most_over_bins > 0.0 ? square / most_over_bins : HUGE_VAL);
}

/*
 * Distortion varies with time, or is strong at the resonances only. Rows that are far from steady lose their count. Rows
 * just above the limit keep it: noise alone exceeds the limit at times, and without the lowest row the power of a steep
 * spectrum would be missed. Returns how many rows are not steady.
 */
static size_t find_unsteady_rows(const struct noise_tiles *w, double *count)
{
    static const double far = 2.0;
    size_t unsteady = 0;
    for (size_t r = 0; r < w->n_rows; r++) {
        const double above = unsteadiness(w, r);
        unsteady += !(above < 1.0);
        if (!(above < far))
            count[r] = 0.0;
    }
    return unsteady;
}

/*
 * A tenth of the rows may be unsteady, and two of 16 or more. Noise alone has two such rows of 16 in about 1 % of channels
 * (2048 samples of first order, coefficient 0.5 to 0.9: `make false-alarms`); a white floor would be half their noise or less.
 */
static size_t most_unsteady(size_t n_rows)
{
    const size_t tenth = n_rows / 10;
    return n_rows >= 16 && tenth < 2 ? 2 : tenth;
}

/*
 * A smooth spectrum through the steady rows, interpolated over the others. false: the record is not steady enough to tell
 * colour from distortion.
 */
static bool coloured_floor(struct noise_tiles *w, struct noise_floor *out)
{
    const size_t nr = w->n_rows;
    double mean[FLOOR_ROWS_MAX], count[FLOOR_ROWS_MAX], level[FLOOR_ROWS_MAX] = {0}, seen = 0.0, smooth = 0.0, total;
    memcpy(w->chosen, w->usable, w->n_tiles * sizeof *w->chosen);
    collect_rows(w, 1.0, 0.0, mean, count);
    if (find_unsteady_rows(w, count) > most_unsteady(nr))
        return false;
    smooth_rows(mean, count, nr, false, out->variance);
    for (size_t r = 0; r < nr; r++)
        level[r] = count[r] > 0.0 ? mean[r] : out->variance[r];
    choose_tiles(w, level);
    total = collect_rows(w, w->bias, 0.5, mean, count);
    if (total < 4.0)
        return false;
    const bool white = smooth_rows(mean, count, nr, false, out->variance);
    for (size_t r = 0; r < nr; r++) {
        seen += count[r] > 0.0 ? mean[r] : 0.0;
        smooth += count[r] > 0.0 ? out->variance[r] : 0.0;
    }
    for (size_t r = 0; r < nr && !white; r++)
        out->variance[r] *= seen / smooth; /* smoothing must not lose power on steep slopes */
    report(w, count, white, out);
    return true;
}

enum bf_status noise_floor_estimate(const struct local_rational *fit, const double *z, size_t n,
                                    struct noise_floor *out, struct bf_error *err)
{
    struct noise_tiles w;
    *out = (struct noise_floor){0};
    enum bf_status status = noise_tiles_fill(fit, z, n, &w, err);
    if (status == BF_OK) {
        struct noise_floor other = {0};
        noise_tiles_threshold(&w, 1.5);
        if (!white_floor(&w, out))
            *out = (struct noise_floor){0};
        if (coloured_floor(&w, &other) && !other.white) {
            *out = other;
        } else if (out->used_share < 0.5) { /* mostly distortion: ask for quieter neighbours */
            noise_tiles_threshold(&w, 1.2);
            if (white_floor(&w, &other) && other.n_cells > 30)
                *out = other;
        }
    }
    noise_tiles_free(&w);
    return status;
}
