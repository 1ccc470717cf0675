/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compare.h"
#include "maths/maths.h"

#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    LEAST_SAMPLES = 256, /* of a free stretch */
    MARGIN = 8,          /* samples after a drive that a zero-phase anti-alias filter may have changed */
    POINTS = 24,         /* of a curve, at most */
    STRETCHES = 16       /* of one record */
};
static const double at_rest = 1e-3;         /* of an input's peak: below, nothing drives */
static const double least_periods = 6.0;    /* of the mode in one window */
static const double separation = 4.0;       /* windows are this many beats with the next mode long */
static const double farthest = 1.2;         /* a mode's frequency from the model's, as a factor */
static const double above_noise = 8.0;      /* amplitude over its own standard error, for a window to count */
static const double drift_sds = 5.0;        /* a drift that is described exceeds this many standard errors … */
static const double frequency_drift = 5e-4; /* … and this relative change of a frequency, … */
static const double damping_drift = 0.1;    /* … or this share of the mean damping ratio */

/* ---- Free stretches of a record ---- */

struct stretch {
    size_t from, to;
};

static bool is_driven(const struct model *model, const struct record *record, size_t i, const double peak[])
{
    for (size_t k = 0; k < model->n_inputs && k < COMPARE_INPUTS; k++) {
        const double *u = record_column(record, model->inputs[k].name);
        if (u != NULL && peak[k] > 0.0 && fabs(u[i]) > peak[k])
            return true;
    }
    return false;
}

/* Samples [from, to) of a channel that begins at sample `first` of the record and in which nothing drives. */
static size_t free_stretches(const struct model *model, const struct record *record, size_t first, size_t n,
                             struct stretch out[STRETCHES])
{
    double threshold[COMPARE_INPUTS] = {0};
    if (record_is_free_decay(record)) {
        out[0] = (struct stretch){0, n};
        return n >= LEAST_SAMPLES ? 1 : 0;
    }
    for (size_t k = 0; k < model->n_inputs && k < COMPARE_INPUTS; k++) {
        const double *u = record_column(record, model->inputs[k].name);
        double peak = 0.0;
        for (size_t i = 0; u != NULL && i < record->n; i++)
            peak = fmax(peak, fabs(u[i]));
        const double head = u != NULL ? root_mean_square(u, record->n < 64 ? record->n : 64) : 0.0;
        threshold[k] = fmax(at_rest * peak, head < 0.01 * peak ? 6.0 * head : 0.0);
    }
    size_t count = 0, from = 0;
    bool moved = false; /* before the first drive there is nothing to see */
    for (size_t i = 0; i <= n && count < STRETCHES; i++) {
        const bool driven = i == n || is_driven(model, record, first + i, threshold);
        if (driven) {
            if (moved && i >= from + LEAST_SAMPLES + 2 * MARGIN)
                out[count++] = (struct stretch){from + MARGIN, i == n ? n : i - MARGIN};
            moved = true;
            from = i + 1;
        }
    }
    return count;
}

/* ---- One mode in one stretch ---- */

/* Windows of `length` samples, `hop` apart, and the frequency around which phases are taken. */
struct windows {
    size_t from, length, hop, n;
    double omega; /* rad per sample */
    double *w;    /* [length] Blackman–Harris, sum 1 */
    double noise; /* standard error of a complex amplitude, each component */
};

static double complex window_amplitude(const struct windows *w, const double *x, size_t i)
{
    const size_t start = w->from + i * w->hop;
    double complex sum = 0.0;
    for (size_t t = 0; t < w->length; t++) {
        const double angle = w->omega * (double)(start + t);
        sum += CMPLX(2.0 * w->w[t] * x[start + t] * cos(angle), -2.0 * w->w[t] * x[start + t] * sin(angle));
    }
    return sum;
}

static double psd_at(const struct noise_estimate *noise, double f_Hz)
{
    const size_t k = (size_t)(f_Hz / noise->df_Hz + 0.5);
    return noise->psd[k < noise->n_bins ? k : noise->n_bins - 1];
}

