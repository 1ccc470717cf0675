/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_poles.c — measured poles with their standard errors beside those of the model, a place a mode: frequencies as differences, damping ratios as they are, shapes by the modal assurance criterion. */
#include "plot.h"
#include "plot_gnuplot.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Standard error of measured/model − 1 in per cent; 0: not known. */
static double frequency_error(const struct pole_pair *pair)
{
    return pair->measured.sd_Hz > 0.0 ? 100.0 * pair->measured.sd_Hz / pair->model_Hz : 0.0;
}

/* place, difference in %, its error, damping measured, its error, of the model. */
static void write_pairs(const struct pole_table *table, struct picture *p)
{
    FILE *f = picture_data(p, "poles");
    (void)fprintf(f, "# place frequency_difference_percent error damping_percent error model_damping_percent mac\n");
    for (size_t i = 0, place = 0; i < table->n; i++) {
        const struct pole_pair *pair = &table->pairs[i];
        if (pair->mode == 0)
            continue;
        (void)fprintf(f, "%zu %.6g %.6g %.6g %.6g %.6g %.6g\n", ++place, 100.0 * (pair->ratio - 1.0),
                      frequency_error(pair), 100.0 * pair->measured.damping_ratio, 100.0 * pair->measured.damping_sd,
                      100.0 * pair->model_damping, pair->mac);
    }
    picture_data_end(p);
}

static void place_axis(const struct pole_table *table, struct picture *p)
{
    size_t place = 0;
    (void)fprintf(p->script, "set xrange [0.4:%zu.6]\nset xtics (", table->n_pairs);
    for (size_t i = 0; i < table->n; i++)
        if (table->pairs[i].mode > 0)
            (void)fprintf(p->script, "%s\"mode %zu\\n%.4g Hz\" %zu", place > 0 ? ", " : "", table->pairs[i].mode,
                          table->pairs[i].measured.frequency_Hz, place + 1),
                place++;
    (void)fprintf(p->script, ")\n");
}

static bool knows_damping(const struct pole_table *table)
{
    for (size_t i = 0; i < table->n; i++)
        if (table->pairs[i].mode > 0 && isfinite(table->pairs[i].measured.damping_ratio))
            return true;
    return false;
}

static bool knows_shapes(const struct pole_table *table)
{
    for (size_t i = 0; i < table->n; i++)
        if (table->pairs[i].mode > 0 && isfinite(table->pairs[i].mac))
            return true;
    return false;
}

static void frequency_panel(const struct pole_table *table, bool alone, struct picture *p)
{
    double widest = 0.0;
    for (size_t i = 0; i < table->n; i++)
        if (table->pairs[i].mode > 0)
            widest =
                fmax(widest, fabs(100.0 * (table->pairs[i].ratio - 1.0)) + 2.0 * frequency_error(&table->pairs[i]));
    widest = widest > 0.0 ? 1.25 * widest : 1.0;
    plot_panel_title(p->script, alone ? "frequency, measured over model" : "(a) frequency, measured over model");
    plot_axes(p->script, "", "difference (%)");
    (void)fprintf(p->script, "set yrange [%.6g:%.6g]\n", -widest, widest);
    plot_ticks(p->script, 'y', -widest, widest);
    (void)fprintf(p->script,
                  "plot 0 with lines linewidth 1.4 dashtype 2 linecolor rgb '" PLOT_MODEL "' title 'model', "
                  "'%s-poles.dat' using 1:2:3 with yerrorbars pointtype 7 pointsize mark linewidth 1.2 linecolor rgb "
                  "'" PLOT_MEASURED "' title 'measured ± standard error'\n",
                  p->stem);
}

static void damping_panel(struct picture *p)
{
    plot_panel_title(p->script, "(b) damping ratio");
    plot_axes(p->script, "", "damping ratio (%)");
    (void)fprintf(
        p->script,
        "set yrange [0:*]\nset ytics autofreq\n"
        "plot '%s-poles.dat' using 1:6 with points pointtype 2 pointsize mark * 1.4 linewidth 1.6 linecolor rgb "
        "'" PLOT_MODEL "' title 'model', "
        "'' using 1:4:5 with yerrorbars pointtype 7 pointsize mark linewidth 1.2 linecolor rgb '" PLOT_MEASURED
        "' title 'measured ± standard error'\n",
        p->stem);
}

static void shape_panel(bool damping, struct picture *p)
{
    plot_panel_title(p->script,
                     damping ? "(c) shape, measured and of the model" : "(b) shape, measured and of the model");
    plot_axes(p->script, "", "MAC (1: alike)");
    (void)fprintf(p->script,
                  "set yrange [0:1.08]\nset ytics 0.25\n"
                  "plot 1 with lines linewidth 1.4 dashtype 2 linecolor rgb '" PLOT_MODEL "' notitle, "
                  "'%s-poles.dat' using 1:7 with impulses linewidth 1.2 linecolor rgb '" PLOT_MEASURED
                  "' notitle, '' using 1:7 with points pointtype 7 pointsize mark linecolor rgb '" PLOT_MEASURED
                  "' notitle\n",
                  p->stem);
}

void pole_table_stem(const char *file, char stem[PLOT_STEM])
{
    const char *dot = strrchr(file, '.');
    (void)snprintf(stem, PLOT_STEM, "%.*s-poles", (int)(dot != NULL ? dot - file : (long)strlen(file)), file);
}

enum bf_status pole_table_plot(const struct pole_table *table, const char *file, const char *directory,
                               struct bf_error *err)
{
    static const char *const sheets[] = {"layout 1,1 margins 0.13,0.985,0.17,0.8",
                                         "layout 2,1 margins 0.13,0.985,0.1,0.87 spacing 0.1,0.2",
                                         "layout 3,1 margins 0.13,0.985,0.07,0.91 spacing 0.1,0.13"};
    static const double heights_cm[] = {8.5, 14.0, 20.0};
    const bool damping = knows_damping(table), shapes = knows_shapes(table);
    char stem[PLOT_STEM];
    struct picture p;
    pole_table_stem(file, stem);
    picture_begin(directory, stem, 16.0, heights_cm[damping + shapes], &p);
    write_pairs(table, &p);
    plot_sheet(p.script, sheets[damping + shapes], "Poles, measured and of the model");
    plot_note(p.script, file);
    place_axis(table, &p);
    frequency_panel(table, !damping && !shapes, &p);
    if (damping)
        damping_panel(&p);
    if (shapes)
        shape_panel(damping, &p);
    (void)fprintf(p.script, "unset multiplot\n");
    return picture_end(&p, err);
}
