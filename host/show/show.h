/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * show.h — answers of the stages as text for a person, JSON for programs, pictures, and one page.
 *
 * Order of calls: a command has the answer of its stage and calls the one that shows it.
 *   fit_print(), fit_json()                                      of a fit
 *   compare_print(), compare_json(), compare_plot()              of a comparison
 *   history_print(), history_json(), history_plot()              of a chain of models
 *   diagnose_print(), diagnose_json(), diagnose_plot()           of a diagnosis
 *   discriminate_print(), discriminate_json()                    of an experiment's design
 *   answer_print_and_free(), answer_print_schema()              of a tree, in any form
 *   attainable_print(), attainable_json()                        of the attainable floor
 *   channel_factors_print(), channel_factors_json()              of wrong signs and units
 *   report_write(), curves_json()                                a page of a comparison, its modes and its history; its curves
 * Functions *_print() write to `out` and do not check the writes. Functions *_json() return a tree that the caller gives to
 * answer_print_and_free() with the table *_fields of the same name, which says what each name in it is.
 */
#ifndef BEAMFIT_SHOW_H
#define BEAMFIT_SHOW_H

#include <stdbool.h>
#include <stdio.h>

#include "beam/beam.h"
#include "compare/compare.h"
#include "estimate/estimate.h"
#include "explain/explain.h"
#include "ground/ground.h"

/*
 * ANSWER — what a command answers: a tree of named values, and a table that says what each name is. Its JSON, Markdown and HTML, the schema of its
 * JSON (--json-schema) and the manual page come of the two.
 */

enum answer_kind {
    ANSWER_NUMBER, /* null: not known, or infinite */
    ANSWER_COUNT,  /* whole */
    ANSWER_TEXT,
    ANSWER_BOOL,
    ANSWER_NUMBERS, /* a list */
    ANSWER_TEXTS,
    ANSWER_OBJECT,
    ANSWER_LIST,      /* of objects */
    ANSWER_MAP,       /* objects by name */
    ANSWER_NUMBER_MAP /* numbers by name */
};
enum { ANSWER_MAYBE = 1, ANSWER_NULL = 2 }; /* may be left out; may be null */

/* One row of a table, which ends with {0}. */
struct answer_field {
    enum answer_kind kind;
    const char *name, *what;
    const struct answer_field *fields; /* of objects */
    unsigned flags;
    const char *unit; /* NULL: as the name's end says (_Hz, _s, _m …), or none */
};
#define ANSWER_ROW(kind, name, what)                                                                                   \
    {                                                                                                                  \
        ANSWER_##kind, name, what, NULL, 0, NULL                                                                       \
    }
#define ANSWER_ROW_OF(kind, name, what, fields)                                                                        \
    {                                                                                                                  \
        ANSWER_##kind, name, what, fields, 0, NULL                                                                     \
    }
const char *answer_unit(const struct answer_field *field);

/* A command to go on with, word by word up to NULL, at the end of the list `next` that every answer has; as a shell reads it. */
void answer_next(struct json *root, ...) __attribute__((sentinel));

/* On standard output, in the form that --json or --format asked for; `warnings` gets what bf_warn() has said. Frees the tree. */
enum bf_status answer_print_and_free(struct json *root, const struct answer_field fields[], struct bf_error *err);
/* JSON on one line, for answers that never end. */
enum bf_status answer_print_line_and_free(struct json *root, struct bf_error *err);
enum bf_status answer_print_schema(const char *command, const struct answer_field fields[], FILE *out,
                                   struct bf_error *err);

extern const struct answer_field fit_fields[], compare_fields[], diagnose_fields[], history_fields[],
    discriminate_fields[];
extern const struct answer_field attainable_fields[], channel_factor_fields[],
    record_finding_fields[]; /* of the pieces below */

/* FIT — parameters with standard errors, errors of each channel, what the records do not determine. */

/* records: [result->n_records] as they were fitted; check->n may be 0. all: intervals and start values, too. */
void fit_print(FILE *out, const struct fit_result *result, const struct record records[], const struct fit_check *check,
               bool all);
struct json *fit_json(const struct fit_result *result, const struct record records[], const struct fit_check *check);

/* COMPARE — errors of each channel, where the misfit is, and a sentence or two on each. */

