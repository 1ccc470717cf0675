/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * show.h — answers of the stages as text for a person, JSON for programs, pictures, and one page.
 *
 * Order of calls: a command has the answer of its stage and calls the one that shows it.
 *   answer_print_and_free(), answer_print_schema()   of a tree, in any form; its schema
 *   fit_json()                                       of a fit
 *   compare_json(), compare_plot()                   of a comparison
 *   history_json(), history_plot()                   of a chain of models
 *   diagnose_json(), diagnose_plot()                 of a diagnosis
 *   discriminate_json()                              of an experiment's design
 *   attainable_json()                                of the attainable floor
 *   channel_factors_json()                           of wrong signs and units
 *   record_findings_json(), repeatability_json()     of what records say without a model
 *   report_write(), curves_json()                    a page of a comparison, its modes and its history; its curves
 * Functions *_json() return a tree that the caller gives to
 * answer_print_and_free() with the table *_fields of the same name, which says what each name in it is, and what a person is shown of it.
 */
#ifndef BEAMFIT_SHOW_H
#define BEAMFIT_SHOW_H

#include <stdbool.h>
#include <stdio.h>

#include "beam/beam.h"
#include "compare/compare.h"
#include "estimate/estimate.h"
#include "explain/explain.h"
#include "fleet/fleet.h"
#include "ground/ground.h"

/*
 * ANSWER — what a command answers: a tree of named values, and a table that says what each name is. Its text for the terminal, JSON, Markdown and HTML,
 * the schema of its JSON (--json-schema) and the manual page come of the two.
 */

enum answer_kind {
    ANSWER_NUMBER, /* null: not known, or infinite */
    ANSWER_COUNT,  /* whole */
    ANSWER_TEXT,
    ANSWER_BOOL,
    ANSWER_NUMBERS, /* a list */
    ANSWER_TEXTS,
    ANSWER_OBJECT,
    ANSWER_LIST,       /* of objects */
    ANSWER_MAP,        /* objects by name */
    ANSWER_NUMBER_MAP, /* numbers by name */
    ANSWER_LINE        /* no value: words on the terminal, or a cell of a table there */
};
enum {
    ANSWER_MAYBE = 1,     /* may be left out */
    ANSWER_NULL = 2,      /* may be null */
    ANSWER_PERCENT = 4,   /* of text for a person: a hundred times as much, with % */
    ANSWER_BASE = 8,      /* a path, of which a person is told the last part */
    ANSWER_ALL = 16,      /* on the terminal with --all alone */
    ANSWER_TABLE = 32,    /* a list that is a table on the terminal, a row each */
    ANSWER_VERBATIM = 64, /* a line that is not wrapped: to be copied */
    ANSWER_GROUP = 128,   /* a line above the rows of a table for which it is the same */
    ANSWER_AGAIN = 256,   /* a list that has its row already, shown otherwise */
};

/*
 * One row of a table, which ends with {0}. The terminal shows, in the order of the table: lines; tables of the lists that are marked so (a list within
 * one has the rows, which repeat the cells of what they are in); the lines of each item of other lists, and of objects; a list of texts as items.
 * Of these only what has a text, which is a title. A single value is shown by the lines that name it; with a text, a heading, it is a column.
 */
struct answer_field {
    enum answer_kind kind;
    const char *name, *what;
    const struct answer_field *fields; /* of objects */
    unsigned flags;
    const char *unit;    /* NULL: as the name's end says (_Hz, _s, _m …), or none */
    int digits;          /* for a person: significant ones; negative: so many after the point; 0: five */
    const char *instead; /* words where a table would have the error, when there is none; NULL: nothing */
    const char *error;   /* the value beside it that is its standard error: value ± error; NULL: none */
    size_t most;         /* rows that a table has without --all; 0: any */
    const char *row;     /* of a table: the items of which this is so have a row; NULL: all */
    const char *text;    /* for the terminal: words, a title, a heading; NULL: not shown by itself */
};
/* ANSWER_ROW(NUMBER, "sd", "standard error", .digits = 2): more may follow. */
#define ANSWER_ROW(kind_, name_, ...)                                                                                  \
    {                                                                                                                  \
        .kind = ANSWER_##kind_, .name = (name_), .what = __VA_ARGS__                                                   \
    }
