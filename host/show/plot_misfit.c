/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_misfit.c — what models leave, in units of the noise: by band and amplitude, and explanation by explanation. */
#include "show.h"
#include "plot.h"
#include "plot_gnuplot.h"
#include "ground/ground.h"

#include <math.h>
#include <string.h>

static const char *const state_name[PLOT_STATES] = {"before, fitted", "before, held out", "after, fitted",
                                                    "after, held out"};
static const char *const state_colour[PLOT_STATES] = {PLOT_MODEL_BEFORE, "#E9CBDC", PLOT_MODEL, "#F2B78E"};

#define KEY_ABOVE "set key at graph 1, graph 1.02 right bottom horizontal maxrows 2 width -2\n"

static bool drawable(double x)
{
    return isfinite(x) && x > 0.0;
}

struct span {
    double low, high;
};

static void widen(struct span *span, double x)
{
    if (drawable(x)) {
        span->low = fmin(span->low, x);
        span->high = fmax(span->high, x);
    }
}

/* A logarithmic axis: ticks 1, 2, 5 for less than two and a half decades, powers of ten for more. */
static void log_axis(FILE *script, char axis, struct span range)
{
    (void)fprintf(script, "set logscale %c\nset %crange [%.6g:%.6g]\n", axis, axis, range.low, range.high);
    if (log10(range.high / range.low) > 4.0) {
        (void)fprintf(script, "set %ctics autofreq\nset format %c '10^{%%T}'\n", axis, axis);
        return;
    }
    const bool fine = log10(range.high / range.low) < 2.5;
    const int first = (int)floor(log10(range.low)), last = (int)ceil(log10(range.high));
    (void)fprintf(script, "set format %c '%%h'\nset %ctics (", axis, axis);
    for (int k = first; k <= last; k++)
        for (int step = 0; step < (fine ? 3 : 1); step++) {
            const double x = pow(10.0, k) * (step == 0 ? 1.0 : step == 1 ? 2.0 : 5.0);
            (void)fprintf(script, "%s'%.6g' %.6g", k > first || step > 0 ? ", " : "", x, x);
        }
    (void)fprintf(script, ")\n");
}

static void put_number(FILE *f, double x)
{
    (void)fprintf(f, drawable(x) ? " %.6g" : " nan", x);
}

static void write_states(FILE *f, const double *const state[PLOT_STATES], size_t k, struct span *range)
{
    for (int s = 0; s < PLOT_STATES; s++) {
        put_number(f, state[s][k]);
        widen(range, state[s][k]);
    }
    (void)fputc('\n', f);
}

static bool has(const double *values, size_t n)
{
    for (size_t k = 0; k < n; k++)
        if (drawable(values[k]))
            return true;
    return false;
}

static void band_ticks(const struct plot_misfit *q, FILE *script)
{
    enum { MOST = 12 };
    const size_t every = (q->n_bands + MOST - 1) / MOST;
    (void)fprintf(script, "set xtics scale 0 (");
    for (size_t b = 0; b < q->n_bands; b += every) {
        (void)fprintf(script, b > 0 ? ", \"" : "\"");
        (void)fprintf(script, q->bands_are_modes ? "%zu\\n%.3g Hz\" %zu" : "%zu\\nto %.3g Hz\" %zu", b + 1,
                      q->band_Hz[b], b + 1);
    }
    (void)fprintf(script, ")\n");
}

static void band_panel(const struct plot_misfit *q, struct picture *p, struct span range)
{
    int shown = 0, position = 0;
    for (int s = 0; s < PLOT_STATES; s++)
        shown += has(q->band[s], q->n_bands);
    plot_axes(p->script, q->bands_are_modes ? "Band of mode" : "Band", "misfit / noise");
    log_axis(p->script, 'y', range);
    band_ticks(q, p->script);
    const double width = 0.8 / fmax(1.0, shown);
    (void)fprintf(p->script,
                  "set label 1 '(a) by frequency' at graph 0, graph 1.06 left\nset xlabel offset 0,-0.6\n" KEY_ABOVE
                  "set xrange [0.4:%zu.6]\nset boxwidth %.4f\nplot ",
                  q->n_bands, 0.92 * width);
    for (int s = 0; s < PLOT_STATES; s++)
        if (has(q->band[s], q->n_bands)) {
            (void)fprintf(p->script, "'%s-bands.dat' using ($1%+.4f):%d with boxes linecolor rgb '%s' title '%s', ",
                          p->stem, (position + 0.5) * width - 0.4, s + 3, state_colour[s], state_name[s]);
            position++;
        }
    (void)fprintf(p->script, "1 with lines linewidth 1.4 linecolor rgb '" PLOT_NOISE "' title 'noise'\n");
}