/* all: the tests of the residual, too. */
void compare_print(FILE *out, const struct comparison *comparison, bool all_columns);
struct json *compare_json(const struct comparison *comparison);

/*
 * Four panels and a residual page per channel: DIR/RECORD-CHANNEL.png and DIR/RECORD-CHANNEL-residual.png (and PDF). Channels of
 * fewer than 16 samples are left out. Errors as in PLOT. About 0.7 s a channel.
 */
enum bf_status compare_plot(const struct comparison *comparison, const char *directory, struct bf_error *err);

/* POLE TABLE — measured frequencies beside the modes that they were paired with; of the object root the keys "measured", "common_factor", "spread", "text". */

void pole_table_print(FILE *out, const struct pole_table *table, const struct modes *modes);
void pole_table_json(struct json *root, const struct pole_table *table);

/* HISTORY — models in order of descent, with the errors that their files state. */

void history_print(FILE *out, const struct history *history);
struct json *history_json(const struct history *history);

/* Error against model as DIR/history.png and .pdf. BF_USAGE when none was fitted; else errors as in PLOT. */
enum bf_status history_plot(const struct history *history, const char *directory, struct bf_error *err);

/* DIAGNOSE — the verdict, the candidates, where the misfit is, how far the computation can be trusted. */

/* written: the file that holds the found model; NULL: none was asked for. */
void diagnose_print(FILE *out, const struct diagnosis *diagnosis, const char *written);
struct json *diagnose_json(const struct diagnosis *diagnosis, const char *written);

/*
 * Pictures, each as PNG and PDF: DIR/diagnose-misfit (by band and amplitude, before and after adding the best),
 * diagnose-ranking, diagnose-amplitude (frequency and damping; when a record has a stretch without drive), diagnose-force
 * (when reconstructed). docs/diagnose.md, 'Pictures', says how to read them. None is drawn after an interruption; Ctrl-C
 * while drawing ends after the picture that is being drawn. predict: as in the options of the diagnosis; NULL: defaults.
 * Predicts all records with the fitted model and with the best.
 */
enum bf_status diagnose_plot(const struct diagnosis *diagnosis, const struct predict_options *predict,
                             const char *directory, struct bf_error *err);

/* DISCRIMINATE — experiments that would tell rivals apart, best first. */

/* most: rows of the table, at most. */
void discriminate_print(FILE *out, const struct discrimination *d, size_t most);
/* drive: path of the signal that was written; NULL: none was. */
struct json *discriminate_json(const struct discrimination *d, const char *drive);

/*
 * PLOT — pictures, drawn by gnuplot as a program. Only plot_gnuplot.c runs it.
 *
 * Every picture is STEM.png and STEM.pdf in `directory` (made when missing), with STEM.gp (the script) and STEM-*.dat (the
 * data) left beside it, so that a person can change and redraw it: `cd DIR && gnuplot STEM.gp`. A stem is reduced to letters,
 * digits, '.', '_' and '-'. Text is shown as it is (no gnuplot markup). When gnuplot is missing only
 * the pictures are: data and scripts are written, status BF_OK. BF_BAD_FILE: a file cannot be written.
 */

/* Before the work: false when gnuplot is not on the PATH; that is then said (bf_warn), unless directory is NULL. */
bool plot_can_draw(const char *directory);

/* The seed paper's four panels of one channel: (a) measured, (b) model, (c) amplitude spectra, (d) a short interval. */
struct plot_panels {
    const char *directory, *stem;
    const char *title;    /* NULL: none */
    const char *note;     /* small, in the corner: whose record it is; NULL: none */
    const char *quantity; /* "piezo_V": the unit is read from the name's last part */
    size_t n;
    double t0_s, dt_s;
    const double *measured, *model; /* [n] */
    double from_Hz, to_Hz;          /* of panel (c); to_Hz 0: the Nyquist frequency */
    /* Of panel (d), on the record's time axis; equal: chosen at the largest motion. */
    double detail_from_s, detail_to_s;
    const double *noise_psd; /* [n_noise] one-sided, from 0 to Nyquist, drawn as noise in (c); NULL: none */
    size_t n_noise;
};
enum bf_status plot_panels(const struct plot_panels *panels, struct bf_error *err);

