/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_live.c — what a board measured and predicted, below each other over one time axis. */
#include "show.h"
#include "plot.h"
#include "plot_gnuplot.h"

#include <math.h>

static double largest_of(size_t n, const double x[])
{
    double largest = 0.0;
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, fabs(x[i]));
    return largest > 0.0 ? largest : 1.0;
}

static void panel(const struct plot_live *q, struct picture *p, double bottom, const char *title, const char *label)
{
    (void)fprintf(p->script,
                  "set lmargin at screen 0.105\nset rmargin at screen 0.985\nset bmargin at screen %.4f\n"
                  "set tmargin at screen %.4f\nset xrange [0:%.9g]\n",
                  bottom, bottom + 0.175, (double)q->n * q->dt_s);
    plot_panel_title(p->script, title);
    plot_axes(p->script, "Time (s)", label);
}

static void signals(const struct plot_live *q, struct picture *p)
{
    char label[160];
    const double most = fmax(largest_of(q->n, q->measured), largest_of(q->n, q->predicted));
    const double k = plot_scaled(q->quantity, most, label, sizeof label);
    panel(q, p, 0.72, "(a) measured and predicted", label);
    plot_ticks(p->script, 'y', -k * most, k * most);
    (void)fprintf(
        p->script,
        "set yrange [%.6g:%.6g]\nplot '%s-time.dat' using 1:(%.9g*$2) with lines linewidth 1.2 linecolor rgb "
        "'" PLOT_MEASURED
        "' title 'measured', '' using 1:(%.9g*$3) with lines linewidth 1 dashtype 2 linecolor rgb '" PLOT_MODEL
        "' title 'predicted'\n",
        -1.08 * k * most, 1.08 * k * most, p->stem, k, k);
}

static void residual(const struct plot_live *q, struct picture *p)
{
    char label[160];
    const double most = fmax(largest_of(q->n, q->residual), 2.5 * q->noise_rms);
    const double k = plot_scaled(q->quantity, most, label, sizeof label);
    panel(q, p, 0.405, "(b) residual = measured − predicted", label);
    plot_ticks(p->script, 'y', -k * most, k * most);
    (void)fprintf(p->script,
                  "set yrange [%.6g:%.6g]\nplot '%s-time.dat' using 1:(%.9g*$4) with lines linewidth 0.8 linecolor rgb "
                  "'" PLOT_RESIDUAL "' title 'residual', %.6g with lines linewidth 1.4 linecolor rgb '" PLOT_NOISE
                  "' title '±2σ of the noise', %.6g with lines linewidth 1.4 linecolor rgb '" PLOT_NOISE "'\n",
                  -1.08 * k * most, 1.08 * k * most, p->stem, k, 2.0 * k * q->noise_rms, -2.0 * k * q->noise_rms);
}

static void ratio(const struct plot_live *q, struct picture *p)
{
    const double most = fmax(largest_of(q->n, q->ratio), q->alarm_ratio);
    panel(q, p, 0.09, "(c) running rms of the residual over the noise", "ratio to noise");
    (void)fprintf(p->script,
                  "set ytics autofreq\nset key width 1\nset yrange [0:%.6g]\nplot '%s-time.dat' using 1:5 with lines "
                  "linewidth 1.4 "
                  "linecolor rgb '" PLOT_RESIDUAL
                  "' title 'ratio', %.6g with lines dashtype 2 linewidth 1.4 linecolor rgb '" PLOT_VERMILLION
                  "' title 'alarm', 1 with lines linewidth 1 linecolor rgb '" PLOT_NOISE "' title 'noise'\n",
                  1.15 * most, p->stem, q->alarm_ratio);
}

enum bf_status plot_live(const struct plot_live *q, struct bf_error *err)
{
    const double *const series[] = {q->measured, q->predicted, q->residual, q->ratio};
    struct picture p;
    if (q->n < 4)
        return bf_fail(err, BF_NUMERIC, "a picture needs at least 4 samples; %s has %zu", q->quantity, q->n);
    picture_begin(q->directory, q->stem, 18.0, 17.0, &p);
    FILE *f = picture_data(&p, "time");
    (void)fprintf(f, "# time_s measured predicted residual ratio\n");
    plot_write_series(f, 0.0, q->dt_s, series, 4, 0, q->n);
    picture_data_end(&p);
    plot_sheet(p.script, "", q->title);
    signals(q, &p);
    residual(q, &p);
    ratio(q, &p);
    (void)fprintf(p.script, "unset multiplot\n");
    return picture_end(&p, err);
}
