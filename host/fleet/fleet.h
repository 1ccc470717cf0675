/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fleet.h — many units of one kind: which there are, who works on them, what is kept of each, and what they are together.
 *
 *     MANIFEST     the units of a CSV file
 *     ROWS         what is to be kept of one unit, packed, so that it can be sent from process to process
 *     RESULTS      one SQLite file; written by one process, whole units in transactions
 *     CREW         processes of this machine, one for each unit at work: a crash is a row
 *     POPULATION   values and spread over the fleet, units that differ, drift
 *
 * Nothing here knows how a unit is fitted: the caller brings that as a function (host/cmd/fleet_unit.c).
 */
#ifndef BEAMFIT_FLEET_H
#define BEAMFIT_FLEET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ground/ground.h"

/*
 * MANIFEST — a CSV file with a header: unit, model, records, optionally checks, and columns of the user's (date, temperature, device …). Files
 * within a cell are separated by blanks, or by ';' where there is one, and are relative to the manifest. A cell may be quoted ("a, b"; "" is a quote).
 * Lines that begin with '#' are comments.
 */

enum { FLEET_NAME = 128 }; /* bytes of a unit's name, at most, with its end */

struct fleet_files {
    size_t n;
    char **names; /* [n] as they can be opened */
};

/*
 * Adds the files that a text file names, one a line ('#': a comment), relative to it. Free with fleet_files_free(), also after a failure.
 */
enum bf_status fleet_list_read(const char *path, struct fleet_files *files, struct bf_error *err);
void fleet_files_free(struct fleet_files *files);

struct fleet_unit {
    char *name;  /* unique in the manifest */
    char *model; /* as it can be opened; "" when the cell is empty */
    struct fleet_files records, checks;
    char **cells; /* [n_columns] of the user's columns */
};

struct fleet_manifest {
    char sha256[65];
    size_t n_columns; /* the user's */
    char **columns;   /* [n_columns] */
    size_t n;
    struct fleet_unit *units; /* [n] in the file's order */
};

/* BF_BAD_FILE: "file:line: ..." what is wrong. Free with fleet_manifest_free(); after a failure there is nothing to free. */
enum bf_status fleet_manifest_read(const char *path, struct fleet_manifest *out, struct bf_error *err);
/* The same of text[n]; path is for messages and for what the files are relative to. */
enum bf_status fleet_manifest_parse(const char *path, const char *text, size_t n, struct fleet_manifest *out,
                                    struct bf_error *err);
void fleet_manifest_free(struct fleet_manifest *manifest);

/* PORTS — a CSV file with a header: unit, port, optionally key (a file, relative to this one). */

struct fleet_port {
    char *unit, *port, *key; /* key "": none of its own */
};
struct fleet_ports {
    size_t n;
    struct fleet_port *all; /* [n] */
};

/* BF_BAD_FILE: "file:line: ..."; there is nothing to free then. Free with fleet_ports_free(). */
enum bf_status fleet_ports_read(const char *path, struct fleet_ports *out, struct bf_error *err);
void fleet_ports_free(struct fleet_ports *ports);

/* ROWS — of the tables of RESULTS, of one unit. */

enum fleet_table {
    FLEET_UNITS, /* what became of it */
    FLEET_INPUTS,
    FLEET_PARAMETERS,
    FLEET_COVARIANCES,
    FLEET_ERRORS,
    FLEET_VERDICTS,
    FLEET_EFFECTS,
    FLEET_MODELS,
    FLEET_WARNINGS,
    FLEET_RUNS,                  /* times and memory: the only table that differs from run to run */
    FLEET_STORED,                /* so many are tables of RESULTS */
    FLEET_BOARDS = FLEET_STORED, /* what became of an image: said by its process, not stored */
    FLEET_TABLES
};

/* Starts empty ({0}); bytes may be sent to another process of the same program on a machine of the same kind. */
struct fleet_rows {
    size_t n; /* bytes */
    unsigned char *bytes;
};

/*
 * One row: a value for each column behind `unit` (fleet_columns()), a double for a number (NaN and infinities are stored as NULL), an int for a
 * whole number or a yes, a const char * for a text (NULL: NULL).
 */
void fleet_row(struct fleet_rows *rows, enum fleet_table table, ...);
void fleet_rows_free(struct fleet_rows *rows);
/* "CREATE TABLE" of it, and the kinds of its columns behind `unit`: 'n' number, 'i' whole number, 't' text. */
const char *fleet_table_sql(enum fleet_table table);
const char *fleet_table_name(enum fleet_table table);
const char *fleet_table_kinds(enum fleet_table table);

