/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_drift.c — frequency and damping of a mode against its amplitude, measured and modelled. */
#include "show.h"
#include "plot.h"
#include "plot_gnuplot.h"

#include <math.h>

enum column { FREQUENCY, DAMPING };

static double value_of(const struct plot_drift_curve *c, enum column column, size_t k)
{
    return column == FREQUENCY ? c->frequency_Hz[k] : 100.0 * c->damping[k];
}

static double error_of(const struct plot_drift_curve *c, enum column column, size_t k)
{
    if (c->frequency_sd_Hz == NULL || c->damping_sd == NULL)
        return 0.0;
    return column == FREQUENCY ? c->frequency_sd_Hz[k] : 100.0 * c->damping_sd[k];
}

static void write_curves(const struct plot_drift_curve *curves, size_t n, struct picture *p, const char *name)
{
    FILE *f = picture_data(p, name);
    (void)fprintf(f, "# amplitude frequency_Hz damping_percent and their standard errors\n");
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < curves[i].n; k++) {
            const double f_Hz = value_of(&curves[i], FREQUENCY, k), zeta = value_of(&curves[i], DAMPING, k);
            if (isfinite(f_Hz) && isfinite(zeta) && curves[i].amplitude[k] > 0.0)
                (void)fprintf(f, "%.6g %.9g %.6g %.3g %.3g\n", curves[i].amplitude[k], f_Hz, zeta,
                              error_of(&curves[i], FREQUENCY, k), error_of(&curves[i], DAMPING, k));
        }
        (void)fprintf(f, "nan nan nan nan nan\n\n");
    }
    if (n == 0)
        (void)fprintf(f, "nan nan nan nan nan\n");
    picture_data_end(p);
}

/* Range of what is measured with its errors, and of the models as far as they stay within twice that. */
static void find_range(const struct plot_drift *q, enum column column, double *low, double *high)
{
    const struct plot_drift_curve *models[2] = {q->before, q->after};
    const size_t n_models[2] = {q->n_before, q->n_after};
    *low = HUGE_VAL, *high = -HUGE_VAL;
    for (size_t i = 0; i < q->n_measured; i++)
        for (size_t k = 0; k < q->measured[i].n; k++) {
            *low = fmin(*low, value_of(&q->measured[i], column, k) - error_of(&q->measured[i], column, k));
            *high = fmax(*high, value_of(&q->measured[i], column, k) + error_of(&q->measured[i], column, k));
        }
    const double size = *high - *low, least = *low - size, most = *high + size;
    for (int m = 0; m < 2; m++)
        for (size_t i = 0; i < n_models[m]; i++)
            for (size_t k = 0; k < models[m][i].n; k++) {
                const double y = value_of(&models[m][i], column, k);
                if (y >= least && y <= most) {
                    *low = fmin(*low, y);
                    *high = fmax(*high, y);
                }
            }
    const double least_room = column == FREQUENCY ? 1e-4 * fabs(*high) : 0.02 * fabs(*high);
    const double room = fmax(0.08 * (*high - *low), least_room);
    *low -= room;
    *high += room;
}

static void panel(const struct plot_drift *q, struct picture *p, enum column column)
{
    char label[160];
    double low, high, left = HUGE_VAL, right = 0.0;
    const int y = column == FREQUENCY ? 2 : 3, sd = column == FREQUENCY ? 4 : 5;
    find_range(q, column, &low, &high);
    for (size_t i = 0; i < q->n_measured; i++)
        for (size_t k = 0; k < q->measured[i].n; k++) {
            left = fmin(left, q->measured[i].amplitude[k]);
            right = fmax(right, q->measured[i].amplitude[k]);
        }
    plot_quantity(q->quantity, "", label, sizeof label);
    char x_label[200];
    (void)snprintf(x_label, sizeof x_label, "Amplitude of the mode in %s", label);
    plot_axes(p->script, x_label, column == FREQUENCY ? "Frequency (Hz)" : "Damping ratio (%)");
    (void)fprintf(p->script,
                  "set label 1 '%s' at graph 0, graph 1.06 left\nset key at graph 1, graph 1.02 right bottom "
                  "horizontal maxrows 1 width -1 samplen 4\n"
                  "set format y '%%.7g'\nset yrange [%.9g:%.9g]\n",
                  column == FREQUENCY ? "(a) frequency" : "(b) damping", low, high);
    if (right > 0.0)
        plot_si_logarithmic(p->script, 'x', left / 1.5, right * 1.5);
    (void)fprintf(p->script,
                  "plot '%s-before.dat' using 1:%d with lines dashtype 2 linewidth 2 linecolor rgb '" PLOT_MODEL_BEFORE
                  "' title 'model before'",
                  p->stem, y);
    if (q->n_after > 0)
        (void)fprintf(p->script,
                      ", '%s-after.dat' using 1:%d with lines linewidth 2 linecolor rgb '" PLOT_MODEL
                      "' title 'model after'",
                      p->stem, y);
    (void)fprintf(p->script,
                  ", '%s-measured.dat' using 1:%d:%d with yerrorbars pointtype 7 pointsize 0.8*mark linewidth 0.8 "
                  "linecolor rgb '" PLOT_MEASURED "' title 'measured'\n",
                  p->stem, y, sd);
}

enum bf_status plot_drift(const struct plot_drift *q, struct bf_error *err)
{
    struct picture p;
    picture_begin(q->directory, q->stem, 17.0, 15.0, &p);
    write_curves(q->measured, q->n_measured, &p, "measured");
    write_curves(q->before, q->n_before, &p, "before");
    write_curves(q->after, q->n_after, &p, "after");
    plot_sheet(p.script,
               "layout 2,1 margins screen 0.11, screen 0.97, screen 0.08, screen 0.9 spacing screen 0, screen 0.17",
               q->title);
    panel(q, &p, FREQUENCY);
    panel(q, &p, DAMPING);
    (void)fprintf(p.script, "unset multiplot\n");
    return picture_end(&p, err);
}