#define ANSWER_ROW_OF(kind_, name_, what_, ...)                                                                        \
    {                                                                                                                  \
        .kind = ANSWER_##kind_, .name = (name_), .what = (what_), .fields = __VA_ARGS__                                \
    }
/*
 * Words of a line. {name} is a value with its digits, error and unit; {a.b} of an object, {a.0} of a list (of objects: their first values), {@} the name or the number of the item; what
 * an item does not have is looked for in what it is in. {name?yes|no} one of two words, as the value is (true, not 0, not empty) or not; {n#one|many}
 * by the number, {list#} how many, {n>} so many pairs of blanks. [...] is left out when a value in it is missing, null or empty, a {name?} in it is not so, or a {name!} is. A line begins behind as
 * many blanks as its words, and goes on there, or behind a tab; newlines before it are blank lines. Nothing is printed of a line without words.
 */
#define ANSWER_SAY(...)                                                                                                \
    {                                                                                                                  \
        .kind = ANSWER_LINE, .name = "", .what = "", .text = __VA_ARGS__                                               \
    }
/* Such words as a column with that heading. */
#define ANSWER_CELL(heading, ...)                                                                                      \
    {                                                                                                                  \
        .kind = ANSWER_LINE, .name = (heading), .what = "", .text = __VA_ARGS__                                        \
    }
const char *answer_unit(const struct answer_field *field);
/* It is a name of the tree, not words or another view of one. */
bool answer_is_name(const struct answer_field *field);

/* A command to go on with, word by word up to NULL, at the end of the list `next` that every answer has; as a shell reads it. */
void answer_next(struct json *root, ...) __attribute__((sentinel));
void answer_next_words(struct json *root, const char *const words[]); /* NULL ends them */

/* A bf_warn_listener: what it hears stands in `warnings` of the answers after it, the first 64. */
void answer_take_warning(void *context, const char *text);

/* On standard output, in the form that --json or --format asked for, text otherwise. Frees the tree. */
enum bf_status answer_print_and_free(struct json *root, const struct answer_field fields[], struct bf_error *err);
/* For the terminal, at its width; writes are not checked. */
void answer_print_text(FILE *out, const struct json *root, const struct answer_field fields[]);
/* JSON on one line, or text, for answers that never end. */
enum bf_status answer_print_line_and_free(struct json *root, const struct answer_field fields[], struct bf_error *err);
enum bf_status answer_print_schema(const char *command, const struct answer_field fields[], FILE *out,
                                   struct bf_error *err);

extern const struct answer_field fit_fields[], compare_fields[], diagnose_fields[], history_fields[],
    discriminate_fields[];
extern const struct answer_field attainable_fields[], channel_factor_fields[], record_finding_fields[],
    repeatability_fields[], repeatability_floor_fields[], amplitude_fields[], no_decay_fields[], stabilisation_fields[],
    record_poles_fields[]; /* of the pieces below */

/* What is said of the records before anything of a model. */
#define ANSWER_RECORDS_FIRST                                                                                           \
    ANSWER_ROW_OF(LIST, "record_findings", "what is wrong with records before any model", record_finding_fields,       \
                  .text = "In the records:"),                                                                          \
        ANSWER_ROW_OF(LIST, "channel_factors", "wrong signs and units of channels", channel_factor_fields,             \
                      .text = "First of all:"),                                                                        \
        ANSWER_ROW_OF(LIST, "repeatability", "how well repeated records agree, free of any model",                     \
                      repeatability_fields, .text = "")

/* FIT — parameters with standard errors, errors of each channel, what the records do not determine. */

/* records: [result->n_records] as they were fitted; check->n may be 0. */
struct json *fit_json(const struct fit_result *result, const struct record records[], const struct fit_check *check);

/* Of a fit of many records (SHARES in estimate.h): the same, and the records that the model explains least. */
extern const struct answer_field fit_shared_fields[];
struct json *fit_shared_json(const struct fit_result *result, const struct record records[]);

/* COMPARE — errors of each channel, where the misfit is, and a sentence or two on each. */

/* lines: records that are no samples, behind the others in "records"; NULL: none. */
struct json *compare_json(const struct comparison *comparison, const struct line_comparison *lines);
/* RECORD-OUTPUT, a spectrum without phase, and RECORD-poles, a list, as pictures (PLOT below). */
enum bf_status compare_lines_plot(const struct line_comparison *lines, const char *directory, struct bf_error *err);

