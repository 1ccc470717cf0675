/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linearity_pair.c — u₂ * y₁ − u₁ * y₂ of two records against what noise leaves of it, on the time–frequency plane. */
#include "linearity_pair.h"
#include "linearity_added.h"
#include "linearity_convolution.h"
#include "spectrogram.h"
#include "maths/maths.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
    DRAWS = 12,     /* of simulated noise, for the standard error of a ratio */
    MOST_LINES = 3, /* that are taken out of one pair */
    LINE_BINS = 2,  /* to either side that a line leaks into, Hann */
    BANDS = 24      /* thirds of an octave below Nyquist */
};
const double linearity_threshold = 1.08;
static const double same_shape_match = 3e-4; /* rms of u₂ − k u₁ over that of u₂; noise is some 4e-3 of a channel */
static const double weakest_cell = 1e-6;     /* of the strongest: below, digits of the file are larger than noise */
static const double band_excess = 2.0;       /* ratio of a third of an octave that counts, when it is … */
static const double band_sds = 6.0;          /* … this many standard errors above 1 */
static const double pair_sds = 4.0;

/* ---- Noise ---- */

/* Variance per sample of white noise that has the density at f. */
static double variance_at(const struct noise_estimate *noise, double f_Hz)
{
    const double nyquist_Hz = noise->df_Hz * (double)(noise->n_bins - 1), bin = f_Hz / noise->df_Hz;
    const size_t below = bin < (double)(noise->n_bins - 1) ? (size_t)bin : noise->n_bins - 1;
    const size_t above = below + 1 < noise->n_bins ? below + 1 : below;
    const double part = bin - (double)below;
    return nyquist_Hz * (noise->psd[below] + fmin(part, 1.0) * (noise->psd[above] - noise->psd[below]));
}

/* xorshift64* and Box and Muller: the draws are the same in every run and thread. */
static double uniform(uint64_t *seed)
{
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return (double)((*seed * 2685821657736338717u) >> 11) / 9007199254740992.0;
}

/* x[n]: white noise of variance 1 coloured by the noise's density. */
static void draw_noise(struct linearity_convolution *c, const struct noise_estimate *noise, double dt_s, uint64_t *seed,
                       double *x)
{
    const size_t size = fft_size(c->plan);
    for (size_t k = 0; k < c->m; k++) {
        const double f_Hz = (double)k / ((double)size * dt_s), angle = 2.0 * M_PI * uniform(seed);
        const double r = sqrt(-log(1.0 - uniform(seed)) * (double)size * variance_at(noise, f_Hz));
        c->X[k] = CMPLX(r * cos(angle), k == 0 || k + 1 == c->m ? 0.0 : r * sin(angle));
    }
    fft_inverse(c->plan, c->X, c->x);
    memcpy(x, c->x, c->n * sizeof *x);
}

/*
 * expected[t][k] += S(k) Σ_{t' ≤ t} hop · |V(t', k)|²: noise that began with the record, filtered by the signal whose
 * spectrogram is V. variance: [n_bins] of the noise.
 */
static void add_filtered_noise(const struct spectrogram *p, const double *V, const double *variance, double *expected)
{
    for (size_t k = 0; k < p->n_bins; k++) {
        double sum = 0.0;
        for (size_t t = 0; t < p->n_times; t++) {
            sum += (double)p->hop * V[t * p->n_bins + k];
            expected[t * p->n_bins + k] += variance[k] * sum;
        }
    }
}

/* ---- One pair ---- */

struct pair_work {
    const struct linearity_signal *weak, *strong;
    size_t n;
    double scale; /* k of u₂ = k u₁ */
    bool same_shape;
    struct spectrogram plane;
    struct linearity_convolution convolution;
    double complex *U1, *U2;  /* NULL for the same shape */
    double *expected, *power; /* [n_times][n_bins] */
    double *e, *x1, *x2;      /* [n] */
};

