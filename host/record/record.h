/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * record.h — a recording over a uniform time axis, from a file or from a board.
 *
 *     record_read()                            a CSV file of this program, read and checked
 *     recording_add() … recording_make_record()  a recording made of the samples that a board streams
 *     record_column(), record_meta()           what is in it
 *     record_findings_find()                   what is wrong with a measured record before any model: overload, a second hit, hum …
 *     record_gate()                            a hammer's force without what its sensor says between hits
 *     record_average()                         repeated hits as one frequency response with its coherence
 *     record_write(), record_free()
 *     frequency_list_read()                    a list of measured frequencies
 *     response_write_uff()                     a frequency response for other programs
 *
 * Recordings of other programs: import/import.h.
 */
#ifndef BEAMFIT_RECORD_H
#define BEAMFIT_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "beam_wire.h"
#include "ground/ground.h"

/*
 * RECORD — columns over a uniform time axis, and metadata.
 *
 * CSV form: a header row of names, first column time_s; '#' lines are comments, "# key: value" is metadata.
 * Metadata that beamfit reads: "excitation: free_decay" (no input was recorded, the initial state is unknown),
 * "initial_state: free" (the input was recorded, and it began before the record did) or "rest",
 * "input_noise: keep" (nothing of an input's noise is taken off), "excitation: unknown_level" (the input column has the right shape and an unknown factor), "free_from_s: 1.17",
 * "anti-alias filter: Butterworth order 8 at 409.6 Hz, forward and backward" or "none" (of every column), "exponential window: 0.5 s".
 *
 * A file whose first column is freq_Hz holds frequency responses (columns "accel_mps2/hammer_N_re", ..., docs/records.md). It is read as
 * one period of the steady answer to a periodic pulse: excitation "frequency_response".
 */

#define RECORD_FILTER   "anti-alias filter"  /* metadata key */
#define RECORD_WINDOW   "exponential window" /* metadata key: time constant of the window on pulses and answers */
#define RECORD_SD       "_sd"                /* end of a column's name, of RECORD_MAGNITUDES */
#define RECORD_AVERAGES "averages"           /* metadata key: averages behind the coherence */
#define RECORD_RESPONSE "frequency_response" /* excitation */

/* What was done to a measured input whose sensor's noise was taken off where the drive is not (inputs_clean() of noise.h). */
struct column_noise {
    double rms;          /* of the white noise that was there before, unit of the column */
    size_t segment;      /* samples of a segment, a power of 2; half-overlapping */
    size_t n_segments;   /* segment t begins at sample (t − 1) segment/2 */
    unsigned char *kept; /* [n_segments][segment/2 + 1] cells that stayed as they were; the others are zero */
    double *share;       /* [segment/2 + 1] part of the segments in which they did */
};

struct record_column {
    char *name;
    double *x; /* [n] */
    double *
        noise_psd; /* [n/2 + 1] of a frequency response with coherence: one-sided, unit²/Hz, lines 1/(n dt) apart; else NULL */
    struct column_noise *noise; /* of an input that was cleaned; else NULL */
};

struct record_meta {
    char *key, *value;
};

enum record_kind {
    RECORD_SAMPLES,     /* over time, responses with phase among them */
    RECORD_FREQUENCIES, /* a list of measured frequencies: columns mode, frequency_Hz, sd_Hz, damping_ratio, damping_sd */
    RECORD_MAGNITUDES /* spectra without phase: t0_s and dt_s are in Hz, columns "accel_mps2/hammer_N" and ..._sd, 0 where it is not known */
};

struct record {
    enum record_kind kind; /* what is not over time is fitted and compared, and refused elsewhere */
    char *path;            /* as given */
    char sha256[65];       /* of the file's bytes, lower-case hex; "" when it was not read from a file */
    size_t n;              /* samples, ≥ 2; modes of a list, ≥ 1; lines of a spectrum */
    bool
        over_frequency; /* only of an import, to be written: t0_s and dt_s are in Hz, columns those of frequency responses */
    double t0_s, dt_s; /* uniform axis: t_k = t0 + k dt */
    size_t n_columns;  /* time_s not counted */
    struct record_column *columns;
    size_t n_meta;
    struct record_meta *meta;
};

/* BF_BAD_FILE with the line: not readable, not uniform in time, a cell that is no number. *out is empty then and needs no free. */
enum bf_status record_read(const char *path, struct record *out, struct bf_error *err);

/*
 * SPOOL — a record whose samples lie in a file without a name instead of in memory, beside another file, where there is room for it.
 *
 * record: as record_read() gives it, but for its samples (no column has any) while in_file. Where the file is over frequency or a list, and where no other can
 * be made or has room, the samples are in memory, and in_file is false.
 */