/* false: the stretch is too short for this mode beside its neighbours. */
static bool lay_windows(const struct comparison *all, const struct comparison_channel *c, size_t mode,
                        const struct stretch *s, struct windows *out)
{
    const double f = all->frequency_Hz[mode - 1];
    double beat = 2.0 * f; /* distance of the mirror image at −f */
    if (mode > 1)
        beat = fmin(beat, f - all->frequency_Hz[mode - 2]);
    if (mode < all->n_modes)
        beat = fmin(beat, all->frequency_Hz[mode] - f);
    const double seconds = fmax(least_periods / f, separation / beat);
    const size_t n = s->to - s->from, shortest = (size_t)ceil(seconds / c->dt_s);
    size_t length = 2 * n / POINTS;
    length = length > shortest ? length : shortest;
    if (4 * length > 3 * n || f > 0.4 / c->dt_s)
        return false;
    *out = (struct windows){.from = s->from, .length = length, .omega = 2.0 * M_PI * f * c->dt_s};
    out->hop = length / 2;
    out->n = (n - length) / out->hop + 1;
    out->w = bf_alloc(length, sizeof *out->w);
    window_fill(WINDOW_BLACKMAN_HARRIS, length, out->w);
    double sum = 0.0, squares = 0.0;
    for (size_t i = 0; i < length; i++)
        sum += out->w[i];
    for (size_t i = 0; i < length; i++) {
        out->w[i] /= sum;
        squares += out->w[i] * out->w[i];
    }
    const double variance = c->noise.n_bins > 1 ? psd_at(&c->noise, f) / (2.0 * c->dt_s) : 0.0;
    out->noise = sqrt(2.0 * variance * squares);
    return true;
}

/*
 * omega of the largest line of the first window, within a fifth of the model's frequency and nearer to it than to its neighbours: windows are a
 * hop apart, so that a turn of the phase tells omega only once it is known to half a turn a hop.
 */
static enum bf_status find_peak(const struct comparison *all, size_t mode, const double *x, struct windows *w,
                                double dt_s, struct bf_error *err)
{
    const double f = all->frequency_Hz[mode - 1], *model = all->frequency_Hz;
    const double low = fmax(f / farthest, mode > 1 ? 0.5 * (model[mode - 2] + f) : 0.0),
                 high = fmin(f * farthest, mode < all->n_modes ? 0.5 * (model[mode] + f) : HUGE_VAL);
    const struct fft *plan;
    const size_t n = fft_good_size(2 * w->length);
    const enum bf_status status = fft_get(n, &plan, err);
    if (status != BF_OK)
        return status;
    double *part = bf_alloc(n, sizeof *part), largest = 0.0;
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    for (size_t t = 0; t < w->length; t++)
        part[t] = w->w[t] * x[w->from + t];
    fft_forward(plan, part, X);
    for (size_t k = (size_t)ceil(low * dt_s * (double)n); k <= n / 2 && (double)k <= high * dt_s * (double)n; k++)
        if (cabs(X[k]) > largest) {
            largest = cabs(X[k]);
            w->omega = 2.0 * M_PI * (double)k / (double)n;
        }
    free(part), free(X);
    return status;
}

/* Moves omega onto the mode: the peak, then the mean turn of the phase from window to window, weighted by amplitude. */
static enum bf_status find_ridge(const struct comparison *all, size_t mode, const double *x, double dt_s,
                                 struct windows *w, struct bf_error *err)
{
    const enum bf_status status = find_peak(all, mode, x, w, dt_s, err);
    for (int pass = 0; pass < 3 && status == BF_OK; pass++) {
        double complex turn = 0.0, last = 0.0;
        for (size_t i = 0; i < w->n; i++) {
            const double complex a = window_amplitude(w, x, i);
            turn += i > 0 ? a * conj(last) : 0.0;
            last = a;
        }
        w->omega += carg(turn) / (double)w->hop;
    }
    return status;
}

/* f and ζ between two windows `hop` samples apart. */
static void slopes(double complex a, double complex b, const struct windows *w, double dt_s, double *f_Hz, double *zeta)
{
    const double omega = w->omega + carg(b * conj(a)) / (double)w->hop;
    const double decay = -log(cabs(b) / cabs(a)) / (double)w->hop; /* both per sample */
    *f_Hz = omega / (2.0 * M_PI * dt_s);
    *zeta = decay / hypot(omega, decay);
}

static void curve_alloc(struct amplitude_curve *curve, size_t room)
{
    double **array[] = {&curve->t_s,
                        &curve->amplitude,
                        &curve->frequency_Hz,
                        &curve->damping_ratio,
                        &curve->frequency_sd_Hz,
                        &curve->damping_sd,
                        &curve->model_amplitude,
                        &curve->model_frequency_Hz,
                        &curve->model_damping_ratio};
    for (size_t i = 0; i < sizeof array / sizeof *array; i++)
        *array[i] = bf_alloc(room, sizeof **array[i]);
}

