/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * reconstruct.h — the missing force, when no effect of the catalogue explains the residual: where one scalar force would
 * have to act, what it was in time, and what it looks like against displacement, velocity, amplitude and frequency.
 *
 * For each place g the force is the Wiener estimate f̂ from all channels of a record, the baseline's parameters being
 * fitted at the same time. Records with two or more channels tell places apart; with one channel any place will do.
 */
#ifndef BEAMFIT_RECONSTRUCT_H
#define BEAMFIT_RECONSTRUCT_H

#include "motion.h"

enum { RECONSTRUCT_BINS = 24, RECONSTRUCT_TEXT = 400 };

enum reconstruct_place { RECONSTRUCT_POINT, RECONSTRUCT_PATCH, RECONSTRUCT_SPREAD };

struct reconstruct_site {
    enum reconstruct_place place;
    double at_m;        /* RECONSTRUCT_POINT */
    double unexplained; /* part of the residual's weighted square that a force there leaves, 0 … 1 */
};

/* One record's force and motion at the chosen place, [n] each, on the record's samples. */
struct reconstruct_record {
    size_t record, n;
    double dt_s;
    double *f, *w, *v; /* N (N·m at the patch), m (rad), m/s (rad/s); f on the left side: positive opposes w > 0 */
};

struct reconstruction {
    size_t n_sites;
    struct reconstruct_site *sites; /* best first */
    bool located;                   /* the records tell places apart, and the best is clearly better */
    struct reconstruct_site best;
    size_t n_records;
    struct reconstruct_record *records; /* without free decays */
    /* what the force looks like, shares of its square, 0 … 1 */
    double elastic_share, elastic_odd, elastic_even; /* explained by a function of w: all, its odd, its even part */
    double dissipative_share;                        /* more explained by an odd function of v, after that of w */
    double linear_share;                             /* explained by k w + d v alone: a linear spring or damper */
    double memory_share;     /* not explained by any function of (w, v) at the moment; noise included */
    double dissipated_share; /* mean f v over rms f · rms v, −1 … 1: > 0 takes energy out */
    double amplitude_power;  /* rms f grows as rms w to this power between records (NaN: one level only) */
    double frequency_Hz;     /* where most of |F| is */
    double band_share;       /* part of its square within 5 % of that */
    bool resonant;           /* it stays at that frequency whatever the input does */
    bool sensor_like;        /* one channel carries the misfit while others of the same records do not */
    char channel[MODEL_NAME];
    /* binned curves over all records, for plotting: mean force at w, and at v after the curve in w is removed */
    double w_bin[RECONSTRUCT_BINS], f_of_w[RECONSTRUCT_BINS];
    double v_bin[RECONSTRUCT_BINS], f_of_v[RECONSTRUCT_BINS];
    size_t n_lines; /* |F| of the record with the largest force: one-sided amplitude spectrum */
    double df_Hz;
    double *spectrum;
    char text[RECONSTRUCT_TEXT]; /* one or two plain sentences */
};

/* motion: of the baseline; unless the residual is far above the noise everywhere, use all records. */
enum bf_status reconstruct_run(const struct motion *motion, struct reconstruction *out, struct bf_error *err);
void reconstruct_free(struct reconstruction *reconstruction);

#endif
