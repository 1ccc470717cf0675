/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_panels.c — the seed paper's four panels of one channel. */
#include "show.h"
#include "plot.h"
#include "plot_gnuplot.h"
#include "maths/maths.h"

#include <math.h>
#include <stdlib.h>

size_t plot_most_motion(const double z[], size_t n, size_t length)
{
    size_t best = 0;
    double sum = 0.0, largest = -1.0;
    for (size_t i = 0; i < n; i++) {
        sum += z[i] * z[i];
        if (i >= length)
            sum -= z[i - length] * z[i - length];
        if (i + 1 >= length && sum > largest * (1.0 + 1e-9)) {
            largest = sum;
            best = i + 1 - length;
        }
    }
    return best;
}

/* The interval of panel (d), samples: as asked, or about a dozen swings where the motion is largest. */
static void choose_detail(const struct plot_panels *q, size_t *from, size_t *to)
{
    if (q->detail_to_s > q->detail_from_s) {
        const double a = (q->detail_from_s - q->t0_s) / q->dt_s, b = (q->detail_to_s - q->t0_s) / q->dt_s;
        *from = a > 0.0 && a < (double)q->n ? (size_t)a : 0;
        *to = b > 0.0 && b < (double)q->n ? (size_t)b + 1 : q->n;
        if (*to > *from + 2)
            return;
    }
    size_t length = q->n / 12 > 16 ? q->n / 12 : q->n, crossings = 1;
    size_t start = plot_most_motion(q->measured, q->n, length);
    for (size_t i = start + 1; i < start + length; i++)
        crossings += (q->measured[i] < 0.0) != (q->measured[i - 1] < 0.0);
    if (crossings > 25 && length > 40) {
        length = length * 25 / crossings > 40 ? length * 25 / crossings : 40;
        start = plot_most_motion(q->measured, q->n, length);
    }
    *from = start;
    *to = start + length < q->n ? start + length : q->n;
}

enum { MOST_DOTS = 150 }; /* samples of panel (d) that are drawn as dots */

struct axis {
    double low, high;
};

/* Room of 5 % round the data of both signals. */
static struct axis common_range(const double *a, const double *b, size_t n)
{
    struct axis range = {HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < n; i++) {
        range.low = fmin(range.low, fmin(a[i], b[i]));
        range.high = fmax(range.high, fmax(a[i], b[i]));
    }
    const double room = range.high > range.low ? 0.05 * (range.high - range.low) : fmax(1e-12, fabs(range.high));
    range.low -= room;
    range.high += room;
    return range;
}

/* Amplitude spectra of both and of the noise; returns the values worth showing, with room for the key above. */
static struct axis write_spectra(const struct plot_panels *q, struct picture *p, struct bf_error *err)
{
    const size_t n_bins = q->n / 2 + 1;
    double *a = bf_alloc(n_bins, sizeof *a), *b = bf_alloc(n_bins, sizeof *b), largest = 0.0, floor = 0.0;
    const double df = 1.0 / (q->dt_s * (double)q->n);
    if (spectrum_amplitude(q->measured, q->n, WINDOW_NONE, a, err) == BF_OK &&
        spectrum_amplitude(q->model, q->n, WINDOW_NONE, b, err) == BF_OK) {
        FILE *f = picture_data(p, "spectrum");
        (void)fprintf(f, "# frequency_Hz measured model noise (amplitudes of the discrete Fourier transform)\n");
        for (size_t k = 1; k < n_bins; k++) {
            double noise = 0.0;
            if (q->noise_psd != NULL && q->n_noise > 1) {
                const size_t bin = (size_t)lround((double)k / (double)(n_bins - 1) * (double)(q->n_noise - 1));
                noise = sqrt(2.0 * q->noise_psd[bin] * df); /* rms of one bin's amplitude */
            }
            (void)fprintf(f, "%.9g %.6g %.6g %.6g\n", (double)k * df, a[k], b[k], noise);
            largest = fmax(largest, a[k]);
            floor = fmax(floor, noise);
        }
        picture_data_end(p);
    }
    free(a);
    free(b);
    if (!(largest > 0.0))
        largest = 1.0;
    return (struct axis){floor > 0.0 ? fmax(0.05 * floor, 1e-9 * largest) : 1e-6 * largest, 3.0 * largest};
}

/* Panel (d): both as the band-limited signals that their samples stand for, and the measured samples. */
static void write_detail(const struct plot_panels *q, struct picture *p, size_t from, size_t to, struct bf_error *err)
{
    enum { FACTOR = 8 };
    double *a = bf_alloc(FACTOR * q->n, sizeof *a), *b = bf_alloc(FACTOR * q->n, sizeof *b);
    if (resample_band_limited(q->measured, q->n, FACTOR, a, err) == BF_OK &&
        resample_band_limited(q->model, q->n, FACTOR, b, err) == BF_OK) {
        const double *series[2] = {a, b};
        FILE *f = picture_data(p, "detail");
        (void)fprintf(f, "# time_s measured model (interpolated within the band; one row in %d is a sample)\n", FACTOR);
        plot_write_series(f, q->t0_s, q->dt_s / FACTOR, series, 2, FACTOR * from, FACTOR * (to - 1) + 1);
        picture_data_end(p);
        f = picture_data(p, "samples");
        (void)fprintf(f, "# time_s measured\n");
        plot_write_series(f, q->t0_s, q->dt_s, &q->measured, 1, from, to);
        picture_data_end(p);
    }
    free(a);
    free(b);
}