static void level_panel(const struct plot_misfit *q, struct picture *p, struct span range)
{
    static const int point[PLOT_STATES] = {7, 6, 5, 4}, dash[PLOT_STATES] = {1, 2, 1, 2};
    struct span levels = {HUGE_VAL, 0.0};
    for (size_t k = 0; k < q->n_levels; k++)
        for (int s = 0; s < PLOT_STATES; s++)
            if (drawable(q->at_level[s][k]))
                widen(&levels, 100.0 * q->level[k]);
    if (!(levels.high > 0.0))
        levels = (struct span){10.0, 100.0};
    (void)fprintf(p->script, "set xtics scale 0.6\n");
    plot_axes(p->script, "Amplitude of the motion (% of the channel's largest)", "misfit / noise");
    log_axis(p->script, 'x', (struct span){levels.low / 1.3, fmax(levels.high, 100.0) * 1.1});
    log_axis(p->script, 'y', range);
    (void)fprintf(p->script, "set label 1 '(b) by amplitude' at graph 0, graph 1.06 left\n" KEY_ABOVE "plot ");
    for (int s = 0; s < PLOT_STATES; s++)
        if (has(q->at_level[s], q->n_levels))
            (void)fprintf(p->script,
                          "'%s-levels.dat' using (100*$1):%d with linespoints pointtype %d pointsize mark dashtype %d "
                          "linewidth 1.6 linecolor rgb '%s' title '%s', ",
                          p->stem, s + 2, point[s], dash[s], s < PLOT_AFTER ? PLOT_MODEL_BEFORE : PLOT_MODEL,
                          state_name[s]);
    (void)fprintf(p->script, "1 with lines linewidth 1.4 linecolor rgb '" PLOT_NOISE "' title 'noise'\n");
}

enum bf_status plot_misfit(const struct plot_misfit *q, struct bf_error *err)
{
    struct picture p;
    struct span range = {1.0, 1.0};
    picture_begin(q->directory, q->stem, 17.0, 15.0, &p);
    FILE *f = picture_data(&p, "bands");
    (void)fprintf(f, "# band frequency_Hz before before_held_out after after_held_out (times the noise; nan: none)\n");
    for (size_t b = 0; b < q->n_bands; b++) {
        (void)fprintf(f, "%zu %.6g", b + 1, q->band_Hz[b]);
        write_states(f, q->band, b, &range);
    }
    picture_data_end(&p);
    f = picture_data(&p, "levels");
    (void)fprintf(f, "# amplitude before before_held_out after after_held_out (times the noise; nan: none)\n");
    for (size_t k = 0; k < q->n_levels; k++) {
        (void)fprintf(f, "%.6g", q->level[k]);
        write_states(f, q->at_level, k, &range);
    }
    picture_data_end(&p);
    const double room = pow(range.high / range.low, 0.08);
    range = (struct span){fmin(range.low / room, 0.7), fmax(range.high * room, 2.0)};
    plot_sheet(p.script,
               "layout 2,1 margins screen 0.09, screen 0.97, screen 0.08, screen 0.88 spacing screen 0, screen 0.19",
               q->title);
    band_panel(q, &p, range);
    level_panel(q, &p, range);
    (void)fprintf(p.script, "unset multiplot\n");
    return picture_end(&p, err);
}

/* ---- Ranking ---- */