static void curve_free(struct amplitude_curve *curve)
{
    free(curve->t_s);
    free(curve->amplitude);
    free(curve->frequency_Hz);
    free(curve->damping_ratio);
    free(curve->frequency_sd_Hz);
    free(curve->damping_sd);
    free(curve->model_amplitude);
    free(curve->model_frequency_Hz);
    free(curve->model_damping_ratio);
    *curve = (struct amplitude_curve){0};
}

/* The same windows for both, each about its own frequency. */
static void fill_curve(const struct comparison_channel *c, const struct windows *w, const struct windows *of_model,
                       struct amplitude_curve *curve)
{
    double complex last = 0.0, last_model = 0.0;
    const double step = (double)w->hop;
    for (size_t i = 0; i < w->n; i++) {
        const double complex a = window_amplitude(w, c->measured, i), m = window_amplitude(of_model, c->predicted, i);
        if (i > 0 && cabs(a) > above_noise * w->noise && cabs(last) > above_noise * w->noise) {
            const size_t k = curve->n++;
            const double size = sqrt(cabs(a) * cabs(last)), sd = M_SQRT2 * w->noise / size / step; /* per sample */
            curve->t_s[k] = c->t0_s + c->dt_s * ((double)(w->from + i * w->hop) + 0.5 * ((double)w->length - step));
            curve->amplitude[k] = size;
            slopes(last, a, w, c->dt_s, &curve->frequency_Hz[k], &curve->damping_ratio[k]);
            curve->frequency_sd_Hz[k] = sd / (2.0 * M_PI * c->dt_s);
            curve->damping_sd[k] = sd / w->omega;
            curve->model_amplitude[k] = sqrt(cabs(m) * cabs(last_model));
            curve->model_frequency_Hz[k] = curve->model_damping_ratio[k] = nan("");
            if (cabs(m) > 0.05 * cabs(a) && cabs(last_model) > 0.05 * cabs(last))
                slopes(last_model, m, of_model, c->dt_s, &curve->model_frequency_Hz[k], &curve->model_damping_ratio[k]);
        }
        last = a;
        last_model = m;
    }
}

/* Weighted straight line y = a + b x; returns b (largest x − smallest x) and its standard error. */
static double line_rise(const double *x, const double *y, const double *sd, size_t n, double *rise_sd)
{
    double w = 0.0, wx = 0.0, wy = 0.0, sxx = 0.0, sxy = 0.0, low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < n; i++) {
        const double weight = 1.0 / (sd[i] * sd[i]);
        w += weight;
        wx += weight * x[i];
        wy += weight * y[i];
        low = fmin(low, x[i]);
        high = fmax(high, x[i]);
    }
    for (size_t i = 0; i < n; i++) {
        const double weight = 1.0 / (sd[i] * sd[i]), dx = x[i] - wx / w;
        sxx += weight * dx * dx;
        sxy += weight * dx * (y[i] - wy / w);
    }
    *rise_sd = sxx > 0.0 ? (high - low) / sqrt(sxx) : HUGE_VAL;
    return sxx > 0.0 ? (high - low) * sxy / sxx : 0.0;
}

static void find_drifts(struct amplitude_curve *curve)
{
    const size_t n = curve->n;
    double mean = 0.0;
    for (size_t i = 0; i < n; i++)
        mean += curve->frequency_Hz[i] / (double)n;
    curve->frequency_drift =
        line_rise(curve->amplitude, curve->frequency_Hz, curve->frequency_sd_Hz, n, &curve->frequency_drift_sd) / mean;
    curve->frequency_drift_sd /= mean;
    curve->damping_drift =
        line_rise(curve->amplitude, curve->damping_ratio, curve->damping_sd, n, &curve->damping_drift_sd);
}