/*
 * Four panels and a residual page per channel: DIR/RECORD-CHANNEL.png and DIR/RECORD-CHANNEL-residual.png (and PDF). Channels of
 * fewer than 16 samples are left out. Errors as in PLOT. About 0.7 s a channel.
 */
enum bf_status compare_plot(const struct comparison *comparison, const char *directory, struct bf_error *err);
/* DIR/RECORD-CHANNEL-amplitude of each channel with a decay: its dominant modes, amplitude in time, frequency and damping against it. Errors as in PLOT. */
enum bf_status compare_plot_amplitude(const struct comparison *comparison, const struct amplitude_curves *curves,
                                      const char *directory, struct bf_error *err);
/* DIR/stabilisation; nothing where no order was computed. */
enum bf_status compare_plot_stabilisation(const struct comparison *comparison, const struct stabilisation *found,
                                          const char *directory, struct bf_error *err);
/* plot_prepare() for the pictures of all channels of these records, samples or not. */
enum bf_status compare_plot_prepare(const struct model *model, const struct record records[], size_t n,
                                    const char *directory, struct bf_error *err);

/* POLE TABLE — measured frequencies beside the modes that they were paired with; of the object root the keys "measured", "common_factor", "spread", "text". */

enum { PLOT_STEM = 160 };

extern const struct answer_field pole_table_fields[]; /* of "measured" */
/* pole_table_damping() was called. */
void pole_table_json(struct json *root, const struct pole_table *table);
/* The name of its picture, FILE-poles: [PLOT_STEM]. */
void pole_table_stem(const char *file, char stem[PLOT_STEM]);
/* FILE-poles as a picture: frequencies as differences from the model's, damping ratios as they are, with standard errors. */
enum bf_status pole_table_plot(const struct pole_table *table, const char *file, const char *directory,
                               struct bf_error *err);

/* HISTORY — models in order of descent, with the errors that their files state. */

struct json *history_json(const struct history *history);

/* Error against model as DIR/history.png and .pdf. BF_USAGE when none was fitted; else errors as in PLOT. */
enum bf_status history_plot(const struct history *history, const char *directory, struct bf_error *err);

/* DIAGNOSE — the verdict, the candidates, where the misfit is, how far the computation can be trusted. */

/* written: the file that holds the found model; NULL: none was asked for. factors: what was put right before the diagnosis. */
struct json *diagnose_json(const struct diagnosis *diagnosis, const char *written,
                           const struct channel_factors *factors);
/* root.next: the commands that follow from it. */
void diagnose_put_next(struct json *root, const struct diagnosis *diagnosis, const char *written,
                       const struct channel_factors *factors);

/*
 * Pictures, each as PNG and PDF: DIR/diagnose-amplitude (the decay; when a record has a stretch without drive, else that is said),
 * diagnose-misfit (by band and amplitude, before and after adding the best), diagnose-ranking, diagnose-force
 * (when reconstructed). docs/diagnose.md, 'Pictures', says how to read them. None is drawn after an interruption; Ctrl-C
 * while drawing ends after the picture that is being drawn. predict: as in the options of the diagnosis; NULL: defaults.
 * Predicts all records with the fitted model and with the best.
 */
enum bf_status diagnose_plot(const struct diagnosis *diagnosis, const struct predict_options *predict,
                             const char *directory, struct bf_error *err);
/* plot_prepare() for all of them. */
enum bf_status diagnose_plot_prepare(const char *directory, struct bf_error *err);

/* DISCRIMINATE — experiments that would tell rivals apart, best first. */

/* drive: path of the signal that was written; NULL: none was. most: experiments that text has, at most. */
struct json *discriminate_json(const struct discrimination *d, const char *drive, size_t most);

/* POPULATION — a fleet's values and spread, units that differ, drift, what their diagnoses say together. */

extern const struct answer_field population_fields[];
struct json *population_json(const struct fleet_population *population);
/* The page; results: the file's name. Writes to `out` are not checked here. */
void population_page(FILE *out, const char *results, const struct fleet_population *population);

/*
 * PLOT — pictures, drawn by gnuplot as a program. Only plot_gnuplot.c runs it.
 *
 * Every picture is STEM.png and STEM.pdf in `directory` (made when missing), with STEM.gp (the script) and STEM-*.dat (the
 * data) left beside it, so that a person can change and redraw it: `cd DIR && gnuplot STEM.gp`. A stem is reduced to letters,
 * digits, '.', '_' and '-'. Text is shown as it is (no gnuplot markup). When gnuplot is missing only
 * the pictures are: data and scripts are written, status BF_OK. BF_BAD_FILE: a file cannot be written.
 */

