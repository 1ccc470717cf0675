/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_estimate.h"
#include "noise_floor.h"
#include "noise_input.h"
#include "ground/ground.h"
#include "maths/maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    SHORTEST = 64, /* samples from which noise can be told */
    MARGIN = 8,    /* samples before the onset that a zero-phase anti-alias filter may have changed */
    /* A longer record is taken in pieces of about PIECE: the method takes 230 bytes a sample, and half a million cells know a level to 0.1 % */
    LONG = 262144,
    PIECE = 131072 /* a power of 2, which is transformed fastest; half of LONG, so that there are two at least */
};

const char *noise_method_text(enum noise_method method)
{
    switch (method) {
    case NOISE_QUIET:
        return "pre-trigger samples";
    case NOISE_LOCAL:
        return "local rational method";
    case NOISE_COHERENCE:
        return "coherence";
    case NOISE_NONE:
        break;
    }
    return "none";
}

static bool all_finite(const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i]))
            return false;
    return true;
}

static bool is_constant(const double *x, size_t n)
{
    for (size_t i = 1; i < n; i++)
        if (x[i] < x[0] || x[i] > x[0])
            return false;
    return true;
}

/* Samples before any input moves. */
static size_t quiet_samples(const double *const u[], size_t n_inputs, size_t n)
{
    size_t onset = n;
    for (size_t input = 0; input < n_inputs; input++) {
        double peak = 0.0;
        for (size_t i = 0; i < n; i++)
            peak = fmax(peak, fabs(u[input][i]));
        const size_t head = n < SHORTEST ? n : SHORTEST;
        const double moves = fmax(1e-3 * peak, 6.0 * root_mean_square(u[input], head));
        if (moves > 0.1 * peak)
            return 0; /* it never was at rest */
        for (size_t i = 0; i < onset; i++)
            if (fabs(u[input][i]) > moves)
                onset = i;
    }
    return n_inputs > 0 && onset > MARGIN && onset < n ? onset - MARGIN : 0;
}

static enum bf_status floor_of_piece(const double *z, size_t n, const double *const u[], size_t n_inputs,
                                     struct noise_floor *out, struct bf_error *err)
{
    struct local_rational *fit = NULL;
    enum bf_status status = local_rational_new(z, n, u, n_inputs, &fit, err);
    if (status == BF_OK)
        status = noise_floor_estimate(fit, z, n, out, err);
    local_rational_free(fit);
    return status;
}

/* Into the mean, by how many cells each has; relative_sd is that of the sum of rows until the end. */
static void pool(const struct noise_floor *one, struct noise_floor *all)
{
    const double cells = (double)one->n_cells, before = (double)all->n_cells;
    if (one->n_rows == 0 || !(cells > 0.0))
        return;
    const bool first = all->n_rows == 0;
    double own = 0.0, so_far = 0.0;
    for (size_t r = 0; r < one->n_rows; r++) {
        own += one->variance[r];
        so_far += first ? 0.0 : all->variance[r];
        all->variance[r] =
            first ? one->variance[r] : (before * all->variance[r] + cells * one->variance[r]) / (before + cells);
    }
    const double sum = before * so_far + cells * own;
    all->relative_sd =
        sum > 0.0 ? hypot(all->relative_sd * before * so_far, one->relative_sd * cells * own) / sum : 0.0;
    all->used_share = (before * all->used_share + cells * one->used_share) / (before + cells);
    all->white = (first || all->white) && one->white;
    all->n_rows = one->n_rows;
    all->n_cells += one->n_cells;
}

static enum bf_status floor_of(const double *z, size_t n, const double *const u[], size_t n_inputs,
                               struct noise_floor *out, struct bf_error *err)
{
    if (n <= LONG)
        return floor_of_piece(z, n, u, n_inputs, out, err);
    enum bf_status status = BF_OK;
    const size_t n_pieces = n / PIECE;
    *out = (struct noise_floor){0};
    for (size_t i = 0; i < n_pieces && status == BF_OK; i++) {
        const size_t from = i * n / n_pieces, to = (i + 1) * n / n_pieces;
        const double *part[NOISE_MOST_INPUTS];
        struct noise_floor one = {0};
        for (size_t k = 0; k < n_inputs; k++)
            part[k] = u[k] + from;
        if (is_constant(z + from, to - from))
            continue;
        status = floor_of_piece(z + from, to - from, part, n_inputs, &one, err);
        if (status == BF_OK)
            pool(&one, out);
    }
    return status;
}

static double floor_rms(const struct noise_floor *f)
{
    double sum = 0.0;
    for (size_t i = 0; i < f->n_rows; i++)
        sum += f->variance[i];
    return f->n_rows > 0 ? sqrt(sum / (double)f->n_rows) : 0.0;
}

/* The step function of rows as a curve: logarithms interpolated between the rows' middles, power kept. */
static void fill_psd(const struct noise_floor *f, double dt_s, struct noise_estimate *out)
{
    const size_t nr = f->n_rows;
    double sum = 0.0;
    out->n_bins = 4 * nr + 1;
    out->df_Hz = 0.5 / dt_s / (double)(out->n_bins - 1);
    out->psd = bf_alloc(out->n_bins, sizeof *out->psd);
    for (size_t k = 0; k < out->n_bins; k++) {
        const double row = fmin(fmax(((double)k - 2.0) / 4.0, 0.0), (double)(nr - 1));
        const size_t below = (size_t)row, above = below + 1 < nr ? below + 1 : below;
        const double part = row - (double)below;
        out->psd[k] = exp((1.0 - part) * log(f->variance[below]) + part * log(f->variance[above]));
        sum += out->psd[k] * out->df_Hz;
    }
    for (size_t k = 0; k < out->n_bins; k++)
        out->psd[k] *= out->rms * out->rms / sum;
}

