/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * attainable_problem.h — private to noise/: attainable.c calls attainable_start.c (start poles), attainable_noise.c, attainable_records.c (what is fitted) and
 * attainable_search.c (rounds), which calls attainable_rows.c (records at given poles, on the lines of attainable_lines.c),
 * attainable_stack.c (residues) and attainable_poles.c (better poles). attainable_residues.c: the residues at the end. attainable_gain.c: the answer of one record's free linear model to noise.
 *
 * A pair of poles is a quadratic q = s² + 2as + ω², kept as x[2k] = ln ω, x[2k + 1] = ln a: stable, and two real poles where a > ω.
 * Its columns for an input u are ω²u/q and ω s u/q; an initial state has the same columns with a pulse for u.
 */
#ifndef BEAMFIT_ATTAINABLE_PROBLEM_H
#define BEAMFIT_ATTAINABLE_PROBLEM_H

#include "noise.h"
#include "response/response.h"

enum { ATTAINABLE_PATHS = 3 }; /* columns of what lies above the band: u, u', u'' */

/* One recorded input of one record. */
struct attainable_source {
    size_t slot;       /* which residues it takes: those of the input, or its own where the level is unknown */
    const double *u;   /* [n] */
    double complex *U; /* [grid.m] */
    double *path[ATTAINABLE_PATHS]; /* [n] */
};

/* One output of one record. */
struct attainable_data {
    size_t record, output, channel; /* channel: its number among all channels, the same in all pieces of a record */
    const double *z;                /* [n] */
    double noise, rms;              /* noise 0: unknown */
    double complex *Y;              /* [grid.m] */
};

/*
 * A record, or one piece of a long one. A piece that is not the first begins in a motion of its own, so that what was before need not be known; its inputs
 * are led in and out by the samples on both sides, until their edges have rung out. Only one piece at a time is on its line.
 */
struct attainable_record {
    size_t n, n_whole;  /* samples; and of the record that this is a piece of */
    size_t lead, after; /* samples before and behind them, by which inputs are led in and out */
    bool first;         /* or only piece of its record */
    bool moving;        /* does not begin at rest */
    bool periodic;      /* one period of a steady state */
    double dt_s, window_rate;
    size_t n_rings; /* recorder_rings() */
    double complex ring[RECORDER_RINGS];
    bool open, measured;       /* on its line, see attainable_open(); its channels, too */
    struct response_grid grid; /* of lead + n + after samples, while open */
    size_t n_sources, n_data;
    struct attainable_source *sources;
    struct attainable_data *data;
};

/*
 * The rows of a record compressed: R of X = Q R with columns [states, residues, extra, measured]. What is orthogonal to
 * the states (two columns for each pair of poles, then the recorder's) starts at row n_states. extra: derivatives of the pole columns, or measured channels
 * seen through the poles.
 */
struct attainable_rows {
    size_t n, n_states, n_residues, n_extra;
    double *R; /* [n × n] */
};

enum attainable_extra { EXTRA_NONE, EXTRA_DERIVATIVES, EXTRA_MEASURED };

/* What is fitted. */
struct attainable_problem {
    size_t m, n_slots, n_outputs, n_channels;
    size_t n_records; /* with the pieces of long ones each */
    struct attainable_record *records;
    double form_error; /* τ: relative error of the form, which weighs a channel beside its noise */
    bool rough;        /* the best poles to some per cent will do: spare pairs are put to no use */
};

static inline size_t attainable_block(const struct attainable_problem *p)
{
    return 2 * p->m + ATTAINABLE_PATHS;
}

/* Rows of every record at poles x[2m]; free each R. */
enum bf_status attainable_compress(const struct attainable_problem *problem, const double x[],
                                   enum attainable_extra extra, struct attainable_rows rows[], struct bf_error *err);
void attainable_rows_free(struct attainable_rows rows[], size_t n);

/* ---- attainable_stack.c: all rows of one output, weighted ---- */

/* A channel's rows in it. */
struct attainable_part {
    const struct attainable_record *record;
    const struct attainable_rows *rows;
    size_t data, channel; /* in the record; in all */
    size_t first, n;      /* rows of the stack */
    double weight;        /* 1/√(noise² + τ² rms²) */
};

