/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a reconstructed force looks like: shares, growth with amplitude, frequency, curves. */
#include "reconstruct_shape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

static const double line_width = 0.05; /* of a line, relative */
/* A record whose force is seen to less than this part (mean of what the channels show) says nothing about amplitude. */
static const double least_seen = 0.1;
static const double resonant_share = 0.5, away_from_modes = 0.04;

static double largest(size_t n, const double x[])
{
    double size = 0.0;
    for (size_t k = 0; k < n; k++)
        size = fmax(size, fabs(x[k]));
    return size;
}

static double fall_of(const struct site_law *law, size_t from, size_t to, double c[FEATURES])
{
    bool use[FEATURES];
    for (size_t i = 0; i < FEATURES; i++)
        use[i] = i >= from && i < to;
    return site_law_fall(law, use, c);
}

static double fall_of_pair(const struct site_law *law, size_t a, size_t b)
{
    bool use[FEATURES] = {false};
    use[a] = use[b] = true;
    return site_law_fall(law, use, NULL);
}

/* Does the part of v look more like a power of it than like steps? */
static bool drags(const struct site_law *law)
{
    double step = 0.0;
    for (size_t i = 0; i < LADDER; i++)
        step = fmax(step, fall_of_pair(law, FEATURE_V, FEATURE_STEPS + i));
    return fall_of_pair(law, FEATURE_V, FEATURE_DRAG) > step;
}

static double force_of(const double c[FEATURES], size_t to, double w)
{
    double values[FEATURES], f = 0.0;
    reconstruct_features(w, 0.0, values);
    for (size_t i = 0; i < to; i++)
        f += c[i] * values[i];
    return f;
}

static void fill_shares(const struct site_law *law, struct reconstruction *out)
{
    double c[FEATURES], whole = law->chi_square > 0.0 ? law->chi_square : 1.0;
    double odd = fall_of(law, 0, ODD_W, c) / whole;
    double elastic = fall_of(law, 0, ODD_W + EVEN_W, NULL) / whole, all = fall_of(law, 0, FEATURES, NULL) / whole;
    out->hardening = force_of(c, ODD_W, 1.0) > 2.0 * force_of(c, ODD_W, 0.5); /* the linear part takes no side */
    out->linear = fall_of_pair(law, FEATURE_W, FEATURE_V) / whole;
    out->elastic_odd = odd;
    out->elastic_even = elastic - odd;
    out->dissipative = all - elastic;
    out->memory = 1.0 - all;
    out->drag = drags(law);
}

/* mean f v/(rms f rms v) over the records, each weighted by its rms f. */
static double dissipation(const struct reconstruction *out)
{
    double total = 0.0, sum = 0.0;
    for (size_t r = 0; r < out->n_records; r++) {
        const struct reconstruct_record *record = &out->records[r];
        double speed = root_mean_square(record->v, record->n);
        total += root_mean_square(record->f, record->n);
        if (speed > 0.0)
            sum += dense_dot(record->n, record->f, record->v) / ((double)record->n * speed);
    }
    return total > 0.0 ? sum / total : 0.0;
}

/* ---- Amplitude ---- */

static double mean_seen(const struct site_force *force, size_t record)
{
    double sum = 0.0, count = 0.0;
    for (size_t i = 0; i < force->motion->records[record].m; i++) {
        double weight = square(force->F[record][i]);
        sum += weight * force->seen[record][i];
        count += weight;
    }
    return count > 0.0 ? sum / count : 0.0;
}

/* Slope of ln rms f by ln rms w between records of one kind, the mean over kinds weighted by their range. */
static void fill_amplitude(const struct site_force *force, struct reconstruction *out)
{
    double product = 0.0, range = 0.0;
    for (size_t a = 0; a < out->n_records; a++) {
        for (size_t b = a + 1; b < out->n_records; b++) {
            const struct reconstruct_record *x = &out->records[a], *y = &out->records[b];
            if (transfer_record(force->motion->predictor, x->record).n_channels !=
                    transfer_record(force->motion->predictor, y->record).n_channels ||
                mean_seen(force, x->record) < least_seen || mean_seen(force, y->record) < least_seen)
                continue;
            double w = log(root_mean_square(y->w, y->n) / root_mean_square(x->w, x->n));
            double f = log(root_mean_square(y->f, y->n) / root_mean_square(x->f, x->n));
            if (!isfinite(w) || !isfinite(f) || fabs(w) < 0.4) /* a factor of 1.5 */
                continue;
            product += f * w;
            range += w * w;
        }
    }
    out->amplitude_power = range > 0.0 ? product / range : (double)NAN;
}

/* ---- Frequency ---- */

/* What has fewer periods in a record is no line: where an accelerometer creeps, a large force stands there and falls with frequency. */
enum { LEAST_PERIODS = 4 };

