/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_drift.c — a decay: amplitude of modes in time, frequency and damping against it, measured and modelled. */
#include "show.h"
#include "plot.h"
#include "plot_gnuplot.h"

#include <math.h>

enum row { ENVELOPE, FREQUENCY, DAMPING, ROWS };

static double value_of(const struct plot_drift_curve *c, enum row row, size_t k)
{
    return row == ENVELOPE ? c->amplitude[k] : row == FREQUENCY ? c->frequency_Hz[k] : 100.0 * c->damping[k];
}

static double error_of(const struct plot_drift_curve *c, enum row row, size_t k)
{
    if (row == ENVELOPE)
        return c->amplitude_sd;
    if (c->frequency_sd_Hz == NULL || c->damping_sd == NULL)
        return 0.0;
    return row == FREQUENCY ? c->frequency_sd_Hz[k] : 100.0 * c->damping_sd[k];
}

/* Columns 1 to 4: time, amplitude, frequency, damping in %; 5 to 7: errors of the last three. A blank line between curves. */
static void write_curves(const struct plot_drift_curve *curves, size_t n, struct picture *p, const char *what,
                         size_t mode)
{
    char name[32];
    (void)snprintf(name, sizeof name, "%s%zu", what, mode + 1);
    FILE *f = picture_data(p, name);
    (void)fprintf(f, "# time_s amplitude frequency_Hz damping_percent and the standard errors of the last three\n");
    for (size_t i = 0; i < n; i++) {
        const struct plot_drift_curve *c = &curves[i];
        for (size_t k = 0; k < c->n; k++)
            if (c->amplitude[k] > 0.0)
                (void)fprintf(f, "%.9g %.6g %.9g %.6g %.3g %.3g %.3g\n", c->t_s[k], c->amplitude[k], c->frequency_Hz[k],
                              value_of(c, DAMPING, k), c->amplitude_sd, error_of(c, FREQUENCY, k),
                              error_of(c, DAMPING, k));
        (void)fprintf(f, "nan nan nan nan nan nan nan\n\n");
    }
    if (n == 0)
        (void)fprintf(f, "nan nan nan nan nan nan nan\n");
    picture_data_end(p);
}

static void measured_range(const struct plot_drift_mode *q, enum row row, double *low, double *high)
{
    *low = HUGE_VAL, *high = -HUGE_VAL;
    for (size_t i = 0; i < q->n_measured; i++)
        for (size_t k = 0; k < q->measured[i].n; k++) {
            const double y = value_of(&q->measured[i], row, k);
            const double error = row == ENVELOPE ? 0.0 : error_of(&q->measured[i], row, k);
            *low = fmin(*low, y - error);
            *high = fmax(*high, y + error);
        }
}

/* The models, too, as far as they stay within twice the range of what is measured (a decade of an amplitude). */
static void find_range(const struct plot_drift_mode *q, enum row row, double *low, double *high)
{
    const struct plot_drift_curve *models[2] = {q->before, q->after};
    const size_t n_models[2] = {q->n_before, q->n_after};
    measured_range(q, row, low, high);
    const double size = *high - *low, least = row == ENVELOPE ? 0.1 * *low : *low - size,
                 most = row == ENVELOPE ? 10.0 * *high : *high + size;
    for (int m = 0; m < 2; m++)
        for (size_t i = 0; i < n_models[m]; i++)
            for (size_t k = 0; k < models[m][i].n; k++) {
                const double y = value_of(&models[m][i], row, k);
                if (y >= least && y <= most) {
                    *low = fmin(*low, y);
                    *high = fmax(*high, y);
                }
            }
    if (row == ENVELOPE)
        return;
    const double least_room = row == FREQUENCY ? 1e-4 * fabs(*high) : 0.02 * fabs(*high);
    const double room = fmax(0.08 * (*high - *low), least_room);
    *low -= room;
    *high += room;
}

/* Under the title of the picture, once for all panels: a plot of its own, without anything in it. */
static void draw_legend(const struct plot_drift *q, struct picture *p)
{
    bool before = false, after = false;
    for (size_t m = 0; m < q->n_modes; m++) {
        before = before || q->modes[m].n_before > 0;
        after = after || q->modes[m].n_after > 0;
    }
    plot_linear(p->script, 'x');
    plot_linear(p->script, 'y');
    (void)fprintf(p->script,
                  "unset border\nunset tics\nunset xlabel\nunset ylabel\nunset label\nset lmargin at screen 0.02\n"
                  "set rmargin at screen 0.98\nset tmargin at screen 0.96\nset bmargin at screen 0.93\n"
                  "set key center center horizontal maxrows 1 samplen 3 width 1\n"
                  "plot [0:1] [0:1] 2 with points pointtype 7 pointsize 1.1*mark linecolor rgb '" PLOT_MEASURED
                  "' title 'measured'%s",
                  before ? ", 2 with lines dashtype 2 linewidth 2 linecolor rgb '" PLOT_MODEL_BEFORE
                           "' title 'model before'"
                         : "");
    if (after)
        (void)fprintf(p->script, ", 2 with lines linewidth 1.6 linecolor rgb '" PLOT_MODEL "' title '%s'",
                      before ? "model after" : "model");
    (void)fprintf(p->script, "\n");
}

/* A model whose curves are all beyond the panel is told in words, at its edge. */
static void tell_of_model(struct picture *p, const struct plot_drift_curve *models, size_t n, enum row row, double low,
                          double high, int place)
{
    double sum = 0.0, count = 0.0;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < models[i].n; k++) {
            const double y = value_of(&models[i], row, k);
            if (y >= low && y <= high)
                return;
            if (isfinite(y)) {
                sum += y;
                count += 1.0;
            }
        }
    if (count > 0.0 && row != ENVELOPE)
        (void)fprintf(p->script,
                      "set label %d '%s %.4g %s' at graph 0.99, graph %s right noenhanced textcolor rgb '%s'\n", place,
                      sum / count > high ? "↑ model" : "↓ model", sum / count, row == FREQUENCY ? "Hz" : "%",
                      sum / count > high ? "0.95" : "0.06", place == 2 ? PLOT_MODEL_BEFORE : PLOT_MODEL);
}

