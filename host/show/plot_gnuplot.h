/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * plot_gnuplot.h — one picture: its directory, its script, its data files, and running gnuplot on them. Private to show/.
 *
 *     struct picture p;
 *     picture_begin(directory, stem, 18.0, 14.0, &p);
 *     FILE *f = picture_data(&p, "time");  fprintf(f, ...);  picture_data_end(&p);
 *     fprintf(p.script, ...);
 *     return picture_end(&p, err);
 *
 * Failures are kept and returned by picture_end(); until then p.script and the data file can always be written to.
 */
#ifndef BEAMFIT_PLOT_GNUPLOT_H
#define BEAMFIT_PLOT_GNUPLOT_H

#include <stdio.h>
#include <stdbool.h>
#include "ground/ground.h"

/* Okabe and Ito (2008): distinct for every common colour vision, and in grey. */
#define PLOT_BLUE       "#0072B2"
#define PLOT_VERMILLION "#D55E00"
#define PLOT_GREEN      "#009E73"
#define PLOT_ORANGE     "#E69F00"
#define PLOT_PURPLE     "#CC79A7"
#define PLOT_GREY       "#8C8C8C"

/* What is what, in every picture and on the page (host/show/page/explore.css). */
#define PLOT_MEASURED     PLOT_BLUE
#define PLOT_MODEL        PLOT_VERMILLION
#define PLOT_MODEL_BEFORE PLOT_PURPLE
#define PLOT_RESIDUAL     PLOT_GREEN
#define PLOT_NOISE        "#595959"
#define PLOT_FITTED       PLOT_BLUE /* records, where curves are of records and not of signals */
#define PLOT_HELD_OUT     PLOT_ORANGE

enum { PICTURE_STEM = 120 };

struct picture {
    char *directory;
    char stem[PICTURE_STEM]; /* picture_name() of what was given */
    FILE *script;            /* body of the picture, run once for each format */
    struct atomic_file script_file, data_file;
    bool data_open;
    struct bf_error error; /* status BF_OK while all is well */
};

/* The stem reduced to letters, digits, '.', '_', '-'; never empty, never starting with '.' or '-'. */
void picture_name(const char *from, char to[PICTURE_STEM]);
/* BF_USAGE when a file of this picture, its data, its script or what it draws, may not be replaced (OUTPUTS). */
enum bf_status picture_may_be_made(const char *directory, const char *stem, struct bf_error *err);

/* Removes what an earlier run drew of this stem, so that it does not pass for one of this. */
void plot_forget(const char *directory, const char *stem);

/* Width and height of the printed picture. The script may use the point sizes `dot` and `mark`. */
void picture_begin(const char *directory, const char *stem, double width_cm, double height_cm, struct picture *p);
/* Opens STEM-NAME.dat. One at a time. */
FILE *picture_data(struct picture *p, const char *name);
void picture_data_end(struct picture *p);
/* Finishes the script, runs gnuplot, frees everything. */
enum bf_status picture_end(struct picture *p, struct bf_error *err);

/* 'text' as a gnuplot string: control characters and markup cannot leave it. */
void plot_quote(FILE *script, const char *text);
/* Panel title above the panel at its left; its key below the title at the right, both outside the data. */
void plot_panel_title(FILE *script, const char *title);
/* Small and grey in the lower right corner; NULL: nothing. */
void plot_note(FILE *script, const char *note);
/* About four ticks of an axis, 'x' or 'y'. */
void plot_ticks(FILE *script, char axis, double low, double high);
/* A logarithmic axis, 'x' or 'y', over this range, with a tick each power of ten as "10 m", "1 µ"; plot_linear() ends it. */
void plot_si_logarithmic(FILE *script, char axis, double low, double high);
void plot_linear(FILE *script, char axis);
void plot_axes(FILE *script, const char *x_label, const char *y_label);
/* Begins a multiplot; layout: gnuplot's words after `set multiplot`. title may be NULL. */
void plot_sheet(FILE *script, const char *layout, const char *title);
/* 1, 2 or 5 times a power of ten: about four of them in the range (> 0). */
double plot_tick_step(double range);
/* Columns time and any number of series, thinned to what the eye can see: extremes of each bucket are kept. */
void plot_write_series(FILE *f, double t0_s, double dt_s, const double *const y[], size_t n_series, size_t from,
                       size_t to);

#endif