static void find_shape(struct pair_work *w)
{
    double uu = 0.0, uv = 0.0, vv = 0.0;
    for (size_t i = 0; i < w->n; i++) {
        uu += w->weak->u[i] * w->weak->u[i];
        uv += w->weak->u[i] * w->strong->u[i];
        vv += w->strong->u[i] * w->strong->u[i];
    }
    w->scale = uu > 0.0 ? uv / uu : 0.0;
    double rest = 0.0;
    for (size_t i = 0; i < w->n; i++) {
        const double d = w->strong->u[i] - w->scale * w->weak->u[i];
        rest += d * d;
    }
    w->same_shape = rest <= same_shape_match * same_shape_match * vv;
}

/* e of two outputs (measured, or noise). */
static void left_over(struct pair_work *w, const double *y1, const double *y2)
{
    if (w->same_shape) {
        for (size_t i = 0; i < w->n; i++)
            w->e[i] = y2[i] - w->scale * y1[i];
        return;
    }
    double complex *Y1 = linearity_transform(&w->convolution, y1), *Y2 = linearity_transform(&w->convolution, y2);
    linearity_commute(&w->convolution, w->U2, Y1, w->U1, Y2, w->e);
    free(Y1);
    free(Y2);
}

static void fill_variance(const struct pair_work *w, const struct linearity_signal *s, double *variance)
{
    for (size_t k = 0; k < w->plane.n_bins; k++)
        variance[k] = variance_at(s->noise, (double)k / ((double)w->plane.segment * s->dt_s));
}

static void expect_same_shape(struct pair_work *w, const double *v1, const double *v2)
{
    const struct spectrogram *p = &w->plane;
    for (size_t t = 0; t < p->n_times; t++) {
        double inside = 0.0; /* of the segment, inside the record */
        for (size_t i = 0; i < p->segment; i++) {
            const size_t end = (t + 1) * p->hop + i;
            if (end >= p->segment && end - p->segment < w->n)
                inside += p->window[i] * p->window[i];
        }
        for (size_t k = 0; k < p->n_bins; k++)
            w->expected[t * p->n_bins + k] = inside * (v2[k] + w->scale * w->scale * v1[k]);
    }
}

static void expect_commuted(struct pair_work *w, double *v1, double *v2)
{
    const struct spectrogram *p = &w->plane;
    const struct linearity_signal *s[2] = {w->weak, w->strong};
    double *V = bf_alloc(p->n_times * p->n_bins, sizeof *V);
    /* the noise of one, also what its input's has made of it, through the other record's input */
    for (int i = 0; i < 2; i++) {
        spectrogram_power(p, s[1 - i]->u, w->n, V);
        add_filtered_noise(p, V, i == 0 ? v1 : v2, w->expected);
    }
    free(V);
}

static enum bf_status prepare(struct pair_work *w, struct bf_error *err)
{
    enum bf_status status = spectrogram_new(w->n, &w->plane, err);
    if (status == BF_OK)
        status = linearity_convolution_new(w->n, &w->convolution, err);
    if (status != BF_OK)
        return status;
    const size_t cells = w->plane.n_times * w->plane.n_bins;
    w->expected = bf_alloc(cells, sizeof *w->expected);
    w->power = bf_alloc(cells, sizeof *w->power);
    w->e = bf_alloc(w->n, sizeof *w->e);
    w->x1 = bf_alloc(w->n, sizeof *w->x1);
    w->x2 = bf_alloc(w->n, sizeof *w->x2);
    double *v1 = bf_alloc(w->plane.n_bins, sizeof *v1), *v2 = bf_alloc(w->plane.n_bins, sizeof *v2);
    fill_variance(w, w->weak, v1);
    fill_variance(w, w->strong, v2);
    find_shape(w);
    if (w->same_shape) {
        expect_same_shape(w, v1, v2);
    } else {
        w->U1 = linearity_transform(&w->convolution, w->weak->u);
        w->U2 = linearity_transform(&w->convolution, w->strong->u);
        expect_commuted(w, v1, v2);
    }
    free(v1);
    free(v2);
    return BF_OK;
}

static void pair_work_free(struct pair_work *w)
{
    linearity_convolution_free(&w->convolution);
    free(w->plane.window);
    free(w->U1);
    free(w->U2);
    free(w->expected);
    free(w->power);
    free(w->e);
    free(w->x1);
    free(w->x2);
}

/* ---- What the cells say ---- */