/* Lines with points over logarithmic axes. Points that are not positive and finite are left out. */
struct plot_line {
    const char *legend;
    size_t n;
    const double *x, *y; /* [n] */
};
struct plot_convergence {
    const char *directory, *stem, *title, *x_label, *y_label;
    size_t n_lines;
    const struct plot_line *lines;
    bool linear_x, linear_y; /* false: logarithmic */
};
enum bf_status plot_convergence(const struct plot_convergence *plot, struct bf_error *err);

/* A board's stream: measured and predicted, their difference with ±2σ of the noise, the running ratio with its alarm. */
struct plot_live {
    const char *directory, *stem, *title, *quantity;
    size_t n;
    double dt_s;
    const double *measured, *predicted, *residual, *ratio; /* [n] */
    double noise_rms, alarm_ratio;
};
enum bf_status plot_live(const struct plot_live *live, struct bf_error *err);

/*
 * REPORT — the state of a model as one page (HTML) that needs nothing beside it: what `compare`, `modes` and `history`
 * found, as tables and curves to explore. Nothing is computed here but what fits on a line: which of the numbers to say first.
 */

enum { REPORT_TEXT = 1024 };

/* A model whose predictions the page's curves can show: an ancestor, an explanation of a diagnosis, the model itself. */
struct explanation {
    const char *name;                    /* for a person, "tip_mass at 0.457 m" */
    const struct comparison *comparison; /* of the same records, in the same order; channels are found by their names */
    double probability, explained;       /* as a diagnosis has them; NAN: not from one */
};

/* What curves are shown of. */
struct curves {
    size_t n;
    const struct explanation *explanations; /* [n] */
    size_t before,
        after; /* what is compared at first; `after` decides which channels there are, and what is said of them */
    size_t most_channels; /* of at most so many channels, the furthest from their noise first */
};

/*
 * Measured, predicted, residual over time and over frequency, thinned to what an eye can see and stay below 3 MB for five records, as the script of the
 * page reads it (host/show/page/curves.js). Cost: about 10 ms a channel and explanation.
 */
struct json *curves_json(const struct curves *curves);

/* Those of which there are curves; returns how many. chosen: [n_channels] */
size_t curves_choose(const struct comparison *comparison, size_t most, bool chosen[]);

/* What the page is made of. Everything is the caller's. */
struct report {
    const char *title; /* NULL: made of the model's file name */
    const struct model *model;
    const struct comparison *comparison; /* of that model */
    const struct modes *modes;           /* of that model */
    const struct history *history;       /* of history_of() */
    struct curves curves;                /* n 0: of that model alone */
};

/* One or two sentences, plain text, in which `this` is a command: how many times the noise is left, and what to do next. */
void report_verdict(const struct report *report, char text[REPORT_TEXT]);

/* The page; writes to `out` are not checked here. */
void report_write(const struct report *report, FILE *out);

/* The page of `beamfit watch`, and the Content-Security-Policy that its server sends: it asks for state, curves and jobs (host/cmd/watch_requests.c). */
void watch_page_write(FILE *out, const char *title);
void watch_page_policy(FILE *out);

/* ATTAINABLE — the floor of free linear models, beside the answers of compare, fit and diagnose. */

/* nrmse: of the model. The floor, the model, the noise, and what kind of cause to look for; nothing without modes. */
void attainable_print(FILE *out, const struct attainable *attainable, double nrmse);
/* root.attainable: {nrmse, noise_ratio, modes, poles}, null without modes. */
void attainable_json(struct json *root, const struct attainable *attainable);

/* FACTORS — wrong signs and units of channels, above everything else that is said; nothing where there are none. */

void channel_factors_print(FILE *out, const struct channel_factors *factors);
/* "channel_factors": [] where there are none. */
void channel_factors_json(struct json *root, const struct model *model, const struct channel_factors *factors);

/* FINDINGS — what is wrong with records before any model, [n] of each; nothing where there is nothing. sample counts from 1. */

void record_findings_print(FILE *out, const struct record records[], const struct record_findings findings[], size_t n);
/* "record_findings": [] where there are none. */
void record_findings_json(struct json *root, const struct record records[], const struct record_findings findings[],
                          size_t n);

#endif
