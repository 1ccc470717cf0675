/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * diagnose_shortlist.h — which effects are worth a refit on top of a hypothesis: those without a law by score test and a few
 * Gauss–Newton steps, laws by the equation-error trial along the measured motion. Both only rank and give start values;
 * refits decide. For diagnose_*.c only.
 */
#ifndef BEAMFIT_DIAGNOSE_SHORTLIST_H
#define BEAMFIT_DIAGNOSE_SHORTLIST_H

#include "diagnose_work.h"

/* Kinds of candidates, in the order of their price. */
enum effect_kind {
    KIND_LINEAR, /* terms, filters, signals, places */
    KIND_BENT,   /* drives and sensors that are not linear: still no step through time */
    KIND_LAW     /* forces that are not linear */
};
enum effect_kind effect_kind(const struct beam_effect *effect);

/* diagnose_bare.c: a hypothesis with laws as a linear model, and records without the laws' share. */
struct bare {
    struct model model;
    size_t n_records;
    struct record *records;
};
enum bf_status bare_new(const struct diagnose_work *w, const struct hypothesis *h, struct bare *out,
                        struct bf_error *err);
void bare_free(struct bare *bare);

struct shortlist {
    struct diagnose_work *w;
    const struct hypothesis *from;
    bool has_law; /* of `from`: its scores are those of `bare` */
    struct bare bare;
    size_t n_effects;              /* of the new hypotheses */
    bool first_order;              /* scores are not refined: they only tell whether anything is left */
    const struct ar_model *colour; /* [channels] of the noise in units of sigma; NULL: white */
    struct candidate_list list;
    struct score_base *base;                 /* NULL: not needed yet */
    struct score *scores;                    /* [list.n] */
    size_t *order[2], n_order[2], looked[2]; /* of KIND_LINEAR and KIND_BENT, best first; how many were refitted */
    bool linear; /* records of two levels agree, and the misfit is large: only laws of degree one are possible */
    bool tried;  /* trials are there */
    struct trial *trials; /* best first */
    size_t n_trials, refitted_laws;
};

enum bf_status shortlist_new(struct diagnose_work *w, const struct hypothesis *from, struct shortlist *out,
                             struct bf_error *err);
void shortlist_free(struct shortlist *s);
/* Scores of KIND_LINEAR or KIND_BENT; nothing when they are there already. */
enum bf_status shortlist_score(struct shortlist *s, enum effect_kind kind, struct bf_error *err);
/* Fall of the misfit (in units of the noise) that the best score of a kind promises by one step; 0 when none is likely. */
double shortlist_fall(const struct shortlist *s, enum effect_kind kind);
/* Trials of the laws; nothing when they are there already, or when the hypothesis itself has a law (no motion then). */
enum bf_status shortlist_try_laws(struct shortlist *s, struct bf_error *err);
/* Rms in units of the noise that a candidate leaves after its few steps. */
double shortlist_left(const struct shortlist *s, size_t candidate);
/* Refits of a kind, at most so many, that may come near `best` (rms in units of the noise), start values included. */
void shortlist_choose(struct shortlist *s, enum effect_kind kind, size_t most, double best, struct refit_job **jobs,
                      size_t *n);
/* The law with the best trial, although that promised too little to be chosen: for a beam that is not linear and not explained. */
void shortlist_choose_last(const struct shortlist *s, double best, struct refit_job **jobs, size_t *n);

/*
 * diagnose_given.c: linear candidates, best score first, refitted from the model as given (diagnose_as_given()) and not from the fitted
 * baseline. Ranks. `from` must be the baseline. Linear refits, some tenths of a second to a second each.
 */
enum bf_status shortlist_from_given(struct shortlist *s, double span, struct bf_error *err);

#endif
