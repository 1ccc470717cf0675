/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_residual.c — the page that shows what a model leaves unexplained. */
#include "show.h"
#include "plot.h"
#include "plot_gnuplot.h"
#include "maths/maths.h"

#include <math.h>

/* Where a panel of the page stands, parts of its width and height. */
static void place(struct picture *p, double left, double right, double bottom, double top)
{
    (void)fprintf(p->script,
                  "set lmargin at screen %.4f\nset rmargin at screen %.4f\nset bmargin at screen %.4f\n"
                  "set tmargin at screen %.4f\n",
                  left, right, bottom, top);
}

static void time_panel(const struct plot_residual *q, struct picture *p)
{
    char label[160];
    double largest = 2.5 * q->noise_rms;
    for (size_t i = 0; i < q->n; i++)
        largest = fmax(largest, fabs(q->residual[i]));
    largest = largest > 0.0 ? largest : 1.0;
    FILE *f = picture_data(p, "time");
    (void)fprintf(f, "# time_s residual\n");
    plot_write_series(f, q->t0_s, q->dt_s, &q->residual, 1, 0, q->n);
    picture_data_end(p);
    const double k = plot_scaled(q->quantity, largest, label, sizeof label);
    place(p, 0.095, 0.985, 0.735, 0.885);
    plot_panel_title(p->script, "(a) residual = measured − model");
    plot_axes(p->script, "Time (s)", label);
    plot_ticks(p->script, 'y', -k * largest, k * largest);
    (void)fprintf(p->script, "set xrange [%.9g:%.9g]\nset yrange [%.6g:%.6g]\nplot ", q->t0_s,
                  q->t0_s + (double)q->n * q->dt_s, -1.08 * k * largest, 1.08 * k * largest);
    (void)fprintf(p->script,
                  "'%s-time.dat' using 1:(%.9g*$2) with lines linewidth 0.8 linecolor rgb '" PLOT_RESIDUAL
                  "' title 'residual'",
                  p->stem, k);
    if (q->noise_rms > 0.0)
        (void)fprintf(p->script,
                      ", %.6g with lines linewidth 1.4 linecolor rgb '" PLOT_NOISE "' title '±2σ of the noise', "
                      "%.6g with lines linewidth 1.4 linecolor rgb '" PLOT_NOISE "'",
                      2.0 * k * q->noise_rms, -2.0 * k * q->noise_rms);
    (void)fprintf(p->script, "\nset yrange [*:*]\nset ytics autofreq\n");
}

/* Returns the largest value. */
static double write_density(const struct plot_residual *q, struct picture *p, struct bf_error *err)
{
    struct cross_spectrum s;
    if (spectrum_cross(q->residual, NULL, q->n, q->dt_s, 0, &s, err) != BF_OK)
        return 1.0;
    double largest = 0.0;
    FILE *f = picture_data(p, "density");
    (void)fprintf(f, "# frequency_Hz density of the residual (one-sided)\n");
    for (size_t k = 1; k < s.n_bins; k++) {
        (void)fprintf(f, "%.9g %.6g\n", (double)k * s.df_Hz, s.pxx[k]);
        largest = fmax(largest, s.pxx[k]);
    }
    picture_data_end(p);
    cross_spectrum_free(&s);
    f = picture_data(p, "noise");
    (void)fprintf(f, "# frequency_Hz density of the noise (one-sided)\n");
    for (size_t k = 0; k < q->n_noise; k++) {
        (void)fprintf(f, "%.9g %.6g\n", 0.5 / q->dt_s * (double)k / (double)(q->n_noise - 1), q->noise_psd[k]);
        largest = fmax(largest, q->noise_psd[k]);
    }
    picture_data_end(p);
    return largest > 0.0 ? largest : 1.0;
}

static void density_panel(const struct plot_residual *q, struct picture *p, struct bf_error *err)
{
    char label[160];
    const double largest = write_density(q, p, err);
    plot_quantity(q->quantity, "²/Hz", label, sizeof label);
    place(p, 0.095, 0.49, 0.41, 0.58);
    plot_panel_title(p->script, "(b) spectral density");
    plot_axes(p->script, "Frequency (Hz)", label);
    (void)fprintf(p->script,
                  "set logscale y\nset format y '10^{%%T}'\nset xrange [0:%.9g]\nset yrange [*:%.6g]\nplot "
                  "'%s-density.dat' using 1:2 with lines "
                  "linewidth 1 linecolor rgb '" PLOT_RESIDUAL "' title 'residual'",
                  0.5 / q->dt_s, 3.0 * largest, p->stem);
    if (q->n_noise > 1)
        (void)fprintf(p->script,
                      ", '%s-noise.dat' using 1:2 with lines linewidth 1.6 linecolor rgb '" PLOT_NOISE
                      "' title 'noise'",
                      p->stem);
    (void)fprintf(p->script, "\nunset logscale\nset format y '%%h'\nset yrange [*:*]\n");
}

static void stems(struct picture *p, const char *name, double bound, const char *colour, const char *bound_text)
{
    (void)fprintf(p->script,
                  "plot '%s-%s.dat' using 1:2 with impulses linewidth 1.2 linecolor rgb '%s', "
                  "%.6g with lines dashtype 2 linewidth 1.2 linecolor rgb 'black' title '%s', "
                  "%.6g with lines dashtype 2 linewidth 1.2 linecolor rgb 'black'\n",
                  p->stem, name, colour, bound, bound_text, -bound);
}

