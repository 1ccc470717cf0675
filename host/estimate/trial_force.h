/* SPDX-License-Identifier: GPL-3.0-or-later */
/* trial_force.h — the force of a candidate's law along a motion, and its response; private to estimate/. */
#ifndef BEAMFIT_TRIAL_FORCE_H
#define BEAMFIT_TRIAL_FORCE_H

#include "estimate.h"
#include "motion.h"
#include "response/response.h"

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
    double **w, **v; /* [n_records]: [n · oversample][d]; NULL before the first place */
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

#endif