static enum bf_status measure_stretch(const struct comparison *all, const struct comparison_channel *c,
                                      const struct stretch *s, struct amplitude_curves *out, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t mode = 1; mode <= all->n_modes && status == BF_OK; mode++) {
        struct windows w;
        if (!lay_windows(all, c, mode, s, &w))
            continue;
        struct amplitude_curve curve = {.record = c->record, .channel = c->name, .mode = mode, .amplitude_sd = w.noise};
        struct windows of_model = w;
        status = find_ridge(all, mode, c->measured, c->dt_s, &w, err);
        if (status == BF_OK)
            status = find_ridge(all, mode, c->predicted, c->dt_s, &of_model, err);
        curve_alloc(&curve, w.n);
        const double found_Hz = w.omega / (2.0 * M_PI * c->dt_s);
        if (status == BF_OK && fabs(found_Hz / all->frequency_Hz[mode - 1] - 1.0) < farthest - 1.0)
            fill_curve(c, &w, &of_model, &curve);
        if (curve.n >= 3) {
            find_drifts(&curve);
            out->curves = bf_grow(out->curves, out->n + 1, sizeof *out->curves);
            out->curves[out->n++] = curve;
        } else {
            curve_free(&curve);
        }
        free(w.w);
    }
    return status;
}

/* ---- Words ---- */

static double mean_damping(const struct amplitude_curve *c)
{
    double sum = 0.0;
    for (size_t i = 0; i < c->n; i++)
        sum += c->damping_ratio[i] / (double)c->n;
    return sum;
}

static void describe(const struct comparison *all, struct amplitude_curves *out)
{
    const struct amplitude_curve *f = NULL, *z = NULL;
    for (size_t i = 0; i < out->n; i++) {
        const struct amplitude_curve *c = &out->curves[i];
        const bool f_shows = fabs(c->frequency_drift) > fmax(frequency_drift, drift_sds * c->frequency_drift_sd);
        const bool z_shows =
            fabs(c->damping_drift) > fmax(damping_drift * fabs(mean_damping(c)), drift_sds * c->damping_drift_sd);
        if (f_shows && (f == NULL || fabs(c->frequency_drift) > fabs(f->frequency_drift)))
            f = c;
        if (z_shows &&
            (z == NULL || fabs(c->damping_drift) / c->damping_drift_sd > fabs(z->damping_drift) / z->damping_drift_sd))
            z = c;
    }
    size_t used = 0;
    if (f != NULL) {
        const int n =
            snprintf(out->text, sizeof out->text, "The frequency of mode %zu %s by %.2g %% with amplitude (%s of %s).",
                     f->mode, f->frequency_drift > 0.0 ? "rises" : "falls", 100.0 * fabs(f->frequency_drift),
                     f->channel, record_base_name(&all->records[f->record]));
        used = n > 0 ? (size_t)n : 0;
    }
    if (z != NULL && used + 1 < sizeof out->text)
        (void)snprintf(out->text + used, sizeof out->text - used,
                       "%sThe damping of mode %zu %s with amplitude, by %.2g %% of its mean %.2g %% (%s of %s).",
                       used > 0 ? " " : "", z->mode, z->damping_drift > 0.0 ? "rises" : "falls",
                       100.0 * fabs(z->damping_drift / mean_damping(z)), 100.0 * mean_damping(z), z->channel,
                       record_base_name(&all->records[z->record]));
}

enum bf_status amplitude_measure(const struct comparison *comparison, struct amplitude_curves *out,
                                 struct bf_error *err)
{
    *out = (struct amplitude_curves){.n_records = comparison->n_records,
                                     .free_stretches = bf_alloc(comparison->n_records + 1, sizeof(size_t))};
    for (size_t i = 0; i < comparison->n_channels; i++) {
        const struct comparison_channel *c = &comparison->channels[i];
        const struct record *record = &comparison->records[c->record];
        const double *own = record_column(record, c->name);
        if (own == NULL)
            return bf_fail(err, BF_BAD_FILE, "%s: there is no column '%s'", record->path, c->name);
        struct stretch stretches[STRETCHES];
        const size_t n = free_stretches(comparison->model, record, (size_t)(c->measured - own), c->n, stretches);
        out->free_stretches[c->record] += n;
        for (size_t k = 0; k < n; k++)
            if (measure_stretch(comparison, c, &stretches[k], out, err) != BF_OK)
                return err->status;
    }
    describe(comparison, out);
    return BF_OK;
}

void amplitude_free(struct amplitude_curves *curves)
{
    for (size_t i = 0; i < curves->n; i++)
        curve_free(&curves->curves[i]);
    free(curves->curves), free(curves->free_stretches);
    *curves = (struct amplitude_curves){0};
}