struct record_spool {
    struct record record;
    bool in_file;
    FILE *f; /* rows of time and all columns */
};
enum bf_status record_spool_read(const char *path, const char *beside, struct record_spool *out, struct bf_error *err);
/* x[n] of a column, samples `first` … first + n − 1 of it; zeros where the file cannot be read again (see record_spool_failed()). */
void record_spool_take(const struct record_spool *spool, size_t column, size_t first, size_t n, double x[]);
/* The same of a column by its name; zeros where there is none. */
void record_spool_column(const struct record_spool *spool, const char *name, size_t first, size_t n, double x[]);
bool record_spool_failed(const struct record_spool *spool);
/* The first n samples as a record of their own, with the metadata and the file's hash. */
enum bf_status record_spool_head(const struct record_spool *spool, size_t n, struct record *out, struct bf_error *err);
/* All samples into memory: the record is an ordinary one then. */
enum bf_status record_spool_load(struct record_spool *spool, struct bf_error *err);
void record_spool_close(struct record_spool *spool);

/* WRITER — a record written row by row: its head without samples, then rows in their order, head.n of them. */
struct record_writer {
    struct atomic_file out;
    const struct record *head;
    int digits, time_digits;
    size_t written;
};
enum bf_status record_writer_open(const char *path, const struct record *head, int digits, struct record_writer *w,
                                  struct bf_error *err);
/* n rows: column i is x[i][n]. BF_NUMERIC: one is not finite; then nothing will be written. */
enum bf_status record_writer_add(struct record_writer *w, size_t n, const double *const x[], struct bf_error *err);
enum bf_status record_writer_commit(struct record_writer *w, struct bf_error *err);
void record_writer_abort(struct record_writer *w);

/* As an ATOMIC FILE (ground.h): never half a file. digits: significant ones, 17 keep every bit; ≤ 0: 9. BF_BAD_FILE. */
enum bf_status record_write(const char *path, const struct record *record, int digits, struct bf_error *err);
const double *record_column(const struct record *record, const char *name); /* NULL when absent */
/* Of a column that was cleaned; else NULL. */
const struct column_noise *record_column_noise(const struct record *record, const char *name);
const char *record_meta(const struct record *record, const char *key); /* NULL when absent */
/* The number that a metadata value begins with ("0.5 s"); false: there is none. */
bool record_meta_number(const struct record *record, const char *key, double *number);

/*
 * Lines over frequency (over_frequency) as one period of time; those without phase as RECORD_MAGNITUDES. *out needs no free after a failure. BF_BAD_FILE: names of columns, lines
 * that are not at multiples of their distance. O(n log n).
 */
enum bf_status record_from_response(const struct record *lines, struct record *out, struct bf_error *err);
/* One period of a steady state: it goes on after its last sample with its first. */
bool record_is_periodic(const struct record *record);
/* 1/s: what an exponential window has added to the damping; 0 without. */
double record_window_rate(const struct record *record);
/* "excitation: free_decay" */
bool record_is_free_decay(const struct record *record);
/* First sample of a free decay, by "free_from_s"; 0 where the record is none, says nothing, or a time that is not in it. The setter is for records that say nothing. */
size_t record_free_from(const struct record *record);
void record_set_free_from(struct record *record, size_t sample);
/* "excitation: free_decay", or "initial_state: free": the beam moved before the record began, nobody knows how. */
bool record_state_is_free(const struct record *record);

/* Append a column (x is copied; [n]) or a metadata line. */
void record_add_column(struct record *record, const char *name, const double *x);
void record_add_meta(struct record *record, const char *key, const char *value);
/*
 * A record over time that does not say what anti-alias filter its recorder had gets RECORD_FILTER as of a usual one, and true is returned: recorders have one, and
 * what bends (a law, a drive or a sensor that saturates) makes harmonics that it takes away. Without delay, because a wrong delay costs more than none. "none" is a
 * statement, too.
 */
bool record_assume_filter(struct record *record);
bool record_filter_is_assumed(const struct record *record);

/* The file's name without its directories, under which per-record values are kept; "" for a record in memory. */
const char *record_base_name(const struct record *record);
const char **record_base_names(const struct record records[], size_t n); /* [n], the records' own; free() the array */
void record_free(struct record *record);

/*
 * FINDINGS — what a laboratory's record has that no model of a beam explains, told from the samples alone, with the column and the sample.
 */