static void rank_names(const struct plot_ranking *q, FILE *script)
{
    size_t longest = 0;
    bool gains = false;
    (void)fprintf(script, "set ytics scale 0 noenhanced (");
    for (size_t i = 0; i < q->n; i++) {
        plot_quote(script, q->rows[i].name);
        (void)fprintf(script, " %zu%s", i + 1, i + 1 < q->n ? ", " : ")\n");
        longest = text_width(q->rows[i].name) > longest ? text_width(q->rows[i].name) : longest;
        gains = gains || isfinite(q->rows[i].gain);
    }
    (void)fprintf(script, "set lmargin %.1f\n", 3.0 + 0.88 * (double)longest);
    if (!gains)
        return;
    (void)fprintf(script, "set rmargin 12\nset label 'evidence' at graph 1.02, graph 1.0 offset 0,1.3 left\n"
                          "set label '(BIC gain)' at graph 1.02, graph 1.0 offset 0,0.4 left\n");
    for (size_t i = 0; i < q->n; i++)
        if (isfinite(q->rows[i].gain))
            (void)fprintf(script, "set label '%+.3g' at graph 1.02, first %zu left\n", q->rows[i].gain, i + 1);
}

static struct span write_ranking(const struct plot_ranking *q, struct picture *p)
{
    struct span range = {1.0, 1.0};
    FILE *f = picture_data(p, "rows");
    (void)fprintf(f, "# row fitted held_out (times the noise; nan: none) bic_gain name\n");
    for (size_t i = 0; i < q->n; i++) {
        const struct plot_rank *row = &q->rows[i];
        (void)fprintf(f, "%zu", i + 1);
        put_number(f, row->fitted);
        put_number(f, row->held_out);
        (void)fprintf(f, isfinite(row->gain) ? " %.4g " : " nan ", row->gain);
        (void)fprintf(f, "%s\n", row->name);
        widen(&range, row->fitted);
        widen(&range, row->held_out);
    }
    picture_data_end(p);
    const double room = pow(range.high / range.low, 0.06);
    return (struct span){fmin(range.low / room, 0.8), fmax(range.high * room, 2.0)};
}

enum bf_status plot_ranking(const struct plot_ranking *q, struct bf_error *err)
{
    struct picture p;
    bool held_out = false;
    if (q->n == 0)
        return bf_fail(err, BF_USAGE, "a ranking needs at least one row");
    picture_begin(q->directory, q->stem, 17.0, 4.2 + 0.55 * (double)q->n, &p);
    const struct span range = write_ranking(q, &p);
    if (q->title != NULL) {
        (void)fprintf(p.script, "set title ");
        plot_quote(p.script, q->title);
        (void)fprintf(p.script, " noenhanced offset 0,1.2\n");
    }
    plot_axes(p.script, "misfit after adding the effect / noise", "");
    log_axis(p.script, 'x', range);
    rank_names(q, p.script);
    for (size_t i = 0; i < q->n; i++) {
        held_out = held_out || drawable(q->rows[i].held_out);
        if (q->rows[i].named)
            (void)fprintf(p.script,
                          "set object rectangle from graph 0, first %zu.5 to graph 1, first %zu.5 behind fillcolor "
                          "rgb '#E8F1F8' fillstyle solid 1.0 noborder\n",
                          i, i + 1);
    }
    (void)fprintf(p.script,
                  "set arrow from 1, graph 0 to 1, graph 1 nohead back linewidth 1.4 linecolor rgb '" PLOT_NOISE "'\n"
                  "set label 'noise' at 1, graph 1 offset 0,0.6 center\n"
                  "set yrange [%zu.5:0.5]\nset key at screen 0.5, screen 0.01 center bottom horizontal maxrows 1 "
                  "width 1\nset bmargin 5\nset tmargin 4\n"
                  "plot '%s-rows.dat' using 2:1 with points pointtype 7 pointsize 1.6*mark linecolor rgb '" PLOT_FITTED
                  "' title 'fitted records'",
                  q->n, p.stem);
    if (held_out)
        (void)fprintf(p.script, ", '' using 3:1 with points pointtype 4 pointsize 2.2*mark linewidth 1.6 linecolor rgb "
                                "'" PLOT_HELD_OUT "' title 'held out'");
    (void)fprintf(p.script, "\n");
    return picture_end(&p, err);
}