/* One value of rows that are read again, or of an answer of RESULTS. */
struct fleet_value {
    char kind;        /* 'n', 'i', 't'; 0: NULL */
    double number;    /* NaN: none */
    const char *text; /* "": none */
};

enum { FLEET_COLUMNS = 24 };
/* Reads the row at *at of bytes[n], which moves behind it; false at the end and where bytes are no rows (*table is then FLEET_TABLES). */
bool fleet_rows_next(const unsigned char bytes[], size_t n, size_t *at, enum fleet_table *table,
                     struct fleet_value values[FLEET_COLUMNS]);

/*
 * RESULTS — one SQLite 3 file; `sqlite3 FILE .schema` shows it. Only results.c sees SQLite. One process writes, all of a unit in one
 * transaction, with units that end at about the same time: whenever the program is killed, a unit is there whole or not at all.
 */

struct fleet_results;

/*
 * For writing: made when missing. BF_BAD_FILE: cannot be read or written, or is being written by another run; BF_USAGE: a file that `beamfit fleet`
 * has not made, or one with units that the manifest has not. Close with fleet_results_close().
 */
enum bf_status fleet_results_open(const char *path, const struct fleet_manifest *manifest, struct fleet_results **out,
                                  struct bf_error *err);
enum bf_status fleet_results_read(const char *path, struct fleet_results **out, struct bf_error *err);
void fleet_results_close(struct fleet_results *results);

/* Of the inputs that its rows are of; "" when the unit is not there, or is to be tried again because its process was killed. */
void fleet_results_identity(struct fleet_results *results, const char *unit, char identity[65]);

/* Replaces all that is there of the unit, once fleet_results_commit() has come back. rows: of fleet_row(). */
enum bf_status fleet_results_store(struct fleet_results *results, const char *unit, const struct fleet_rows *rows,
                                   struct bf_error *err);

/* The units stored since the last one, in one transaction: they are on the disk then. Nothing to do without any. BF_BAD_FILE: none of them is. */
enum bf_status fleet_results_commit(struct fleet_results *results, struct bf_error *err);

/* Calls take() for each row of a question in SQL, in which ?1 is `argument` (NULL: none); ends when it returns false. */
typedef bool fleet_take(void *context, const struct fleet_value values[], size_t n);
enum bf_status fleet_results_ask(struct fleet_results *results, const char *sql, const char *argument, fleet_take *take,
                                 void *context, struct bf_error *err);

/*
 * CREW — each unit is worked on in a process of its own, forked from this one: memory is given back, nothing of one unit can change another, and
 * a crash ends that unit alone.
 */

struct fleet_job {
    size_t unit;       /* index into the manifest */
    char identity[65]; /* of what is known of it; "": nothing */
};

/* In the new process: says the identity, then the rows (none: what is known is still true) through these two. */
struct fleet_report;
void fleet_say_identity(struct fleet_report *report, const char identity[65]);
void fleet_say_rows(struct fleet_report *report, const struct fleet_rows *rows);
typedef void fleet_work(void *context, const struct fleet_job *job, struct fleet_report *report);

/* In this process, of a unit that is done: rows (n 0: what is known is still true), also of one whose process has died. */
typedef void fleet_done(void *context, size_t unit, const struct fleet_rows *rows);

struct fleet_crew;
/* limit_s: a unit that takes longer is ended; 0: none is. */
struct fleet_crew *fleet_crew_new(size_t n_processes, double limit_s, fleet_work *work, void *context);
bool fleet_crew_has_room(const struct fleet_crew *crew);
bool fleet_crew_works(const struct fleet_crew *crew);
/* fleet_crew_has_room() must be true. BF_NUMERIC: no process can be made. */
enum bf_status fleet_crew_start(struct fleet_crew *crew, const struct fleet_job *job, struct bf_error *err);
/* Waits at most so long for something to be said, and hands on what is done. */
void fleet_crew_wait(struct fleet_crew *crew, int most_ms, fleet_done *done, void *context);
/* Ends the processes that still work; their units are not done. */
void fleet_crew_free(struct fleet_crew *crew);

/* Rows of a unit that failed before anything of it could be kept. status: "failed" or "killed" (which is tried again). */
void fleet_failed(struct fleet_rows *rows, const char *identity, const char *status, const char *reason);

/*
 * POPULATION — what the units are together: x_i = θ_i + e_i with θ_i ~ N(μ, Σ) and e_i ~ N(0, S_i), S_i the covariance of the unit's own estimate.
 * Parameters are in ln θ where all units estimate them so, else in θ. docs/fleet.md has the method.
 */