/*
 * Before the work of every command with --plot: BF_BAD_FILE when there can be no such directory, BF_USAGE when a file of a picture
 * with one of these stems may not be replaced (OUTPUTS). Warns when gnuplot is missing. Nothing is made. directory NULL: BF_OK.
 */
enum bf_status plot_prepare(const char *directory, const char *const stems[], size_t n, struct bf_error *err);

/* False when gnuplot is not on the PATH; that is then said (bf_warn), unless directory is NULL. */
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

/* Modes that a board followed: of each reading and mode frequency_Hz, damping in per cent and gain, each with its standard error. */
enum { PLOT_TRACKED = 3 };
struct plot_tracking {
    const char *directory, *stem, *title;
    size_t modes, n;
    const double *time_s; /* [n], ascending */
    const double *values; /* [n][PLOT_TRACKED][6] */
};
enum bf_status plot_tracking(const struct plot_tracking *tracking, struct bf_error *err);

/*
 * REPORT — the state of a model as one page (HTML) that needs nothing beside it: what `compare`, `modes` and `history`
 * found, as tables and curves to explore. Nothing is computed here but what fits on a line: which of the numbers to say first.
 */

enum { REPORT_TEXT = 4096 };

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
        after;    /* what is compared at first; `after` decides which channels there are, and what is said of them */
    double bytes; /* of the text of the curves over time, and of those over frequency; 0: as a page to send may have */
    size_t most_channels; /* of at most so many channels, the furthest from their noise first */
};

/*
 * Measured, predicted, residual over time and over frequency, every sample where that stays below 3 MB for five records, else extremes of stretches, as the script of
 * the page reads it (host/show/page/curves.js). Cost: about 10 ms a channel and explanation.
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
    const struct diagnosis *diagnosis;   /* of that model and these records; NULL: none was made */
};

/* One or two sentences, plain text, in which `this` is a command: how many times the noise is left, and what to do next. */
void report_verdict(const struct report *report, char text[REPORT_TEXT]);
/* Some channel has more than its noise left. */
bool report_leaves_more(const struct report *report);

/* The page; writes to `out` are not checked here. */
void report_write(const struct report *report, FILE *out);

/* The page of `beamfit watch`, and the Content-Security-Policy that its server sends: it asks for state, curves and jobs (host/cmd/watch_requests.c). */
void watch_page_write(FILE *out, const char *title);
void watch_page_policy(FILE *out);

/* ATTAINABLE — the floor of free linear models, beside the answers of compare, fit and diagnose. */

/* root.attainable: {nrmse, noise_ratio, modes, poles, text}, null without modes. nrmse: of the model, beside which the text holds the floor. */
void attainable_json(struct json *root, const struct attainable *attainable, double nrmse);

/* FREE MOTION — what records say of modes without a model. */

/* root.decays, no_decay, drift. */
void amplitude_json(struct json *root, const struct record records[], const struct amplitude_curves *curves);
/* root.stabilisation, null where nothing was computed. */
void stabilisation_json(struct json *root, const struct stabilisation *found);
/* "poles" of pole_table_of_records(); null: none. */
void record_poles_json(struct json *root, const struct pole_table *table);
/* What pole_table_plot() takes as the file of the table of the records' own poles. */
#define COMPARE_POLES "records"

/* FACTORS — wrong signs and units of channels, above everything else that is said; nothing where there are none. */

/* "channel_factors": [] where there are none. */
void channel_factors_json(struct json *root, const struct model *model, const struct channel_factors *factors);

/* FINDINGS — what is wrong with records before any model, [n] of each; nothing where there is nothing. sample counts from 1. */

/* "record_findings": [] where there are none. */
void record_findings_json(struct json *root, const struct record records[], const struct record_findings findings[],
                          size_t n);

/* REPEATABILITY — how well repeated records agree; nothing where there are none. A record that stands out is told above everything, else the bound at the end. */

/* "repeatability": [] where there are none. */
void repeatability_json(struct json *root, const struct model *model, const struct record records[],
                        const struct repeatability *repeatability);

#endif
