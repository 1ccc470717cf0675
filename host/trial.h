/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * trial.h — would this nonlinear effect explain the residual? An equation-error trial: the force that the effect would
 * exert along the measured motion (motion.h) is computed once, its response is regressed on the residual together with the
 * baseline's parameters. No simulation, so no local minima and no stability limits; start values for a refit come out.
 *
 *     W r ≈ W (J Δθ + a S(p)),   S(p) = −H f(ŵ, ŵ_t; p),   priors as rows
 *
 * Parameters in which the force is not linear (flag INNER: place, gap, threshold, rate) are scanned: places along the span,
 * levels (enum beam_level) of the coordinate, its rate, or strength × either on the scale of the measured motion,
 * others on a logarithmic grid about the catalogue's start. Then refined, the motion and θ renewed, and again.
 */
#ifndef BEAMFIT_TRIAL_H
#define BEAMFIT_TRIAL_H

#include "motion.h"

struct trial_options {
    int rounds;          /* renewals of θ and the motion after the scan, at most; 0: none (a score), 3: start values */
    bool keep_positions; /* positions stay at the catalogue's start */
};

struct trial {
    const struct beam_effect *effect;
    bool possible;                    /* false: no valid force along this motion, or its sign is against the range */
    double p[BEAM_EFFECT_PARAMETERS]; /* start values, catalogue order, SI (places in metres) */
    double *theta;                    /* [n_parameters] baseline parameters to start from with the effect */
    double strength, strength_sd;     /* the parameter in which the force is linear, and one standard error */
    double chi_square_baseline;       /* weighted, rows and priors, after the best Δθ without the effect */
    double chi_square;                /* with it */
    double share;                     /* 1 − chi_square/chi_square_baseline, 0 … 1; the score that ranks */
    double p_value;                   /* of the strength, F test with the effective number of samples */
    double unexplained;               /* √(chi_square/rows): 1 is the noise when the weights have no floor */
    size_t forces;                    /* evaluations of the force over all records */
};

/* true when the effect has a law and its trial is defined. */
bool trial_possible(const struct beam_effect *effect);
/* One candidate along a motion. Free with trial_free(). Cost: about 5 ms a force for 4 records of 4096 samples. */
enum bf_status trial_run(const struct motion *motion, const struct beam_effect *effect,
                         const struct trial_options *options, struct trial *out, struct bf_error *err);
void trial_free(struct trial *trial);
/* All laws of the catalogue that the model does not have, best first; *n of them, free each and the array. */
enum bf_status trial_all(const struct motion *motion, const struct trial_options *options, struct trial **out,
                         size_t *n, struct bf_error *err);

#endif
