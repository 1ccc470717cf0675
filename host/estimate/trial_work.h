/* SPDX-License-Identifier: GPL-3.0-or-later */
/* trial_work.h — what trial.c (candidates), trial_search.c, trial_force.c (one force) and trial_roles.c share; for nobody else. */
#ifndef BEAMFIT_TRIAL_WORK_H
#define BEAMFIT_TRIAL_WORK_H

#include "response/response.h"
#include "regression.h"
#include "estimate.h"
#include "trial.h"

/* A candidate's law, bound to a motion. */
struct trial_force {
    const struct motion *motion;
    struct model model; /* the baseline's with the effect appended */
    struct parameter_ref *refs;
    size_t n_parameters;
    struct parameter_map map;
    double *theta; /* [n_parameters]: the baseline's, then the effect's */
    size_t effect; /* index in model.effects */
    struct law law;
    int oversample;
    double **w, **v; /* [n_records]: [n · oversample][d]; NULL for free decays and before the first place */
    double **a;      /* the same of the acceleration; [record] NULL where the law does not ask for it */
    bool placed;
    struct motion_paths paths;
    double *F_work; /* [longest record · oversample][d] */
    size_t evaluations;
};

enum bf_status trial_force_new(const struct motion *motion, const struct beam_effect *effect, struct trial_force *out,
                               struct bf_error *err);
void trial_force_free(struct trial_force *force);
/* Bind the place that p gives: motion and paths there. Nothing to do when it is in use already. */
enum bf_status trial_force_place(struct trial_force *force, const double p[BEAM_EFFECT_PARAMETERS],
                                 struct bf_error *err);
/* Largest |w| and |v| over all records at the place in use (of the first coordinate). */
void trial_force_scales(const struct trial_force *force, double *w, double *v);
/*
 * rows[n_rows] = −H f along the motion at the effect's parameters p. BF_NUMERIC where the law refuses p or its force is
 * not finite.
 */
enum bf_status trial_force_rows(struct trial_force *force, const double p[BEAM_EFFECT_PARAMETERS], double rows[],
                                struct bf_error *err);

/* The motion (force->motion is this one) is renewed with the effect's force at p believed to act, `times` times. */
enum bf_status trial_force_assume(struct trial_force *force, struct motion *motion,
                                  const double p[BEAM_EFFECT_PARAMETERS], int times, struct bf_error *err);

/* What each parameter is to the trial. */
struct trial_roles {
    int strength;                                  /* the force is linear in it */
    bool with_strength[BEAM_EFFECT_PARAMETERS];    /* the strength and levels of force: scaled together */
    int position;                                  /* −1: none */
    int n_inner, inner[BEAM_EFFECT_PARAMETERS];    /* scanned, the position left out */
    enum beam_level scale[BEAM_EFFECT_PARAMETERS]; /* what an inner parameter is compared with */
};
enum bf_status trial_roles(const struct trial_force *force, struct trial_roles *out, struct bf_error *err);
/* The quantity that inner parameter `slot` is compared with, at the place in use; its start for BEAM_LEVEL_OWN. */
double trial_unit(const struct trial_force *force, const struct trial_roles *roles, int slot);

/* One trial point: parameters with the strength estimated. */
struct trial_point {
    double p[BEAM_EFFECT_PARAMETERS];
    double factor; /* estimated strength over the one that the force was computed with */
    double fall;   /* of χ²; 0 where the force is nothing new, or its sign is against the range */
    double norm2;  /* ‖S̃‖² */
};

/* ---- trial_search.c: one effect along one motion ---- */

struct trial_search {
    const struct motion *motion;
    const struct regression *regression;
    struct trial_force force;
    struct trial_roles roles;
    const struct parameter *info; /* [n_parameters] of the effect, in the model */
    double *rows, *s;             /* [n_rows], [m] */
    const double *measure;        /* [n_channels] weights of the χ² that is reported, the same for all candidates */
    struct trial_point best;
};

/* regression NULL: bound later, with trial_search_bind(). */
enum bf_status trial_search_new(const struct motion *motion, const struct regression *regression,
                                const struct beam_effect *effect, struct trial_search *out, struct bf_error *err);
void trial_search_bind(struct trial_search *search, const struct regression *regression);
void trial_search_free(struct trial_search *search);
/* From nothing: thresholds and places on grids, then refined. */
void trial_search_scan(struct trial_search *search, const struct trial_options *options, struct bf_error *err);
/* From parameters that are nearly right. */
void trial_search_resume(struct trial_search *search, const double p[BEAM_EFFECT_PARAMETERS],
                         const struct trial_options *options);
/* The best point into *out, whose theta[] is there; possible is false when nothing helped. */
enum bf_status trial_search_answer(struct trial_search *search, struct trial *out, struct bf_error *err);

#endif