struct cells {
    double sum[BANDS], n[BANDS]; /* of cell/expected, without lines */
    double all, n_all;
    double broad, n_broad;
};

static size_t band_of(double share_of_nyquist)
{
    const double thirds = -3.0 * log2(fmax(share_of_nyquist, 1e-9));
    return thirds < BANDS - 1 ? (size_t)thirds : BANDS - 1;
}

/* Hum that is too weak to be found in a record is still more than the smooth noise about it. Where the spectrogram is coarse it would take whole bands along. */
static bool near_mains(size_t k, double df_Hz)
{
    static const double mains_Hz[] = {50.0, 60.0}, widest_Hz = 10.0;
    const double width_Hz = (LINE_BINS + 0.5) * df_Hz;
    bool near = false;
    for (size_t i = 0; i < sizeof mains_Hz / sizeof *mains_Hz; i++)
        near = near || fabs((double)k * df_Hz - mains_Hz[i]) < width_Hz;
    return near && width_Hz < widest_Hz;
}

static bool near_line(const struct linearity_lines *lines, size_t k, double df_Hz)
{
    for (size_t i = 0; i < lines->n; i++)
        if (fabs((double)k - lines->frequency_Hz[i] / df_Hz) < LINE_BINS + 0.5)
            return true;
    return near_mains(k, df_Hz);
}

/* Sums over the cells of w->e that noise reaches; the last segments reach past the end of the record and are left out. */
static void sum_cells(struct pair_work *w, const struct linearity_lines *lines, struct cells *out)
{
    const struct spectrogram *p = &w->plane;
    const double df_Hz = 1.0 / ((double)p->segment * w->weak->dt_s);
    double strongest = 0.0;
    *out = (struct cells){0};
    spectrogram_power(p, w->e, w->n, w->power);
    for (size_t i = 0; i < p->n_times * p->n_bins; i++)
        strongest = fmax(strongest, w->expected[i]);
    for (size_t t = 0; t < p->n_times && (t + 1) * p->hop <= w->n; t++) {
        for (size_t k = 1; k + 1 < p->n_bins; k++) {
            const size_t i = t * p->n_bins + k;
            if (!(w->expected[i] > weakest_cell * strongest))
                continue;
            const double x = w->power[i] / w->expected[i];
            out->all += x;
            out->n_all += 1.0;
            if (near_line(lines, k, df_Hz))
                continue;
            const size_t band = band_of((double)k / (double)(p->n_bins - 1));
            out->broad += x;
            out->n_broad += 1.0;
            out->sum[band] += x;
            out->n[band] += 1.0;
        }
    }
}

/*
 * y₂ − k y₁ holds no motion when the beam is linear, so that hum is seen in it better than in either record. When a few lines
 * are all it holds, they are added signals, and the cells without them replace *cells; a nonlinear beam under a steady drive
 * leaves many lines.
 */
static void take_lines_out(struct pair_work *w, const struct linearity_lines *lines, struct cells *cells,
                           struct linearity_pair *pair)
{
    struct linearity_added found[MOST_LINES];
    struct linearity_lines more = *lines;
    const double *const u[1] = {w->strong->u};
    const size_t n = linearity_find_added(w->e, w->n, w->weak->dt_s, u, 1, found, MOST_LINES);
    for (size_t k = 0; k < n; k++) {
        for (size_t i = 0; i < w->n; i++)
            w->e[i] -= linearity_added_at(&found[k], i, w->n, w->weak->dt_s);
        if (more.n < sizeof more.frequency_Hz / sizeof *more.frequency_Hz)
            more.frequency_Hz[more.n++] = found[k].frequency_Hz;
    }
    struct cells rest;
    sum_cells(w, &more, &rest);
    if (n == 0 || !(rest.broad < linearity_threshold * linearity_threshold * rest.n_broad))
        return;
    *cells = rest;
    pair->n_added = n;
    for (size_t k = 1; k < n; k++)
        if (fabs(found[k].amplitude) > fabs(found[0].amplitude))
            found[0] = found[k];
    pair->added_Hz = found[0].frequency_Hz;
}