static void take(const struct noise_floor *f, enum noise_method method, struct noise_estimate *out)
{
    out->method = method;
    out->rms = floor_rms(f);
    out->rms_sd = f->relative_sd * out->rms;
    out->n_used = f->n_cells;
    out->used_share = f->used_share;
}

/* First-order autoregression of a stretch, 0 … 0.95, from neighbouring samples (less the bias of few samples, Kendall 1954). */
static double neighbours_alike(const double *z, size_t n, double mean)
{
    static const double most = 0.95;
    double square = 0.0, product = 0.0;
    for (size_t i = 0; i < n; i++) {
        square += (z[i] - mean) * (z[i] - mean);
        product += i > 0 ? (z[i] - mean) * (z[i - 1] - mean) : 0.0;
    }
    const double a = square > 0.0 ? product / square : 0.0;
    return fmin(fmax(a + (1.0 + 3.0 * a) / (double)n, 0.0), most);
}

/*
 * What is measured before the onset, hum included, is an upper bound of the noise. When it is clearly below the estimate from
 * the whole record, that estimate holds distortion, and the quiet samples are used instead. The power of coloured noise is
 * known less well from few samples, by (1 + a²)/(1 − a²) in variance, and subtracting their mean removes more of it. Noise below half a step of the
 * recorder moves few of the quiet samples; a motion that crosses steps has their q²/12 besides.
 */
static bool quieter_before(const double *z, size_t n, double step, const struct noise_floor *own,
                           struct noise_floor *quiet)
{
    double mean = 0.0, square = 0.0;
    for (size_t i = 0; i < n; i++)
        mean += z[i] / (double)n;
    for (size_t i = 0; i < n; i++)
        square += (z[i] - mean) * (z[i] - mean) / (double)n;
    const double a = neighbours_alike(z, n, mean), taken = (1.0 + a) / (1.0 - a) / (double)n;
    square /= fmax(1.0 - taken, 0.5);
    square += square < 0.25 * step * step ? step * step / 12.0 : 0.0;
    const double colour = (1.0 + a * a) / (1.0 - a * a), floor = floor_rms(quiet);
    const double sd = hypot(quiet->relative_sd * sqrt(colour), own->relative_sd);
    if (!(square > 0.0) || !(floor > 0.0))
        return false;
    for (size_t r = 0; r < quiet->n_rows; r++)
        quiet->variance[r] *= square / (floor * floor);
    return own->n_rows == 0 || log(floor_rms(own) / sqrt(square)) > 4.0 * sd;
}

enum bf_status noise_estimate_own(const double *z, size_t n, double dt_s, const struct noise_channel_input inputs[],
                                  size_t n_inputs, size_t from_sample, struct noise_estimate *out, struct bf_error *err)
{
    const double *u[NOISE_MOST_INPUTS] = {0};
    struct noise_floor own = {0}, quiet = {0};
    const struct noise_floor *chosen = &own;
    *out = (struct noise_estimate){0};
    const size_t from = n_inputs == 0 && from_sample < n ? from_sample : 0;
    if (n < SHORTEST || n - from < SHORTEST || is_constant(z + from, n - from))
        return BF_OK;
    if (!all_finite(z, n))
        return bf_fail(err, BF_NUMERIC, "a channel with numbers that are not finite has no noise level");
    if (n_inputs > NOISE_MOST_INPUTS)
        return bf_fail(err, BF_NUMERIC, "noise is estimated beside at most %d inputs; got %zu", NOISE_MOST_INPUTS,
                       n_inputs);
    for (size_t i = 0; i < n_inputs; i++)
        u[i] = inputs[i].u;
    out->quantisation = recorder_step(z, n);
    const size_t n_quiet = n_inputs == 0 ? from : quiet_samples(u, n_inputs, n);
    enum bf_status status = floor_of(z + from, n - from, u, n_inputs, &own, err);
    if (status == BF_OK && n_quiet >= SHORTEST && !is_constant(z, n_quiet))
        status = floor_of(z, n_quiet, NULL, 0, &quiet, err);
    if (status != BF_OK)
        return status;
    if (quiet.n_rows > 0 && quieter_before(z, n_quiet, out->quantisation, &own, &quiet))
        chosen = &quiet;
    if (chosen->n_rows == 0 || !(floor_rms(chosen) > 0.0))
        return BF_OK;
    take(chosen, chosen == &quiet ? NOISE_QUIET : NOISE_LOCAL, out);
    fill_psd(chosen, dt_s, out);
    return BF_OK;
}

enum bf_status noise_estimate(const double *z, size_t n, double dt_s, const struct noise_channel_input inputs[],
                              size_t n_inputs, size_t from_sample, struct noise_estimate *out, struct bf_error *err)
{
    const enum bf_status status = noise_estimate_own(z, n, dt_s, inputs, n_inputs, from_sample, out, err);
    return status ? status : noise_add_inputs(z, inputs, n_inputs, n, dt_s, out, err);
}
