/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * predict_pieces.h — a long record of a linear model, predicted piece by piece, so that what a prediction needs besides its rows does not grow with the record;
 * private to response/.
 *
 * A linear beam forgets: what was before has died out to 1e-12 after ln(1e12)/(−Re p) of its slowest pole p. Each piece begins that
 * long before its first row, and goes on past its last one for as long as the band-limited inputs ring backwards, so that its rows are
 * those of the whole record. Not for laws, drives, bent maps and signals, initial states, shaken clamps, and beams that do not forget.
 */
#ifndef BEAMFIT_PREDICT_PIECES_H
#define BEAMFIT_PREDICT_PIECES_H

#include "predictor.h"

struct pieces {
    const struct record *whole;          /* its samples where there is no stream */
    const struct predict_stream *stream; /* that reads them; NULL: there is none */
    struct record record;                /* one piece, with samples of its own */
    size_t early;                        /* samples that a piece begins before its first row */
};

/* Rows from … end − 1 of a record, of samples start … start + n − 1. */
struct piece {
    size_t start, from, end;
};

/* Of a predictor at its base: can such records be predicted in pieces, and is any of them long enough? */
bool pieces_possible(const struct predictor *p);
bool pieces_wanted(const struct predictor *p);
/* Samples after which nothing is left of what was before, at the poles as last evaluated and theta (NULL: at the base); INFINITY. */
double pieces_memory(const struct predictor *p, size_t record, const double theta[]);
/* NULL: the record is one piece. It is borrowed. */
struct pieces *pieces_new(const struct model *model, const struct record *record, double memory,
                          const struct predict_stream *stream);
void pieces_free(struct pieces *pieces);
/* n rows take several pieces. */
bool pieces_several(const struct pieces *pieces, size_t n);
/* The next piece of n rows, from {0} on; false: that was the last. */
bool pieces_next(const struct pieces *pieces, size_t n, struct piece *piece);
/* The record's predictor, to be windowed anew, has this piece, or the first samples (pieces NULL: of the whole record). */
void pieces_load(struct pieces *pieces, struct predictor *own, size_t n, const struct piece *piece);
void pieces_first(struct pieces *pieces, struct predictor *own);

#endif