/* The largest maximum of |F|, and the share of the square that is at it; 0: there is none. */
static enum bf_status line_of(const struct reconstruct_record *record, double *frequency_Hz, double *share,
                              struct bf_error *err)
{
    size_t n_lines = record->n / 2 + 1, top = 0;
    double *a = bf_alloc(n_lines, sizeof *a), df = 1.0 / (record->dt_s * (double)record->n), sum = 0.0, around = 0.0;
    enum bf_status status = spectrum_amplitude(record->f, record->n, WINDOW_HANN, a, err);
    for (size_t k = LEAST_PERIODS; k + 1 < n_lines; k++)
        if (a[k] > a[k - 1] && a[k] >= a[k + 1] && (top == 0 || a[k] > a[top]))
            top = k;
    for (size_t k = LEAST_PERIODS; k < n_lines; k++) {
        sum += a[k] * a[k];
        if (fabs((double)k - (double)top) <= fmax(2.0, line_width * (double)top))
            around += a[k] * a[k];
    }
    *frequency_Hz = df * (double)top;
    *share = top > 0 && sum > 0.0 ? around / sum : 0.0;
    free(a);
    return status;
}

static bool near_a_mode(const struct motion *motion, double frequency_Hz)
{
    for (size_t k = 0; k < motion->modes.n; k++) {
        double f = motion->modes.omega_rad[k] / (2.0 * acos(-1.0));
        if (fabs(frequency_Hz - f) < away_from_modes * f)
            return true;
    }
    return false;
}

static enum bf_status fill_frequency(const struct site_force *force, struct reconstruction *out, struct bf_error *err)
{
    const struct reconstruct_record *strongest = &out->records[out->strongest];
    double frequency, share;
    enum bf_status status = line_of(strongest, &out->frequency_Hz, &out->band_share, err);
    bool together = true;
    for (size_t r = 0; status == BF_OK && r < out->n_records; r++) {
        status = line_of(&out->records[r], &frequency, &share, err);
        together = together && fabs(frequency - out->frequency_Hz) < 2.0 * line_width * out->frequency_Hz;
        out->band_share = fmin(out->band_share, share);
    }
    out->resonant = together && out->band_share > resonant_share && !near_a_mode(force->motion, out->frequency_Hz);
    out->n_lines = strongest->n / 2 + 1;
    out->df_Hz = 1.0 / (strongest->dt_s * (double)strongest->n);
    out->spectrum = bf_alloc(out->n_lines, sizeof(double));
    if (status == BF_OK)
        status = spectrum_amplitude(strongest->f, strongest->n, WINDOW_HANN, out->spectrum, err);
    return status;
}

/* ---- Curves ---- */

static size_t bin_of(double x, double size)
{
    double position = 0.5 * (x / size + 1.0) * RECONSTRUCT_BINS;
    return position < 0.0 ? 0 : position >= RECONSTRUCT_BINS ? RECONSTRUCT_BINS - 1 : (size_t)position;
}

/* Mean of f in bins of x; empty bins are NaN. */
static void bin_means(size_t n, const double x[], const double f[], double at[RECONSTRUCT_BINS],
                      double mean[RECONSTRUCT_BINS])
{
    double size = largest(n, x);
    size_t count[RECONSTRUCT_BINS] = {0};
    memset(mean, 0, RECONSTRUCT_BINS * sizeof *mean);
    for (size_t k = 0; size > 0.0 && k < n; k++) {
        size_t bin = bin_of(x[k], size);
        mean[bin] += f[k];
        count[bin]++;
    }
    for (size_t i = 0; i < RECONSTRUCT_BINS; i++) {
        at[i] = size * (2.0 * ((double)i + 0.5) / RECONSTRUCT_BINS - 1.0);
        mean[i] = count[i] > 0 ? mean[i] / (double)count[i] : (double)NAN;
    }
}

static void fill_curves(struct reconstruction *out)
{
    const struct reconstruct_record *record = &out->records[out->strongest];
    double *left = bf_alloc(record->n, sizeof *left), size = largest(record->n, record->w);
    bin_means(record->n, record->w, record->f, out->w_bin, out->f_of_w);
    for (size_t k = 0; k < record->n; k++)
        left[k] = record->f[k] - (size > 0.0 ? out->f_of_w[bin_of(record->w[k], size)] : 0.0);
    bin_means(record->n, record->v, left, out->v_bin, out->f_of_v);
    free(left);
}

enum bf_status reconstruct_shape(const struct site_force *force, const struct site_law *law, struct reconstruction *out,
                                 struct bf_error *err)
{
    for (size_t r = 1; r < out->n_records; r++)
        if (root_mean_square(out->records[r].f, out->records[r].n) >
            root_mean_square(out->records[out->strongest].f, out->records[out->strongest].n))
            out->strongest = r;
    fill_shares(law, out);
    out->dissipated = dissipation(out);
    fill_amplitude(force, out);
    fill_curves(out);
    return fill_frequency(force, out, err);
}