struct fleet_estimates {
    size_t n, p;  /* units with estimates, parameters */
    char **units; /* [n] in the manifest's order */
    char *
        *parameters; /* [p] that at least half of the units estimate; no per-record ones, no residuals of modes above */
    char **si_units; /* [p] */
    bool *logarithmic; /* [p] */
    double *x;         /* [n][p]; NaN: the unit's records do not determine it */
    double *S;         /* [n][p × p]; rows of such parameters are 0 */
    bool *from_found;  /* [n] of the model that a diagnosis found (whose covariances are not kept: S is diagonal) */
};

/* BF_BAD_FILE: RESULTS cannot be read. n or p may be 0. Free with fleet_estimates_free(), also after a failure. */
enum bf_status fleet_estimates_read(struct fleet_results *results, struct fleet_estimates *out, struct bf_error *err);
void fleet_estimates_free(struct fleet_estimates *estimates);

struct fleet_mixed {
    size_t n;                       /* units in use */
    double *mean, *mean_covariance; /* [p], [p × p] */
    double *spread;                 /* Σ[p × p] */
    int iterations;
};

/*
 * μ and Σ by restricted maximum likelihood (EM: Laird & Ware 1982, Biometrics 38, 963), over the units with use[i] (NULL: all). BF_NUMERIC: fewer than
 * p + 2 units, or a matrix is singular. Free with fleet_mixed_free(), also after a failure. Cost: n p³ for each of up to 2000 steps.
 */
enum bf_status fleet_mixed_fit(const struct fleet_estimates *e, const bool use[], struct fleet_mixed *out,
                               struct bf_error *err);
void fleet_mixed_free(struct fleet_mixed *mixed);

/*
 * The unit's parameters with what the fleet knows of them: best[p], sd[p] its standard error, borrowed[p] the share that the fleet decides (0: the unit alone,
 * 1: the unit says nothing).
 */
enum bf_status fleet_mixed_unit(const struct fleet_estimates *e, const struct fleet_mixed *mixed, size_t i,
                                double best[], double sd[], double borrowed[], struct bf_error *err);

struct fleet_outlier {
    size_t unit, parameter; /* the one that stands out most */
    double deviation;       /* of it from the mean, in its spread with the unit's own error */
    double p_value;         /* of the unit as a whole, once for all units (Bonferroni) */
};

struct fleet_drift {
    size_t parameter;
    char *column;
    double *t; /* [n of the estimates] the column's numbers, NaN where a unit has none */
    size_t n;
    double middle, slope,
        sd;         /* x changes by slope for each unit of the column (days of a date); middle: the column's mean */
    double p_value; /* once for all pairs (Bonferroni) */
};

/* An effect that diagnoses name alone or together with others that are there too. */
struct fleet_effect {
    char *id, *parameter, *si_unit; /* its first parameter */
    size_t n;
    size_t *units;           /* [n] indices into the list of diagnosed units */
    double mean, sd, spread; /* over the units, their own errors taken off; NaN with fewer than 2 that have one */
    size_t n_values;
    double *value, *value_sd; /* [n_values] */
};

enum { FLEET_VERDICT_KINDS = 4 };
struct fleet_population {
    size_t n_units, n_failed; /* of the manifest; without a result */
    struct fleet_estimates estimates;
    bool has_mixed; /* false: `why_not` says why */
    char why_not[256];
    struct fleet_mixed mixed; /* without the outliers */
    double false_alarm_rate;  /* of one outlier anywhere in a fleet that has none, and of one drift */
    size_t n_outliers;
    struct fleet_outlier *outliers; /* [n_outliers] */
    size_t n_drifts;
    struct fleet_drift *drifts;                          /* [n_drifts] that are significant at false_alarm_rate */
    size_t n_tested;                                     /* pairs of parameter and column */
    size_t n_diagnosed, n_verdicts[FLEET_VERDICT_KINDS]; /* complete, missing, ambiguous, unknown */
    char **diagnosed;                                    /* [n_diagnosed] names */
    size_t n_effects;
    struct fleet_effect *effects; /* [n_effects] the most frequent first */
};

/* false_alarm_rate in (0, 1). Free with fleet_population_free(), also after a failure. */
enum bf_status fleet_population_find(struct fleet_results *results, double false_alarm_rate,
                                     struct fleet_population *out, struct bf_error *err);
void fleet_population_free(struct fleet_population *population);

/* A number, or a date (2026-11-02, 2026-11-02T14:30:00) as days since 1970; false: neither. */
bool fleet_column_number(const char *text, double *x);

#endif
