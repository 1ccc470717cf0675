/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_lines.c — error against model version, and lines over logarithmic axes. */
#include "show.h"
#include "plot.h"
#include "plot_gnuplot.h"
#include "ground/ground.h"

#include <math.h>

static bool drawable(double x)
{
    return isfinite(x) && x > 0.0;
}

static void write_history(const struct plot_history *q, struct picture *p, double *least, double *largest)
{
    FILE *f = picture_data(p, "errors");
    *least = HUGE_VAL;
    *largest = 0.0;
    (void)fprintf(f, "# version fitted_percent held_out_percent (nan: none)\n");
    for (size_t i = 0; i < q->n; i++) {
        const double e[2] = {q->fitted[i], q->held_out[i]};
        (void)fprintf(f, "%zu", i + 1);
        for (int j = 0; j < 2; j++) {
            (void)fprintf(f, drawable(e[j]) ? " %.6g" : " nan", 100.0 * e[j]);
            if (drawable(e[j])) {
                *least = fmin(*least, 100.0 * e[j]);
                *largest = fmax(*largest, 100.0 * e[j]);
            }
        }
        (void)fputc('\n', f);
    }
    picture_data_end(p);
}

/* Labels under the axis; slanted, with room for the longest, when they would run into each other. */
static void history_ticks(const struct plot_history *q, struct picture *p)
{
    enum { LONGEST = 20 }; /* characters; of more the end is shown, where versions differ */
    size_t longest = 0;
    (void)fprintf(p->script, "set xtics noenhanced (");
    for (size_t i = 0; i < q->n; i++) {
        const size_t length = text_width(q->label[i]);
        const char *shown = q->label[i];
        for (size_t cut = length > LONGEST ? length - LONGEST : 0; cut > 0; cut--)
            do
                shown++;
            while (((unsigned char)*shown & 0xc0) == 0x80); /* whole characters of UTF-8 */
        const size_t kept = length > LONGEST ? LONGEST : length;
        longest = kept > longest ? kept : longest;
        char text[8 + 4 * LONGEST];
        (void)snprintf(text, sizeof text, "%s%s", length > LONGEST ? "…" : "", shown);
        plot_quote(p->script, text);
        (void)fprintf(p->script, " %zu%s", i + 1, i + 1 < q->n ? ", " : ")\n");
    }
    if (longest * q->n > 60)
        (void)fprintf(p->script,
                      "set xtics rotate by 30 right\nset xlabel ''\nset bmargin %.1f\nset lmargin 13\nset rmargin 3\n",
                      1.5 + 0.3 * (double)longest);
}

enum bf_status plot_history(const struct plot_history *q, struct bf_error *err)
{
    struct picture p;
    double least, largest;
    if (q->n == 0)
        return bf_fail(err, BF_USAGE, "a history needs at least one model");
    picture_begin(q->directory, q->stem, 14.0, 9.0, &p);
    write_history(q, &p, &least, &largest);
    const double floors[2] = {q->noise_floor, q->held_out_floor};
    const bool two = drawable(floors[0]) && drawable(floors[1]) && fabs(floors[1] / floors[0] - 1.0) > 0.02;
    for (int j = 0; j < 2; j++)
        if (drawable(floors[j])) {
            least = fmin(least, 100.0 * floors[j]);
            largest = fmax(largest, 100.0 * floors[j]);
        }
    if (largest <= 0.0) {
        least = 0.1;
        largest = 100.0;
    }
    if (q->title != NULL) {
        (void)fprintf(p.script, "set title ");
        plot_quote(p.script, q->title);
        (void)fprintf(p.script, " noenhanced offset 0,%d\n", two ? 2 : 1); /* above the key */
    }
    plot_axes(p.script, "Model", "error of the prediction (%)");
    history_ticks(q, &p);
    (void)fprintf(
        p.script,
        "set key at graph 1, graph 1 right bottom horizontal width -1 maxcols %d\nset logscale y\nset xrange "
        "[0.5:%zu.5]\nset yrange "
        "[%.6g:%.6g]\n"
        "plot '%s-errors.dat' using 1:2 with linespoints pointtype 7 pointsize mark linewidth 1.6 linecolor rgb "
        "'" PLOT_FITTED "' title 'fitted records', '' using 1:3 with linespoints pointtype 5 pointsize mark linewidth "
        "1.6 dashtype 2 linecolor rgb '" PLOT_HELD_OUT "' title 'held out'",
        two ? 2 : 3, q->n, 0.6 * least, 1.6 * largest, p.stem);
    for (int j = 0; j < 2; j++)
        if (drawable(floors[j]) && (two || j == 0 || !drawable(floors[0])))
            (void)fprintf(p.script, ", %.6g with lines linewidth 1.4 dashtype %d linecolor rgb '%s' title '%s'",
                          100.0 * floors[j], j + 1,
                          !two     ? PLOT_NOISE
                          : j == 0 ? PLOT_FITTED
                                   : PLOT_HELD_OUT,
                          !two     ? "noise"
                          : j == 0 ? "noise, fitted"
                                   : "noise, held out");
    (void)fprintf(p.script, "\n");
    return picture_end(&p, err);
}