/* Standard deviations of the means over simulated noise, of all cells and band by band. */
static void measure_scatter(struct pair_work *w, const struct linearity_lines *lines, double *sd, double band_sd[BANDS])
{
    uint64_t seed = 0x9e3779b97f4a7c15u;
    double square = 0.0, band_square[BANDS] = {0};
    for (int d = 0; d < DRAWS; d++) {
        struct cells c;
        draw_noise(&w->convolution, w->weak->noise, w->weak->dt_s, &seed, w->x1);
        draw_noise(&w->convolution, w->strong->noise, w->strong->dt_s, &seed, w->x2);
        left_over(w, w->x1, w->x2);
        sum_cells(w, lines, &c);
        const double x = c.n_all > 0.0 ? c.all / c.n_all - 1.0 : 0.0;
        square += x * x / DRAWS;
        for (size_t b = 0; b < BANDS; b++) {
            const double y = c.n[b] > 0.0 ? c.sum[b] / c.n[b] - 1.0 : 0.0;
            band_square[b] += y * y / DRAWS;
        }
    }
    *sd = sqrt(square);
    for (size_t b = 0; b < BANDS; b++)
        band_sd[b] = sqrt(band_square[b]);
}

static void judge(const struct pair_work *w, const struct cells *whole, const struct cells *c, double sd,
                  const double band_sd[BANDS], struct linearity_pair *pair)
{
    const struct noise_estimate *n1 = w->weak->noise, *n2 = w->strong->noise;
    const double level_sd = hypot(n1->rms_sd / n1->rms, n2->rms_sd / n2->rms); /* of rms; either may carry e alone */
    pair->ratio = whole->n_all > 0.0 ? sqrt(whole->all / whole->n_all) : 1.0;
    pair->ratio_broad = c->n_broad > 0.0 ? sqrt(c->broad / c->n_broad) : 1.0;
    pair->ratio_sd = hypot(0.5 * sd, level_sd);
    const double nyquist_Hz = 0.5 / w->weak->dt_s;
    bool band_shows = false;
    for (size_t b = 0; b < BANDS; b++) {
        const double ratio = c->n[b] >= 4.0 ? sqrt(c->sum[b] / c->n[b]) : 0.0;
        const double error = hypot(0.5 * band_sd[b], level_sd);
        band_shows = band_shows || (ratio > band_excess && ratio > 1.0 + band_sds * error);
        if (ratio > pair->worst_ratio) {
            pair->worst_ratio = ratio;
            pair->worst_from_Hz = b + 1 < BANDS ? nyquist_Hz * exp2(-(double)(b + 1) / 3.0) : 0.0;
            pair->worst_to_Hz = nyquist_Hz * exp2(-(double)b / 3.0);
        }
    }
    pair->nonlinear =
        band_shows || (pair->ratio_broad > linearity_threshold && pair->ratio_broad > 1.0 + pair_sds * pair->ratio_sd);
}

enum bf_status linearity_pair_measure(const struct linearity_signal *weak, const struct linearity_signal *strong,
                                      const struct linearity_lines *lines, struct linearity_pair *pair,
                                      struct bf_error *err)
{
    struct pair_work w = {.weak = weak, .strong = strong, .n = weak->n < strong->n ? weak->n : strong->n};
    const enum bf_status status = prepare(&w, err);
    if (status == BF_OK) {
        struct cells measured, cleaned;
        double sd, band_sd[BANDS];
        left_over(&w, weak->y, strong->y);
        sum_cells(&w, lines, &measured);
        left_over(&w, weak->cleaned, strong->cleaned);
        sum_cells(&w, lines, &cleaned);
        if (cleaned.broad * measured.n_broad > measured.broad * cleaned.n_broad)
            cleaned = measured; /* what was taken out was not there */
        if (w.same_shape && cleaned.broad > linearity_threshold * linearity_threshold * cleaned.n_broad)
            take_lines_out(&w, lines, &cleaned, pair);
        measure_scatter(&w, lines, &sd, band_sd);
        pair->same_shape = w.same_shape;
        pair->opposite = w.scale < 0.0;
        judge(&w, &measured, &cleaned, sd, band_sd, pair);
    }
    pair_work_free(&w);
    return status;
}