enum record_finding_kind {
    FINDING_OVERLOAD,   /* the recorder's end of range: three samples or more at the extreme value, reached at a run */
    FINDING_HITS,       /* a hammer hit more than once */
    FINDING_OPEN_END,   /* a hit is not over at the last sample */
    FINDING_WINDOW,     /* a force that is exactly 0 outside the hit, and noisy inside: a force window was applied */
    FINDING_HUM,        /* mains and harmonics in what was recorded before the first hit */
    FINDING_OPEN_BEGIN, /* the record begins within a hit */
    FINDING_NO_ANSWER   /* a channel that no hit moves */
};

enum { FINDING_LINES = 10 };

struct record_finding {
    enum record_finding_kind kind;
    size_t column;    /* of the record */
    size_t sample, n; /* first sample concerned, from 0; how many samples (overload) or hits (hits) */
    double value;     /* overload: the value; hits: second largest over largest peak; hum: rms of the hum */
    double mains_Hz;  /* hum */
    size_t n_lines;   /* hum: harmonics found */
    struct {
        double frequency_Hz, amplitude; /* unit of the column */
    } line[FINDING_LINES];
    char text[500]; /* one or two sentences */
};

struct record_findings {
    size_t n;
    struct record_finding *all;
};

/*
 * is_force(context, column's name): does a hammer or another point force stand in it? is_signal: is it a measured answer? Other columns are not
 * looked at. Free with record_findings_free(). Cost: O(n) a column, and some 2000 sums over the part before the
 * hit for the hum.
 */
void record_findings_find(const struct record *record, bool (*is_force)(const void *, const char *),
                          bool (*is_signal)(const void *, const char *), const void *context,
                          struct record_findings *out);
void record_findings_free(struct record_findings *findings);

/* By its unit: "_N" is a force, a motion, acceleration, strain or voltage a signal. context is not read. */
bool record_is_force(const void *context, const char *column);
bool record_is_signal(const void *context, const char *column);

/*
 * Sets a force to 0 outside its hits, each with half its length (two samples at least) before and after, and takes off the offset between
 * them. from_s < to_s: outside these seconds instead. said: what was done. BF_USAGE: no such column, or no hit in it.
 */
enum bf_status record_gate(struct record *record, const char *column, double from_s, double to_s, char said[200],
                           struct bf_error *err);

/*
 * REPEATS — hits of one kind, each from just before its onset on under e^(−rate k): a convolution under that window is the convolution of what is
 * windowed, exactly, and nothing is left at the end. They are held against the one response H1 = Σ U* Z / Σ |U|² that is best for all, line by line.
 */
struct repeats {
    double nrmse;    /* scatter over the signal, a degree of freedom given back */
    bool stands_out; /* one of three or more scatters far beyond the others */
    size_t odd;      /* which */
    double odd_nrmse, others_nrmse;
};

enum { REPEATS_MOST = 64, REPEATS_LEAST = 256 }; /* records; samples of each after its onset */

struct fft; /* maths.h */

/* The sample at which a record of this force begins: 32 before it reaches 2 % of its largest value. */
size_t repeats_onset(const double u[], size_t n);
/* X[fft_size(plan)/2 + 1] of x[k] e^(−rate k), k < n ≤ fft_size(plan). */
void repeats_spectrum(const struct fft *plan, const double x[], size_t n, double rate, double _Complex X[]);
/* U, Z: [n][bins] of the input and one output; n ≥ 2. Of each, lines 1 to lines − 1. O(n² lines). */
void repeats_judge(const double _Complex U[], const double _Complex Z[], size_t n, size_t bins, size_t lines,
                   struct repeats *out);

struct average_options {
    const char *input; /* NULL: the only column of force */
    double
        window_s; /* time constant of the exponential window; 0: as long as leaves 1e-4 of the signal at the end, and none where it is gone by then */
    double to_Hz; /* the last line; 0: where the hits have a hundredth of their largest power */
};

struct average {
    double window_s, to_Hz; /* as taken; window_s 0: none */
    const char *input;      /* the records' own */
    size_t n_outputs;
    const char **outputs;  /* [n_outputs] the first record's */
    struct repeats *agree; /* [n_outputs] in these lines */
    double *level;         /* [n_records] largest force */
};

/*
 * The responses of all signals to hits of one input as lines over frequency with coherence, to be written; "averages" is the number of records, and the
 * coherence is what they scatter. BF_BAD_FILE: records that do not go together; BF_USAGE: fewer than two, no input. Free both with
 * record_free() and average_free(); after a failure there is nothing to free. O(n log n) a column.
 */
enum bf_status record_average(const struct record records[], size_t n_records, const struct average_options *options,
                              struct record *out, struct average *average, struct bf_error *err);