/* Room round [low, high]: 5 % of a linear axis, a twentieth of the decades of a logarithmic one. */
static void print_range(FILE *script, char axis, double low, double high, bool linear)
{
    if (linear) {
        const double room = high > low ? 0.05 * (high - low) : fmax(0.5, 0.05 * fabs(high));
        (void)fprintf(script, "set %crange [%.9g:%.9g]\n", axis, low - room, high + room);
    } else {
        const double room = high > 1.01 * low ? pow(high / low, 0.05) : 1.5;
        (void)fprintf(script, "set logscale %c\nset %crange [%.9g:%.9g]\n", axis, axis, low / room, high * room);
    }
}

/* Few abscissae, as grid sizes are: each gets its tick. */
static void own_ticks(const struct plot_convergence *q, FILE *script)
{
    const struct plot_line *line = &q->lines[0];
    if (q->linear_x || line->n > 9 || line->n < 2)
        return;
    (void)fprintf(script, "set xtics (");
    for (size_t k = 0; k < line->n; k++)
        (void)fprintf(script, "'%.6g' %.9g%s", line->x[k], line->x[k], k + 1 < line->n ? ", " : ")\n");
}

/* Index 0 of the data file is the first line, and so on. Returns the number of points; range: of x, then y. */
static size_t write_lines(const struct plot_convergence *q, struct picture *p, double range[4])
{
    size_t points = 0;
    range[0] = range[2] = HUGE_VAL;
    range[1] = range[3] = -HUGE_VAL;
    FILE *f = picture_data(p, "lines");
    for (size_t i = 0; i < q->n_lines; i++) {
        const struct plot_line *line = &q->lines[i];
        size_t written = 0;
        (void)fprintf(f, "# %zu\n", i);
        for (size_t k = 0; k < line->n; k++) {
            if (!isfinite(line->x[k]) || !isfinite(line->y[k]) || (!q->linear_x && line->x[k] <= 0.0) ||
                (!q->linear_y && line->y[k] <= 0.0))
                continue;
            (void)fprintf(f, "%.9g %.9g\n", line->x[k], line->y[k]);
            range[0] = fmin(range[0], line->x[k]);
            range[1] = fmax(range[1], line->x[k]);
            range[2] = fmin(range[2], line->y[k]);
            range[3] = fmax(range[3], line->y[k]);
            written++;
        }
        if (written == 0)
            (void)fprintf(f, "nan nan\n");
        points += written;
        (void)fprintf(f, "\n\n");
    }
    picture_data_end(p);
    return points;
}

enum bf_status plot_convergence(const struct plot_convergence *q, struct bf_error *err)
{
    static const char *const colours[] = {PLOT_BLUE, PLOT_VERMILLION, PLOT_GREEN, PLOT_PURPLE, PLOT_ORANGE, "black"};
    static const int points[] = {7, 5, 9, 13, 11, 6}, dashes[] = {1, 2, 4, 5, 3, 1};
    enum { STYLES = sizeof colours / sizeof *colours, FEW = 16 }; /* points that are worth a mark each */
    struct picture p;
    picture_begin(q->directory, q->stem, 19.0, 10.0, &p);
    double range[4];
    const bool any = write_lines(q, &p, range) > 0;
    if (!any && p.error.status == BF_OK)
        (void)bf_fail(&p.error, BF_NUMERIC, "%s: there is no point to draw", p.stem);
    if (q->title != NULL) {
        (void)fprintf(p.script, "set title ");
        plot_quote(p.script, q->title);
        (void)fprintf(p.script, " noenhanced\n");
    }
    plot_axes(p.script, q->x_label, q->y_label);
    if (any) {
        print_range(p.script, 'x', range[0], range[1], q->linear_x);
        print_range(p.script, 'y', range[2], range[3], q->linear_y);
        own_ticks(q, p.script);
    }
    (void)fprintf(p.script, "%sset key outside right center vertical width 1\nplot ",
                  q->linear_y ? "" : "set format y '10^{%T}'\n");
    for (size_t i = 0; i < q->n_lines; i++) {
        char marks[80] = "lines";
        if (q->lines[i].n <= FEW)
            (void)snprintf(marks, sizeof marks, "linespoints pointtype %d pointsize mark dashtype %d",
                           points[i % STYLES], dashes[i % STYLES]);
        (void)fprintf(p.script, "%s'%s-lines.dat' index %zu using 1:2 with %s linewidth 1.5 linecolor rgb '%s' title ",
                      i > 0 ? ", " : "", p.stem, i, marks, colours[i % STYLES]);
        plot_quote(p.script, q->lines[i].legend);
    }
    (void)fprintf(p.script, "\n");
    return picture_end(&p, err);
}