static void write_time(const struct plot_panels *q, struct picture *p)
{
    const double *series[2] = {q->measured, q->model};
    FILE *f = picture_data(p, "time");
    (void)fprintf(f, "# time_s measured model\n");
    plot_write_series(f, q->t0_s, q->dt_s, series, 2, 0, q->n);
    picture_data_end(p);
}

/* A panel in the time domain: (a) and (b). */
static void time_panel(const struct plot_panels *q, struct picture *p, const char *title, int column,
                       const char *colour)
{
    char label[160];
    const struct axis y = common_range(q->measured, q->model, q->n);
    const double k = plot_scaled(q->quantity, fmax(-y.low, y.high), label, sizeof label);
    plot_panel_title(p->script, title);
    plot_axes(p->script, "Time (s)", label);
    plot_ticks(p->script, 'y', k * y.low, k * y.high);
    (void)fprintf(p->script,
                  "unset key\nset xrange [%.9g:%.9g]\nset yrange [%.6g:%.6g]\n"
                  "plot '%s-time.dat' using 1:(%.9g*$%d) with lines linewidth 0.8 linecolor rgb '%s'\n"
                  "set ytics autofreq\n",
                  q->t0_s, q->t0_s + (double)q->n * q->dt_s, k * y.low, k * y.high, p->stem, k, column, colour);
}

static void spectrum_panel(const struct plot_panels *q, struct picture *p, struct axis y)
{
    char label[160];
    const double nyquist = 0.5 / q->dt_s, to = q->to_Hz > q->from_Hz ? q->to_Hz : nyquist;
    plot_quantity(q->quantity, "", label, sizeof label);
    plot_panel_title(p->script, "(c) amplitude spectrum");
    plot_axes(p->script, "Frequency (Hz)", label);
    plot_si_logarithmic(p->script, 'y', y.low, y.high);
    (void)fprintf(p->script, "set xrange [%.9g:%.9g]\nplot ", q->from_Hz, to);
    (void)fprintf(p->script,
                  "'%s-spectrum.dat' using 1:2 with lines linewidth 1 linecolor rgb '" PLOT_MEASURED
                  "' title 'measured', "
                  "'' using 1:3 with lines linewidth 1 dashtype 2 linecolor rgb '" PLOT_MODEL "' title 'model'",
                  p->stem);
    if (q->noise_psd != NULL)
        (void)fprintf(p->script,
                      ", '' using 1:4 with lines linewidth 1.6 linecolor rgb '" PLOT_NOISE "' title 'noise'");
    (void)fputc('\n', p->script);
    plot_linear(p->script, 'y');
}

static void detail_panel(const struct plot_panels *q, struct picture *p, size_t from, size_t to)
{
    char label[160];
    const struct axis y = common_range(q->measured + from, q->model + from, to - from);
    const double k = plot_scaled(q->quantity, fmax(-y.low, y.high), label, sizeof label);
    plot_panel_title(p->script, "(d) a short interval");
    plot_axes(p->script, "Time (s)", label);
    const double start = q->t0_s + (double)from * q->dt_s, end = q->t0_s + (double)(to - 1) * q->dt_s;
    plot_ticks(p->script, 'x', start, end);
    plot_ticks(p->script, 'y', k * y.low, k * y.high);
    (void)fprintf(p->script,
                  "set yrange [%.6g:%.6g]\nset xrange [%.9g:%.9g]\n"
                  "plot '%s-detail.dat' using 1:(%.9g*$2) with lines linewidth 1.4 linecolor rgb '" PLOT_MEASURED
                  "' title 'measured', ",
                  k * y.low, k * y.high, start, end, p->stem, k);
    if (to - from <= MOST_DOTS)
        (void)fprintf(
            p->script,
            "'%s-samples.dat' using 1:(%.9g*$2) with points pointtype 7 pointsize dot linecolor rgb '" PLOT_MEASURED
            "', ",
            p->stem, k);
    (void)fprintf(p->script,
                  "'%s-detail.dat' using 1:(%.9g*$3) with lines linewidth 1.4 dashtype 2 linecolor rgb '" PLOT_MODEL
                  "' title 'model'\n",
                  p->stem, k);
}

enum bf_status plot_panels(const struct plot_panels *q, struct bf_error *err)
{
    struct picture p;
    struct bf_error failed = {BF_OK, ""};
    size_t from, to;
    if (q->n < 4)
        return bf_fail(err, BF_NUMERIC, "a picture needs at least 4 samples; %s has %zu", q->quantity, q->n);
    choose_detail(q, &from, &to);
    picture_begin(q->directory, q->stem, 18.0, 14.5, &p);
    write_time(q, &p);
    write_detail(q, &p, from, to, &failed);
    const struct axis spectrum = write_spectra(q, &p, &failed);
    plot_sheet(p.script,
               q->title != NULL ? "layout 2,2 margins 0.09,0.985,0.095,0.865 spacing 0.105,0.19"
                                : "layout 2,2 margins 0.09,0.985,0.095,0.91 spacing 0.105,0.19",
               q->title);
    plot_note(p.script, q->note);
    time_panel(q, &p, "(a) measured", 2, PLOT_MEASURED);
    time_panel(q, &p, "(b) model", 3, PLOT_MODEL);
    spectrum_panel(q, &p, spectrum);
    detail_panel(q, &p, from, to);
    (void)fprintf(p.script, "unset multiplot\n");
    const enum bf_status status = picture_end(&p, err);
    if (status == BF_OK && failed.status != BF_OK)
        return bf_fail(err, failed.status, "%s", failed.text);
    return status;
}