static void autocorrelation_panel(const struct plot_residual *q, struct picture *p)
{
    FILE *f = picture_data(p, "autocorrelation");
    (void)fprintf(f, "# lag_s autocorrelation of the residual\n");
    double largest = q->autocorrelation_bound;
    for (size_t k = 1; k < q->n_autocorrelation; k++) {
        (void)fprintf(f, "%.9g %.6g\n", (double)k * q->dt_s, q->autocorrelation[k]);
        largest = fmax(largest, fabs(q->autocorrelation[k]));
    }
    picture_data_end(p);
    place(p, 0.59, 0.985, 0.41, 0.58);
    plot_panel_title(p->script, "(c) autocorrelation");
    plot_axes(p->script, "Lag (s)", "correlation");
    (void)fprintf(p->script, "set xtics %.6g\nset xrange [0:%.9g]\nset yrange [%.6g:%.6g]\n",
                  plot_tick_step((double)q->n_autocorrelation * q->dt_s), (double)q->n_autocorrelation * q->dt_s,
                  -1.15 * largest, 1.15 * largest);
    stems(p, "autocorrelation", q->autocorrelation_bound, PLOT_RESIDUAL, "95 % of white noise");
}

static void input_panel(const struct plot_residual *q, struct picture *p)
{
    char title[160];
    double largest = q->input_bound;
    FILE *f = picture_data(p, "input");
    (void)fprintf(f, "# lag_s correlation of residual and input, both whitened; positive: residual later\n");
    for (size_t i = 0; i < 2 * q->n_lags + 1; i++) {
        (void)fprintf(f, "%.9g %.6g\n", ((double)i - (double)q->n_lags) * q->dt_s, q->input_correlation[i]);
        largest = fmax(largest, fabs(q->input_correlation[i]));
    }
    picture_data_end(p);
    (void)snprintf(title, sizeof title, "(d) correlation with %s", q->input_name);
    place(p, 0.095, 0.49, 0.085, 0.255);
    plot_panel_title(p->script, title);
    plot_axes(p->script, "Lag (s)", "correlation");
    const double reach = ((double)q->n_lags + 1.0) * q->dt_s;
    (void)fprintf(p->script, "set xtics %.6g\nset xrange [%.9g:%.9g]\nset yrange [%.6g:%.6g]\n",
                  plot_tick_step(2.0 * reach), -reach, reach, -1.15 * largest, 1.15 * largest);
    stems(p, "input", q->input_bound, PLOT_RESIDUAL, "99 % over all lags");
}

static void band_panel(const struct plot_residual *q, struct picture *p)
{
    double largest = 0.0;
    FILE *f = picture_data(p, "bands");
    (void)fprintf(f, "# band from_Hz to_Hz share of the misfit, %%\n");
    for (size_t i = 0; i < q->n_bands; i++) {
        (void)fprintf(f, "%zu %.5g %.5g %.5g\n", i + 1, q->edge_Hz[i], q->edge_Hz[i + 1], 100.0 * q->share[i]);
        largest = fmax(largest, 100.0 * q->share[i]);
    }
    picture_data_end(p);
    const bool wide = q->input_correlation == NULL; /* the page has room to the left then */
    place(p, wide ? 0.095 : 0.59, 0.985, 0.085, 0.255);
    plot_panel_title(p->script, wide ? "(d) share of the misfit" : "(e) share of the misfit");
    plot_axes(p->script, "Band (Hz)", "share (%)");
    (void)fprintf(p->script, "set xrange [0.4:%zu.6]\nset yrange [0:%.6g]\nset xtics (", q->n_bands,
                  1.12 * fmax(1.0, largest));
    for (size_t i = 0; i < q->n_bands; i++) /* edges stand between the bars */
        (void)fprintf(p->script, "'%.0f' %zu.5, ", q->edge_Hz[i], i);
    (void)fprintf(p->script,
                  "'%.0f' %zu.5)\nplot '%s-bands.dat' using 1:4:(0.8) with boxes linecolor rgb '" PLOT_RESIDUAL "'\n",
                  q->edge_Hz[q->n_bands], q->n_bands, p->stem);
}

enum bf_status plot_residual(const struct plot_residual *q, struct bf_error *err)
{
    struct picture p;
    struct bf_error failed = {BF_OK, ""};
    if (q->n < 4)
        return bf_fail(err, BF_NUMERIC, "a picture needs at least 4 samples; %s has %zu", q->quantity, q->n);
    picture_begin(q->directory, q->stem, 18.0, 17.0, &p);
    plot_sheet(p.script, "", q->title);
    plot_note(p.script, q->note);
    time_panel(q, &p);
    density_panel(q, &p, &failed);
    if (q->autocorrelation != NULL)
        autocorrelation_panel(q, &p);
    if (q->input_correlation != NULL)
        input_panel(q, &p);
    if (q->share != NULL)
        band_panel(q, &p);
    (void)fprintf(p.script, "unset multiplot\n");
    const enum bf_status status = picture_end(&p, err);
    if (status == BF_OK && failed.status != BF_OK)
        return bf_fail(err, failed.status, "%s", failed.text);
    return status;
}
