/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_force.c — a reconstructed force against displacement, velocity, amplitude and frequency. */
#include "show.h"
#include "plot.h"
#include "plot_gnuplot.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_DOTS = 4000 };

/* What the binned mean leaves: linear between bins, its ends held. */
static double mean_at(const struct plot_force *q, double w)
{
    double x0 = 0.0, y0 = 0.0;
    bool first = true;
    for (size_t b = 0; b < q->n_bins; b++) {
        const double x = q->w_bin[b], y = q->f_of_w[b];
        if (!isfinite(x) || !isfinite(y))
            continue;
        if (w <= x)
            return first || x <= x0 ? y : y0 + (y - y0) * (w - x0) / (x - x0);
        x0 = x, y0 = y;
        first = false;
    }
    return y0;
}

static void write_samples(const struct plot_force *q, struct picture *p)
{
    const size_t step = q->n / MOST_DOTS + 1;
    FILE *f = picture_data(p, "samples");
    (void)fprintf(f, "# displacement velocity force force_without_mean_at_displacement\n");
    for (size_t k = 0; k < q->n; k += step)
        (void)fprintf(f, "%.6g %.6g %.6g %.6g\n", q->w[k], q->v[k], q->f[k], q->f[k] - mean_at(q, q->w[k]));
    picture_data_end(p);
}

static void write_pairs(struct picture *p, const char *name, const char *head, const double *x, const double *y,
                        size_t n)
{
    FILE *f = picture_data(p, name);
    size_t written = 0;
    (void)fprintf(f, "# %s\n", head);
    for (size_t k = 0; k < n; k++)
        if (isfinite(x[k]) && isfinite(y[k])) {
            (void)fprintf(f, "%.6g %.6g\n", x[k], y[k]);
            written++;
        }
    if (written == 0)
        (void)fprintf(f, "nan nan\n");
    picture_data_end(p);
}

/* Up to where the spectrum goes: twice the frequency below which 99 % of the power is. */
static double write_spectrum(const struct plot_force *q, struct picture *p, double *largest)
{
    double total = 0.0, sum = 0.0, top = (double)q->n_lines;
    *largest = 0.0;
    FILE *f = picture_data(p, "spectrum");
    (void)fprintf(f, "# frequency_Hz force\n");
    for (size_t k = 1; k < q->n_lines; k++) {
        total += q->spectrum[k] * q->spectrum[k];
        *largest = fmax(*largest, q->spectrum[k]);
        (void)fprintf(f, "%.7g %.6g\n", q->df_Hz * (double)k, q->spectrum[k]);
    }
    picture_data_end(p);
    for (size_t k = 1; k < q->n_lines; k++) {
        sum += q->spectrum[k] * q->spectrum[k];
        if (sum >= 0.99 * total) {
            top = fmin(top, fmax(2.0 * (double)k, 20.0));
            break;
        }
    }
    return q->df_Hz * top;
}

/* Half the height of (a) and (b): the means fill it, and so do nine tenths of the samples; a few may lie outside. */
static double height(const struct plot_force *q)
{
    double top = 0.0;
    double *size = bf_alloc(q->n + 1, sizeof *size);
    for (size_t k = 0; k < q->n; k++)
        size[k] = fabs(q->f[k]);
    sort_ascending(q->n, size);
    if (q->n > 0)
        top = size[q->n * 9 / 10];
    free(size);
    for (size_t b = 0; b < q->n_bins; b++) {
        top = isfinite(q->f_of_w[b]) ? fmax(top, 1.3 * fabs(q->f_of_w[b])) : top;
        top = isfinite(q->f_of_v[b]) ? fmax(top, 1.3 * fabs(q->f_of_v[b])) : top;
    }
    return top > 0.0 ? top : 1.0;
}