struct attainable_stack {
    size_t n_parts, n, columns; /* n rows */
    struct attainable_part *parts;
    size_t *column; /* [n_slots] first residue of the slot; SIZE_MAX: no record has it */
    double *A, *z;  /* [n × columns] of unit length, [n] measured */
    double *length; /* [columns] what A's columns were divided by */
    /* once solved */
    size_t rank;
    double *U, *c, *r; /* [n × rank] basis, [columns] residues, [n] z − A c */
};

void attainable_stack_new(const struct attainable_problem *problem, const struct attainable_rows rows[], size_t output,
                          struct attainable_stack *out);
enum bf_status attainable_stack_solve(struct attainable_stack *stack, struct bf_error *err);
void attainable_stack_free(struct attainable_stack *stack);

/* ½ Σ r²; square[channel] (NULL: not wanted) grows by the unweighted Σ r² of each channel. */
double attainable_squares(const struct attainable_stack *stack, double square[]);

/* X[row, j] += factor × column `from` of a part's rows; X has stride rows. */
void attainable_add_rows(const struct attainable_part *part, double factor, size_t from, size_t stride, double X[],
                         size_t j);
size_t attainable_measured_column(const struct attainable_part *part);

/* Directions with singular values below this share of the largest are not told apart from rounding. */
extern const double attainable_dependent;

/* Best residues. square[n_channels] (NULL: not wanted): Σ r² of each channel, unweighted. */
enum bf_status attainable_value(const struct attainable_problem *problem, const struct attainable_rows rows[],
                                double *half_square, double square[], struct bf_error *err);

/* ---- attainable_poles.c ---- */

/* ½ Σ w² r² with its gradient[2m] and gram[2m × 2m] by x; rows with EXTRA_DERIVATIVES. */
enum bf_status attainable_derivative(const struct attainable_problem *problem, const double x[],
                                     const struct attainable_rows rows[], double *half_square, double gradient[],
                                     double gram[], struct bf_error *err);

/* One step of vector fitting: new poles from x, rows with EXTRA_MEASURED; x_new may be x. BF_NUMERIC: there are none. */
enum bf_status attainable_relocate(const struct attainable_problem *problem, const double x[],
                                   const struct attainable_rows rows[], double x_new[], struct bf_error *err);

/* ---- attainable_lines.c ---- */

/* Transforms of the inputs and, with_measured, of the channels. Nothing is done where they are there. Closed also after a failure. */
enum bf_status attainable_open(struct attainable_record *record, bool with_measured, struct bf_error *err);
void attainable_close(struct attainable_record *record);
/* Is it a piece of a longer record, to be closed after use? */
static inline bool attainable_is_piece(const struct attainable_record *record)
{
    return record->n < record->n_whole;
}

/* ---- attainable_start.c, attainable_noise.c, attainable_records.c, attainable_search.c ---- */

/* qsort() of pairs x[2k], x[2k + 1]: ascending ω. */
int attainable_by_frequency(const void *a, const void *b);
/* x[2m] of the model's poles below top_rad and the next; at least LEAST_MODES. To be freed. */
enum bf_status attainable_start_poles(const struct model *model, double top_rad, size_t *m, double **x,
                                      struct bf_error *err);

/* Adds a record, or its pieces; noise_rms as of attainable_find(), not NULL. */
void attainable_add_record(struct attainable_problem *problem, const struct model *model, const struct record *record,
                           size_t index, const double noise_rms[]);
/* *rms: [n_records · n_outputs] as of noise_of_channel(), 0 where a record lacks the channel; to be freed, also after a failure. */
enum bf_status attainable_noise(const struct model *model, const struct record records[], size_t n_records,
                                double **rms, struct bf_error *err);
void attainable_problem_free(struct attainable_problem *problem);

/* x[2m]: in the start poles, out the best; out: errors, and channels[n_channels] that are there. */
enum bf_status attainable_search(struct attainable_problem *problem, double top_rad, double x[], struct attainable *out,
                                 struct bf_error *err);
/* without[m]: the noise ratio without each pair of x[2m], the best residues of the others anew; NaN where it is not known (long records). Cost: m values. */
void attainable_leave_each_out(struct attainable_problem *problem, double top_rad, double x[], double without[]);
/* residue[m][n_outputs][n_inputs] of the best residues at x[2m], see struct attainable. Cost: one value. */
enum bf_status attainable_residues(struct attainable_problem *problem, const double x[], size_t n_inputs,
                                   double complex residue[], struct bf_error *err);

#endif
