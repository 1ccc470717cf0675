/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_stabilisation.c — poles of free linear models over the number of modes, with the mean spectrum behind. */
#include "plot.h"
#include "plot_gnuplot.h"

#include <math.h>
#include <stdio.h>

static const double lowest_dB = -100.0; /* of the spectrum, below its largest line: nothing is drawn there */

static const double least_room = 0.02; /* of the width, between two numbers */

enum kind { STABLE, FREQUENCY_ONLY, NEW, KINDS };
static const char *const kind_names[KINDS] = {"stable", "frequency", "new"};

static enum kind kind_of(const struct stabilisation_pole *pole)
{
    return pole->stable ? STABLE : pole->frequency_stable ? FREQUENCY_ONLY : NEW;
}

/* Each file begins with a point outside the picture: gnuplot warns of files without any. */
static void write_poles(const struct stabilisation *s, struct picture *p, enum kind kind)
{
    FILE *f = picture_data(p, kind_names[kind]);
    (void)fprintf(f, "# frequency_Hz modes damping_percent\n-1 -1 0\n");
    for (size_t k = 0; k < s->n_poles; k++)
        if (kind_of(&s->poles[k]) == kind)
            (void)fprintf(f, "%.9g %zu %.6g\n", s->poles[k].frequency_Hz, s->poles[k].modes,
                          100.0 * s->poles[k].damping_ratio);
    picture_data_end(p);
}

/* Returns the lowest level that is worth showing. */
static double write_spectrum(const struct stabilisation *s, struct picture *p)
{
    FILE *f = picture_data(p, "spectrum");
    double low_dB = 0.0;
    (void)fprintf(f, "# frequency_Hz level_dB\n-1 0\n");
    for (size_t i = 0; i < s->n_lines; i++) {
        const double dB = fmax(lowest_dB, 20.0 * log10(fmax(s->magnitude[i], 1e-300)));
        low_dB = fmin(low_dB, dB);
        (void)fprintf(f, "%.9g %.5g\n", s->line_Hz[i], dB);
    }
    picture_data_end(p);
    return low_dB;
}

static void write_modes(const struct plot_stabilisation *q, struct picture *p)
{
    FILE *f = picture_data(p, "model");
    (void)fprintf(f, "# frequency_Hz modes\n-1 -1\n\n");
    for (size_t k = 0; k < q->n_modes; k++)
        if (q->mode_Hz[k] <= q->found->to_Hz)
            (void)fprintf(f, "%.9g 0\n%.9g %zu\n\n", q->mode_Hz[k], q->mode_Hz[k], q->found->modes + 1);
    picture_data_end(p);
}

/* Numbers of the model's modes above their lines, as far as there is room. */
static void number_modes(const struct plot_stabilisation *q, struct picture *p)
{
    double last_Hz = -HUGE_VAL;
    for (size_t k = 0; k < q->n_modes && q->mode_Hz[k] <= q->found->to_Hz; k++) {
        if (q->mode_Hz[k] - last_Hz < least_room * q->found->to_Hz)
            continue;
        last_Hz = q->mode_Hz[k];
        (void)fprintf(p->script, "set label '%zu' at first %.9g, graph 1.025 center textcolor rgb '" PLOT_MODEL "'\n",
                      k + 1, last_Hz);
    }
}

static void axes(const struct plot_stabilisation *q, struct picture *p, double low_dB)
{
    plot_axes(p->script, "Frequency (Hz)", "Modes of the free linear model");
    (void)fprintf(p->script,
                  "set border 11 linewidth 0.8\nset xrange [0:%.6g]\nset yrange [0:%zu]\nset ytics 4\n"
                  "set y2tics 20 nomirror\nset y2range [%.6g:5]\n"
                  "set y2label 'Mean response spectrum (dB of its largest)' offset 0.5,0 textcolor rgb '" PLOT_GREY
                  "'\nset lmargin at screen 0.085\nset rmargin at screen 0.905\nset tmargin at screen 0.845\n"
                  "set bmargin at screen 0.115\n"
                  "set key at screen 0.495, screen 0.928 center top horizontal maxrows 1 samplen 1.6 width -1\n",
                  q->found->to_Hz, q->found->modes + 1, 10.0 * floor(low_dB / 10.0));
    (void)fputs("set title ", p->script);
    plot_quote(p->script, q->title);
    (void)fputs(" noenhanced offset 0,2.9\n", p->script);
}

enum bf_status plot_stabilisation(const struct plot_stabilisation *q, struct bf_error *err)
{
    struct picture p;
    picture_begin(q->directory, q->stem, 20.0, 13.0, &p);
    for (enum kind kind = STABLE; kind < KINDS; kind++)
        write_poles(q->found, &p, kind);
    const double low_dB = write_spectrum(q->found, &p);
    write_modes(q, &p);
    axes(q, &p, low_dB);
    number_modes(q, &p);
    (void)fprintf(p.script,
                  "plot '%s-spectrum.dat' using 1:2 axes x1y2 with lines linewidth 0.8 linecolor rgb '" PLOT_GREY
                  "' title 'spectrum', '%s-model.dat' using 1:2 with lines linewidth 1 dashtype 2 linecolor rgb "
                  "'" PLOT_MODEL "' title 'model', '%s-new.dat' using 1:2 with points pointtype 2 pointsize "
                  "0.8*mark linewidth 0.8 linecolor rgb '" PLOT_GREY
                  "' title 'new pole', '%s-frequency.dat' using 1:2 with "
                  "points pointtype 6 pointsize 1.2*mark linewidth 0.8 linecolor rgb '" PLOT_MEASURED
                  "' title 'frequency only', '%s-stable.dat' using 1:2 with points pointtype 7 pointsize "
                  "1.2*mark linecolor rgb '" PLOT_MEASURED "' title 'stable'\n",
                  p.stem, p.stem, p.stem, p.stem, p.stem);
    return picture_end(&p, err);
}
