/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * record.h — one recording: columns over a uniform time axis. First stage of the flow.
 *
 * CSV form: a header row of names, first column time_s; '#' lines are comments, "# key: value" is metadata.
 * Metadata that beamfit reads: "excitation: free_decay" (no input was recorded, the initial state is unknown),
 * "excitation: unknown_level" (the input column has the right shape and an unknown factor), "free_from_s: 1.17",
 * "anti-alias filter: Butterworth order 8 at 409.6 Hz, forward and backward" (of every column).
 */
#ifndef BEAMFIT_RECORD_H
#define BEAMFIT_RECORD_H

#include "ground/error.h"

#define RECORD_FILTER "anti-alias filter" /* metadata key */

struct record_column {
    char *name;
    double *x; /* [n] */
};

struct record_meta {
    char *key, *value;
};

struct record {
    char *path;        /* as given */
    char sha256[65];   /* of the file's bytes, lower-case hex; "" when it was not read from a file */
    size_t n;          /* samples, ≥ 2 */
    double t0_s, dt_s; /* uniform axis: t_k = t0 + k dt */
    size_t n_columns;  /* time_s not counted */
    struct record_column *columns;
    size_t n_meta;
    struct record_meta *meta;
};

/* Reads and checks; on failure *out is empty and needs no free. */
enum bf_status record_read(const char *path, struct record *out, struct bf_error *err);
/* Written to a temporary file in the same directory, fsynced and renamed: never half a file. '%.17g' round trips;
 * digits ≤ 0 means 9 significant digits. */
enum bf_status record_write(const char *path, const struct record *record, int digits, struct bf_error *err);
const double *record_column(const struct record *record, const char *name); /* NULL when absent */
const char *record_meta(const struct record *record, const char *key);      /* NULL when absent */
/* Append a column (x is copied; [n]) or a metadata line. */
void record_add_column(struct record *record, const char *name, const double *x);
void record_add_meta(struct record *record, const char *key, const char *value);
/* The file's name without its directories, under which per-record values are kept; "" for a record in memory. */
const char *record_base_name(const struct record *record);
const char **record_base_names(const struct record records[], size_t n); /* [n], the records' own; free() the array */
void record_free(struct record *record);

#endif