/* Where the panels are, in cm; the picture is as wide as its columns. */
static const double left_cm = 2.3, right_cm = 0.5, gap_cm = 2.7, column_cm[PLOT_DRIFT_MODES] = {14.2, 9.3, 7.6};

static double width_of(size_t columns)
{
    const double n = (double)columns;
    return left_cm + right_cm + n * column_cm[columns - 1] + (n - 1.0) * gap_cm;
}

static void place_panel(struct picture *p, size_t columns, size_t column, enum row row)
{
    static const double top = 0.885, high = 0.206, step = 0.302; /* shares of the picture */
    const double width = width_of(columns), left = left_cm + (double)column * (column_cm[columns - 1] + gap_cm);
    (void)fprintf(p->script,
                  "set lmargin at screen %.4f\nset rmargin at screen %.4f\nset tmargin at screen %.4f\nset bmargin at "
                  "screen %.4f\n",
                  left / width, (left + column_cm[columns - 1]) / width, top - step * row, top - step * row - high);
}

static void draw_curves(const struct plot_drift_mode *q, struct picture *p, enum row row, size_t mode)
{
    const int x = row == ENVELOPE ? 1 : 2, y = (int)row + 2, sd = (int)row + 5;
    (void)fprintf(p->script,
                  "plot '%s-measured%zu.dat' using %d:%d:%d with yerrorbars pointtype 7 pointsize 1.1*mark linewidth "
                  "0.8 linecolor rgb '" PLOT_MEASURED "'",
                  p->stem, mode + 1, x, y, sd);
    if (q->n_before > 0)
        (void)fprintf(p->script,
                      ", '%s-before%zu.dat' using %d:%d with lines dashtype 2 linewidth 2 linecolor rgb "
                      "'" PLOT_MODEL_BEFORE "'",
                      p->stem, mode + 1, x, y);
    if (q->n_after > 0)
        (void)fprintf(p->script,
                      ", '%s-after%zu.dat' using %d:%d with lines linewidth 1.6 linecolor rgb '" PLOT_MODEL "'",
                      p->stem, mode + 1, x, y);
    (void)fprintf(p->script, "\n");
}

static void title_panel(struct picture *p, const char *title, enum row row)
{
    (void)fputs("set label 1 ", p->script);
    plot_quote(p->script, row == ENVELOPE ? title : "");
    (void)fputs(" at graph 0, graph 1.09 left noenhanced\n", p->script);
}

static void panel(const struct plot_drift *q, struct picture *p, enum row row, size_t mode)
{
    static const char *const labels[ROWS] = {NULL, "Frequency (Hz)", "Damping ratio (%)"};
    char amplitude[160], label[200];
    double low, high, from, to;
    find_range(&q->modes[mode], row, &low, &high);
    find_range(&q->modes[mode], ENVELOPE, &from, &to);
    plot_quantity(q->quantity, "", amplitude, sizeof amplitude);
    (void)snprintf(label, sizeof label, "Amplitude in %s", amplitude);
    plot_linear(p->script, 'x');
    plot_linear(p->script, 'y');
    plot_axes(p->script, row == ENVELOPE ? "Time (s)" : label, row == ENVELOPE ? label : labels[row]);
    (void)fprintf(p->script, "set format y '%%.7g'\n");
    if (row == ENVELOPE)
        plot_si_logarithmic(p->script, 'y', from / 1.3, to * 1.3);
    else {
        plot_si_logarithmic(p->script, 'x', from / 1.3, to * 1.3);
        (void)fprintf(p->script, "set yrange [%.9g:%.9g]\n", low, high);
        plot_ticks(p->script, 'y', low, high);
    }
    title_panel(p, q->modes[mode].title, row);
    (void)fprintf(p->script, "unset key\nunset label 2\nunset label 3\n");
    place_panel(p, q->n_modes, mode, row);
    tell_of_model(p, q->modes[mode].before, q->modes[mode].n_before, row, low, high, 2);
    tell_of_model(p, q->modes[mode].after, q->modes[mode].n_after, row, low, high, 3);
    draw_curves(&q->modes[mode], p, row, mode);
}

enum bf_status plot_drift(const struct plot_drift *q, struct bf_error *err)
{
    struct picture p;
    if (q->n_modes < 1 || q->n_modes > PLOT_DRIFT_MODES)
        return bf_fail(err, BF_USAGE, "a picture of a decay has 1 to %d modes, not %zu", PLOT_DRIFT_MODES, q->n_modes);
    picture_begin(q->directory, q->stem, width_of(q->n_modes), 19.0, &p);
    for (size_t m = 0; m < q->n_modes; m++) {
        write_curves(q->modes[m].measured, q->modes[m].n_measured, &p, "measured", m);
        write_curves(q->modes[m].before, q->modes[m].n_before, &p, "before", m);
        write_curves(q->modes[m].after, q->modes[m].n_after, &p, "after", m);
    }
    plot_note(p.script, q->note);
    plot_sheet(p.script, "", q->title);
    for (enum row row = ENVELOPE; row < ROWS; row++)
        for (size_t m = 0; m < q->n_modes; m++)
            panel(q, &p, row, m);
    draw_legend(q, &p);
    (void)fprintf(p.script, "unset multiplot\n");
    return picture_end(&p, err);
}
