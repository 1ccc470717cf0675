/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_tracking.c — modes that a board follows: a row each, of frequency, damping and gain, with bands of two standard errors. */
#include "show.h"
#include "plot_gnuplot.h"

enum { QUANTITIES = 3 };

static void panel(const struct plot_tracking *q, const struct picture *p, size_t mode, int quantity)
{
    static const char *const labels[QUANTITIES] = {"frequency (Hz)", "damping (%)", "gain (of the model's)"};
    static const char *const colours[PLOT_TRACKED] = {PLOT_BLUE, PLOT_VERMILLION, PLOT_GREEN};
    const int value = 2 + (int)mode * 2 * QUANTITIES + 2 * quantity;
    const double high = 0.86 / (double)q->modes, bottom = 0.93 - high * (double)(mode + 1) + 0.07;
    char title[40] = "";
    if (quantity == 0)
        (void)snprintf(title, sizeof title, "mode %zu", mode + 1);
    (void)fprintf(
        p->script,
        "set lmargin at screen %.4f\nset rmargin at screen %.4f\nset bmargin at screen %.4f\n"
        "set tmargin at screen %.4f\nset xrange [%.9g:%.9g]\nset autoscale y\nset ytics autofreq\nunset key\n",
        0.09 + 0.32 * quantity, 0.09 + 0.32 * quantity + 0.235, bottom, bottom + high - 0.1, q->time_s[0],
        q->time_s[q->n - 1]);
    plot_panel_title(p->script, title);
    plot_axes(p->script, mode + 1 == q->modes ? "Time (s)" : "", labels[quantity]);
    (void)fprintf(p->script,
                  "unset key\nplot '%s-time.dat' using 1:($%d-2*$%d):($%d+2*$%d) with filledcurves linecolor rgb '%s' "
                  "fillstyle transparent solid 0.2 noborder notitle, '' using 1:%d with lines linewidth 1.4 linecolor "
                  "rgb '%s' notitle\n",
                  p->stem, value, value + 1, value, value + 1, colours[mode], value, colours[mode]);
}

enum bf_status plot_tracking(const struct plot_tracking *q, struct bf_error *err)
{
    struct picture p;
    if (q->n < 2 || q->modes < 1 || !(q->time_s[q->n - 1] > q->time_s[0]))
        return bf_fail(err, BF_NUMERIC, "a picture of followed modes needs two readings, and there is %zu", q->n);
    picture_begin(q->directory, q->stem, 18.0, 3.0 + 4.0 * (double)q->modes, &p);
    FILE *f = picture_data(&p, "time");
    (void)fprintf(f, "# time_s, of each mode frequency_Hz se damping_percent se gain se\n");
    for (size_t i = 0; i < q->n; i++) {
        (void)fprintf(f, "%.9g", q->time_s[i]);
        for (size_t k = 0; k < 2 * QUANTITIES * q->modes; k++)
            (void)fprintf(f, " %.7g", q->values[i * PLOT_TRACKED * 2 * QUANTITIES + k]);
        (void)fputc('\n', f);
    }
    picture_data_end(&p);
    plot_sheet(p.script, "", q->title);
    for (size_t m = 0; m < q->modes; m++)
        for (int quantity = 0; quantity < QUANTITIES; quantity++)
            panel(q, &p, m, quantity);
    (void)fprintf(p.script, "unset multiplot\n");
    return picture_end(&p, err);
}
