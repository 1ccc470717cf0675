/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * record.h — a recording over a uniform time axis, from a file or from a board.
 *
 *     record_read()                            a CSV file of this program, read and checked
 *     recording_add() … recording_make_record()  a recording made of the samples that a board streams
 *     record_column(), record_meta()           what is in it
 *     record_write(), record_free()
 *
 * Recordings of other programs: import/import.h.
 */
#ifndef BEAMFIT_RECORD_H
#define BEAMFIT_RECORD_H

#include <stdbool.h>
#include <stddef.h>

#include "beam_wire.h"
#include "ground/ground.h"

/*
 * RECORD — columns over a uniform time axis, and metadata.
 *
 * CSV form: a header row of names, first column time_s; '#' lines are comments, "# key: value" is metadata.
 * Metadata that beamfit reads: "excitation: free_decay" (no input was recorded, the initial state is unknown),
 * "excitation: unknown_level" (the input column has the right shape and an unknown factor), "free_from_s: 1.17",
 * "anti-alias filter: Butterworth order 8 at 409.6 Hz, forward and backward" (of every column).
 */

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

/* BF_BAD_FILE with the line: not readable, not uniform in time, a cell that is no number. *out is empty then and needs no free. */
enum bf_status record_read(const char *path, struct record *out, struct bf_error *err);

/* As an ATOMIC FILE (ground.h): never half a file. digits: significant ones, 17 keep every bit; ≤ 0: 9. BF_BAD_FILE. */
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

/*
 * TIME AXIS — is a column of times uniform, and with which step? Printed times are rounded, so that each may lie up
 * to half a unit of its last printed digit away from the truth.
 */

/* The most digits seen in a column of printed times; {0, 0}: not printed, exact. */
void time_axis_note(struct number_digits *most, struct number_digits one);

/*
 * t[n], n ≥ 2. True: uniform; *t0 and *dt by least squares over the whole span, or the roundest values that explain
 * every printed time (0.0009765625 rather than 0.00097656251). Each time may be off the line by 0.75 units of its last
 * printed digit (at most 0.3 dt, so that no missing or doubled sample passes) plus 0.01 dt.
 * False: *bad is the first offending sample and why[] says what is wrong with it. O(n).
 */
bool time_axis_fit(const double t[], size_t n, struct number_digits most, double *t0, double *dt, size_t *bad,
                   char why[256]);

/*
 * A step that was printed with `significant` digits: the roundest of it and of its rate that prints the same
 * (9.76563e-4 s with 6 digits is 1/1024 s).
 */
double time_axis_round_step(double dt, int significant);

/*
 * RECORDING — samples of a board, kept in memory, and the record that is made of them.
 *
 * A record has a uniform time axis and no holes. So a recording with holes becomes the record of its longest stretch
 * without one, and every hole is named in that record ("# gap: …"). Holes: a sample that did not come (lost on the line,
 * or its CRC-32 was wrong), the model put to rest in the middle, or another model.
 */

struct recording {
    unsigned prescale; /* every so many samples of the board, ≥ 1 */
    double sample_Hz;  /* of the board */
    size_t n, room;
    struct beam_live *live; /* [n], as they came; sequences rise */
};

void recording_begin(struct recording *recording, double sample_Hz, unsigned prescale);

/* A sample that is no later than the last is dropped. */
void recording_add(struct recording *recording, const struct beam_live *live);

/* Forgets the samples before, after `sequence`. */
void recording_drop_before(struct recording *recording, uint32_t sequence);
void recording_drop_after(struct recording *recording, uint32_t sequence);
void recording_free(struct recording *recording);

enum recording_break { RECORDING_WHOLE, RECORDING_LOST, RECORDING_REST, RECORDING_MODEL };

/* What lies between samples i and i + 1; *lost: samples that should have come between them. */
enum recording_break recording_between(const struct recording *recording, size_t i, uint64_t *lost);

struct recording_summary {
    size_t from, n; /* longest stretch without a hole: samples live[from … from + n − 1] */
    size_t breaks;  /* holes in all */
    uint64_t lost;  /* samples that did not come */
    uint64_t alarms, clipped, resets, unsolved; /* samples of the stretch with that flag */
    double noise_ratio;                         /* mean of the ratio over the stretch's last tenth */
};
struct recording_summary recording_summarise(const struct recording *recording);

/*
 * The stretch as a record: time_s, INPUT, OUTPUT, predicted, residual, ratio, sequence, step, codes, status. Time 0 is the
 * model's step 0 when the stretch has it (or begins in the first `prescale` steps), else its first sample. latency: samples
 * by which the board's measured values and predictions lag its input. It is undone for OUTPUT, which fits read, and left in
 * the others, which replays compare. BF_DEVICE with fewer than 2 samples. Write with 10 digits: then every single and
 * every 32-bit number survives.
 */
enum { RECORDING_DIGITS = 10 };
enum bf_status recording_make_record(const struct recording *recording, const struct recording_summary *summary,
                                     const char *input, const char *output, int latency, struct record *out,
                                     struct bf_error *err);

#endif
