/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_bode.c — a frequency response, measured and of the model: coherence, magnitude, phase. */
#include "plot.h"
#include "plot_gnuplot.h"

#include <math.h>

static double degrees(double complex H)
{
    return carg(H) * 180.0 / acos(-1.0);
}

/* frequency, magnitude, phase; an empty line where the phase goes round, so that no line is drawn across. */
static void write_curve(const struct plot_bode *q, struct picture *p, const char *name, const double complex H[])
{
    FILE *f = picture_data(p, name);
    (void)fprintf(f, "# frequency_Hz magnitude phase_deg\n");
    for (size_t k = 0; k < q->n; k++) {
        if (k > 0 && fabs(degrees(H[k]) - degrees(H[k - 1])) > 180.0)
            (void)fprintf(f, "\n");
        (void)fprintf(f, "%.9g %.6g %.6g\n", q->frequency_Hz[k], cabs(H[k]), degrees(H[k]));
    }
    picture_data_end(p);
}

/* frequency, standard error of the magnitude, coherence. */
static void write_noise(const struct plot_bode *q, struct picture *p)
{
    FILE *f = picture_data(p, "noise");
    (void)fprintf(f, "# frequency_Hz standard_error coherence\n");
    for (size_t k = 0; k < q->n; k++)
        (void)fprintf(f, "%.9g %.6g %.6g\n", q->frequency_Hz[k], q->noise[k], q->coherence[k]);
    picture_data_end(p);
}

static void coherence_panel(struct picture *p)
{
    plot_panel_title(p->script, "(a) coherence");
    plot_axes(p->script, "", "γ²");
    (void)fprintf(p->script,
                  "set yrange [0:1.05]\nset ytics 0.5\n"
                  "plot '%s-noise.dat' using 1:3 with lines linewidth 1 linecolor rgb '" PLOT_GREEN
                  "' notitle\nset ytics autofreq\n",
                  p->stem);
}

/* Room for both curves; noise far below them is cut. */
static void magnitude_axis(const struct plot_bode *q, struct picture *p)
{
    double low = HUGE_VAL, high = 0.0;
    for (size_t k = 0; k < q->n; k++) {
        const double a = cabs(q->measured[k]), b = cabs(q->model[k]);
        low = fmin(low, fmin(a > 0.0 ? a : low, b > 0.0 ? b : low));
        high = fmax(high, fmax(a, b));
    }
    if (high > 0.0)
        plot_si_logarithmic(p->script, 'y', fmax(low, 1e-9 * high) / 1.4, 1.4 * high);
}

static void magnitude_panel(const struct plot_bode *q, struct picture *p)
{
    char label[160];
    plot_quantity(q->quantity, q->per, label, sizeof label);
    plot_panel_title(p->script, q->noise != NULL ? "(b) magnitude" : q->without_phase ? "magnitude" : "(a) magnitude");
    plot_axes(p->script, q->without_phase ? "Frequency (Hz)" : "", label);
    magnitude_axis(q, p);
    (void)fprintf(
        p->script,
        "plot '%s-measured.dat' using 1:2 with lines linewidth 1.2 linecolor rgb '" PLOT_MEASURED "' title 'measured', "
        "'%s-model.dat' using 1:2 with lines linewidth 1.4 dashtype 2 linecolor rgb '" PLOT_MODEL "' title 'model'",
        p->stem, p->stem);
    if (q->noise != NULL)
        (void)fprintf(p->script,
                      ", '%s-noise.dat' using 1:2 with lines linewidth 1 linecolor rgb '" PLOT_NOISE "' title 'noise'",
                      p->stem);
    (void)fputc('\n', p->script);
    plot_linear(p->script, 'y');
}

static void phase_panel(const struct plot_bode *q, struct picture *p)
{
    plot_panel_title(p->script, q->noise != NULL ? "(c) phase" : "(b) phase");
    plot_axes(p->script, "Frequency (Hz)", "Phase (deg)");
    (void)fprintf(
        p->script,
        "set yrange [-190:190]\nset ytics 90\n"
        "plot '%s-measured.dat' using 1:3 with lines linewidth 1.2 linecolor rgb '" PLOT_MEASURED "' notitle, "
        "'%s-model.dat' using 1:3 with lines linewidth 1.4 dashtype 2 linecolor rgb '" PLOT_MODEL "' notitle\n",
        p->stem, p->stem);
}

enum bf_status plot_bode(const struct plot_bode *q, struct bf_error *err)
{
    struct picture p;
    if (q->n < 4)
        return bf_fail(err, BF_NUMERIC, "a picture needs at least 4 lines; %s has %zu", q->quantity, q->n);
    picture_begin(q->directory, q->stem, 16.0, 10.0 + (q->noise != NULL ? 3.0 : 0.0) + (q->without_phase ? 0.0 : 3.0),
                  &p);
    write_curve(q, &p, "measured", q->measured);
    write_curve(q, &p, "model", q->model);
    if (q->noise != NULL)
        write_noise(q, &p);
    const int panels = 1 + (q->noise != NULL) + !q->without_phase;
    plot_sheet(p.script,
               panels == 3   ? "layout 3,1 margins 0.11,0.985,0.085,0.885 spacing 0.1,0.115"
               : panels == 2 ? "layout 2,1 margins 0.11,0.985,0.1,0.865 spacing 0.1,0.15"
                             : "layout 1,1 margins 0.11,0.985,0.13,0.82",
               q->title);
    plot_note(p.script, q->note);
    (void)fprintf(p.script, "set xrange [%.9g:%.9g]\n", q->frequency_Hz[0], q->frequency_Hz[q->n - 1]);
    if (q->noise != NULL)
        coherence_panel(&p);
    magnitude_panel(q, &p);
    if (!q->without_phase)
        phase_panel(q, &p);
    (void)fprintf(p.script, "unset multiplot\n");
    return picture_end(&p, err);
}