static void motion_panel(const struct plot_force *q, struct picture *p, bool velocity)
{
    const double *x = velocity ? q->v : q->w, y = height(q);
    double low = 0.0, high = 0.0;
    for (size_t k = 0; k < q->n; k++) {
        low = fmin(low, x[k]);
        high = fmax(high, x[k]);
    }
    if (!(high > low))
        high = low + 1.0;
    plot_panel_title(p->script, velocity ? "(b) what the mean in (a) leaves" : "(a) against displacement");
    plot_axes(p->script, velocity ? q->velocity : q->displacement, q->force);
    (void)fprintf(p->script,
                  "set xtics %.6g\nset xrange [%.6g:%.6g]\nset yrange [%.6g:%.6g]\n"
                  "plot '%s-samples.dat' using %d:%d with points pointtype 7 pointsize 0.6*dot linecolor rgb '#B8C4CE'"
                  ", '%s-%s.dat' using 1:2 with linespoints pointtype 7 pointsize 0.8*mark linewidth 1.6 linecolor "
                  "rgb '%s'\n",
                  plot_tick_step(1.5 * (high - low)), 1.05 * low, 1.05 * high, -y, y, p->stem, velocity ? 2 : 1,
                  velocity ? 4 : 3, p->stem, velocity ? "of_v" : "of_w", PLOT_RESIDUAL);
}

static void size_panel(const struct plot_force *q, struct picture *p)
{
    plot_panel_title(p->script, "(c) rms in short windows, all records");
    plot_axes(p->script, q->displacement, q->force);
    (void)fprintf(p->script,
                  "set autoscale\nset logscale xy\nset format x '10^{%%T}'\nset format y '10^{%%T}'\n"
                  "set xtics autofreq\n"
                  "plot '%s-sizes.dat' using 1:2 with points pointtype 7 pointsize 0.5*mark linecolor rgb '" PLOT_GREEN
                  "'\nunset logscale\nset format '%%h'\n",
                  p->stem);
}

static void spectrum_panel(const struct plot_force *q, struct picture *p, double top_Hz, double largest)
{
    plot_panel_title(p->script, "(d) amplitude spectrum");
    plot_axes(p->script, "Frequency (Hz)", q->force);
    (void)fprintf(p->script, "set autoscale\nset logscale y\nset format y '10^{%%T}'\nset xrange [0:%.6g]\n", top_Hz);
    if (largest > 0.0)
        (void)fprintf(p->script, "set yrange [%.6g:%.6g]\n", 1e-4 * largest, 5.0 * largest);
    (void)fprintf(p->script, "set xtics %.6g\n", plot_tick_step(top_Hz));
    for (size_t m = 0; m < q->n_modes && q->mode_Hz[m] < top_Hz; m++)
        (void)fprintf(p->script,
                      "set arrow from %.6g, graph 0 to %.6g, graph 1 nohead back dashtype 3 linewidth 1 linecolor rgb "
                      "'" PLOT_GREY "'\n",
                      q->mode_Hz[m], q->mode_Hz[m]);
    (void)fprintf(p->script,
                  "plot '%s-spectrum.dat' using 1:2 with lines linewidth 0.8 linecolor rgb '" PLOT_RESIDUAL
                  "', NaN with lines dashtype 3 linewidth 1 linecolor rgb '" PLOT_GREY "' title 'modes'\n",
                  p->stem);
}

enum bf_status plot_force(const struct plot_force *q, struct bf_error *err)
{
    struct picture p;
    double largest;
    picture_begin(q->directory, q->stem, 18.0, 15.0, &p);
    write_samples(q, &p);
    write_pairs(&p, "of_w", "displacement mean_force", q->w_bin, q->f_of_w, q->n_bins);
    write_pairs(&p, "of_v", "velocity mean_of_what_is_left", q->v_bin, q->f_of_v, q->n_bins);
    write_pairs(&p, "sizes", "displacement_rms force_rms", q->size_w, q->size_f, q->n_sizes);
    const double top_Hz = write_spectrum(q, &p, &largest);
    plot_sheet(p.script,
               "layout 2,2 margins screen 0.11, screen 0.97, screen 0.08, screen 0.88 spacing screen 0.14, screen 0.19",
               q->title);
    motion_panel(q, &p, false);
    motion_panel(q, &p, true);
    size_panel(q, &p);
    spectrum_panel(q, &p, top_Hz, largest);
    (void)fprintf(p.script, "unset multiplot\n");
    return picture_end(&p, err);
}
