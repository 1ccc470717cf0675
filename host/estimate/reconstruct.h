/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * reconstruct.h — the missing force, when no effect of the catalogue explains the residual: where it acts, what it was in
 * time, and what it looks like against displacement, velocity, amplitude and frequency.
 *
 * At each place two questions are asked, the baseline's parameters free in both: which part of the residual does a
 * force explain that is some function of displacement and velocity there (a regression on powers, steps and hinges of the
 * measured motion, one function for all records); and which part does any history of a force there explain (the Wiener
 * estimate from all channels of a record). The first tells places apart even with one channel, if the force is such a
 * function; the second needs records with two or more channels.
 */
#ifndef BEAMFIT_RECONSTRUCT_H
#define BEAMFIT_RECONSTRUCT_H

#include "motion.h"

enum { RECONSTRUCT_BINS = 24, RECONSTRUCT_TEXT = 600 };

enum reconstruct_place { RECONSTRUCT_POINT, RECONSTRUCT_PATCH, RECONSTRUCT_SPREAD };

struct reconstruct_site {
    enum reconstruct_place place;
    double at_m;       /* RECONSTRUCT_POINT */
    double by_law;     /* part of the weighted residual's square that no function of (w, v) there explains, 0 … 1 */
    double by_history; /* that no force there explains, in records of two or more channels; NaN when none has two */
};

/* One record's force and motion at the chosen place, [n] each, on the record's samples. */
struct reconstruct_record {
    size_t record, n;
    double dt_s;
    double *f, *w, *v; /* N, m, m/s at a point; N·m, rad, rad/s at the patch; N/m, m², m²/s spread (w = ∫ y dx).
                          f stands on the left side of the weak form: a spring has f = k w */
};

struct reconstruction {
    size_t n_sites;
    struct reconstruct_site *sites; /* best first: by_law where some place explains the main part so, else by_history */
    bool is_law;                    /* the first */
    bool located;                   /* the best place is clearly better than others away from it */
    struct reconstruct_site best;
    size_t n_records;
    struct reconstruct_record *records; /* without free decays */
    /* What the force at the best place looks like: shares of the residual's square that go away, 0 … 1. */
    double linear;                    /* with k w + d v alone */
    double elastic_odd, elastic_even; /* with odd functions of w; with even ones beside them */
    double dissipative;               /* with odd functions of v beside all functions of w */
    double memory;                    /* what stays: hysteresis, a force from outside, noise, or the wrong place */
    bool hardening, drag;             /* the odd part grows faster than w; the part of v faster than v */
    double dissipated;                /* mean f v/(rms f · rms v), −1 … 1: > 0 takes energy out */
    double amplitude_power;           /* rms f grows as rms w to this power between records; NaN: one level only */
    double frequency_Hz;              /* of the largest line of |F| */
    double band_share;                /* part of its square within 5 % of that, least of all records */
    bool resonant;                    /* every record has its force there, and no mode of the baseline does */
    bool sensor_like;                 /* one output carries the misfit in every record and no other shows any */
    char channel[MODEL_NAME];
    /* Binned curves for plotting, of the record with the largest force: its mean at w, and what is left of it at v. */
    size_t strongest; /* index into records */
    double w_bin[RECONSTRUCT_BINS], f_of_w[RECONSTRUCT_BINS];
    double v_bin[RECONSTRUCT_BINS], f_of_v[RECONSTRUCT_BINS];
    size_t n_lines; /* |F| of the same record: one-sided amplitude spectrum */
    double df_Hz;
    double *spectrum;
    char text[RECONSTRUCT_TEXT]; /* one or two plain sentences */
};

/* motion: of the baseline fitted to all records or to the weak ones. About 1 s for 4 records of 4096 samples. */
enum bf_status reconstruct_run(const struct motion *motion, struct reconstruction *out, struct bf_error *err);
void reconstruct_free(struct reconstruction *reconstruction);

#endif