void average_free(struct average *average);

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

/* The same of times that lie elsewhere and are read in blocks. */
enum { TIMES_BLOCK = 4096 };
struct times {
    const double *x; /* all of them, where there is nothing to read */
    size_t (*read)(void *context, size_t first, size_t n,
                   double x[]); /* n at most, from `first` on; how many there were */
    void *context;
    size_t first, n; /* those in the block */
    double block[TIMES_BLOCK];
};
double times_at(struct times *times, size_t k);
bool times_fit(struct times *times, size_t n, struct number_digits most, double *t0, double *dt, size_t *bad,
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
    uint64_t sensor_faults;                     /* with any flag of BEAM_LIVE_SENSOR */
    uint32_t sensor_flags;                      /* those flags */
    double noise_ratio;                         /* mean of the ratio over the stretch's last tenth */
};
struct recording_summary recording_summarise(const struct recording *recording);

/*
 * The stretch as a record: time_s, INPUT, OUTPUT, predicted, residual, ratio, sequence, step, codes, status, innovation, innovation_ratio. Time 0 is the
 * model's step 0 when the stretch has it (or begins in the first `prescale` steps), else its first sample. latency: samples
 * by which the board's measured values and predictions lag its input. It is undone for OUTPUT, which fits read, and left in
 * the others, which replays compare. BF_DEVICE with fewer than 2 samples. Write with 10 digits: then every single and
 * every 32-bit number survives.
 */
enum { RECORDING_DIGITS = 10 };
enum bf_status recording_make_record(const struct recording *recording, const struct recording_summary *summary,
                                     const char *input, const char *output, int latency, struct record *out,
                                     struct bf_error *err);

/*
 * FREQUENCY LIST — frequencies that somebody measured, one mode a line: frequency_Hz, and where they are known its standard error in Hz, the damping ratio and its
 * standard error; a first line of names gives the columns in any order (mode, freq_Hz, sd_Hz, damping_ratio, damping_sd, shape_at_0.12_m ...), and cells
 * may then be empty. Separated by commas, semicolons or blanks; '#' lines are comments.
 */
enum { FREQUENCY_LIST_MOST = 64, FREQUENCY_LIST_PLACES = 64 };
struct measured_frequency {
    double frequency_Hz, sd_Hz;       /* sd_Hz 0: not known */
    double damping_ratio, damping_sd; /* NAN, 0: not known */
    size_t mode;                      /* of the model, 1 the lowest; 0: not said */
};
struct frequency_list {
    size_t n;
    struct measured_frequency *modes; /* [n] ascending */
    size_t n_places;                  /* at which shapes were measured */
    double place_m[FREQUENCY_LIST_PLACES];
    double *shape;   /* [n][n_places] deflection in any unit, one for each mode; NAN: not known */
    char sha256[65]; /* of the file's bytes */
};

/* BF_BAD_FILE: "file:line: ..." what is wrong. Free with frequency_list_free(); after a failure there is nothing to free. */
enum bf_status frequency_list_read(const char *path, struct frequency_list *out, struct bf_error *err);
void frequency_list_free(struct frequency_list *list);
/* A first line of names that is one of a list: mode, freq_Hz or frequency_Hz, and no response ("OUTPUT/INPUT_..."). */
bool frequency_list_begins(const char *line, const char *end);
/* As columns of a record of RECORD_FREQUENCIES (shapes left out), and back. path may be NULL; record_free(), frequency_list_free(). */
void frequency_list_to_record(const struct frequency_list *list, const char *path, struct record *out);
void frequency_list_of_record(const struct record *record, struct frequency_list *out);

/* UFF — a frequency response as a Universal File Format 58, for other programs to overlay. What an axis is, by the numbers of the format (dataset 58, specific data type). */
enum uff_quantity {
    UFF_UNKNOWN = 0,
    UFF_DISPLACEMENT = 8,
    UFF_VELOCITY = 11,
    UFF_ACCELERATION = 12,
    UFF_FORCE = 13,
    UFF_FREQUENCY = 18
};

struct uff_response {
    const char *output, *input; /* names; written as the title, "OUTPUT/INPUT" */
    size_t output_node, input_node;
    enum uff_quantity output_quantity, input_quantity;
    const char *output_unit, *input_unit;
    double first_Hz, step_Hz;
    size_t n;
    const double _Complex *H; /* [n] */
};

/* One dataset, complex double precision, as text: values to 12 digits. Write errors show in the stream. */
void response_write_uff(FILE *out, const struct uff_response *response, const char *comment);

#endif
