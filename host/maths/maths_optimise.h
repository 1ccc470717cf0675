/* SPDX-License-Identifier: GPL-3.0-or-later */
/* maths_optimise.h — least squares within bounds; part of maths.h */
#ifndef BEAMFIT_MATHS_OPTIMISE_H
#define BEAMFIT_MATHS_OPTIMISE_H

#include <stdbool.h>
#include <stddef.h>

#include "ground/ground.h"

/*
 * OPTIMISE — minimisation of a sum of squares ½‖r(x)‖² within bounds. Only optimise.c sees NLopt.
 *
 * The local search is a Gauss–Newton trust-region method (optimise_local.c), because NLopt's gradient methods see only the value and the
 * gradient and need several times as many evaluations as a method that sees JᵀJ, which costs little once the Jacobian is
 * there. NLopt searches a box (controlled random search, DIRECT, multi-level single linkage) and checks the result at the
 * end by a gradient method of its own.
 */

/* A least-squares problem in n unknowns. Unknowns should be scaled so that steps of 1 are large (logarithms are). */
struct least_squares {
    size_t n;
    const double *lower, *upper; /* [n], ±INFINITY where there is none; NULL: no bounds at all */
    void *context;
    /* ½‖r(x)‖² (r includes the rows of priors). BF_NUMERIC: there is no value at x, the step is shortened. */
    enum bf_status (*value)(void *context, const double x[], double *half_square, struct bf_error *err);
    /*
     * Value, gradient[n] = Jᵀr and gram[n × n] = JᵀJ. The problem may refine itself before (a rebased model), so this
     * value may differ slightly from that of value(); later values must be consistent with this one. A step that it shows to
     * have gone uphill is taken back.
     */
    enum bf_status (*derivative)(void *context, const double x[], double *half_square, double gradient[], double gram[],
                                 struct bf_error *err);
    bool (*interrupted)(void *context); /* may be NULL; asked before every evaluation */
};

struct optimise_options {
    int iterations;    /* accepted or rejected steps at most, each with a step back from a wall at most; 0: 50 */
    double radius;     /* first trust radius, 2-norm of a step; 0: 0.5 */
    double radius_max; /* 0: 4 */
    double tolerance;  /* stop when a full step would lower ½‖r‖² by less than this; 0: 1e-6 */
    double relative;   /* … or by less than this share of ½‖r‖², or when the last six steps together have */
    double form;       /* the same of what ½‖r‖² has above `noise` */
    double noise;      /* ½‖r‖² of noise alone; only with `form` */
    double
        give_up_above; /* stop when ten times the predicted fall of ½‖r‖² would not bring it down to this; 0: never */
    double enough; /* stop without another derivative when ½‖r‖² is at most this: no `decrement` then; 0: never */
    double rank;   /* directions with eigenvalue of JᵀJ below rank × the largest are not moved; 0: 1e-13 */
};

enum optimise_end { OPTIMISE_CONVERGED, OPTIMISE_ITERATIONS, OPTIMISE_STALLED, OPTIMISE_INTERRUPTED, OPTIMISE_GAVE_UP };

struct optimise_result {
    enum optimise_end end;
    double half_square;
    double decrement; /* predicted fall of ½‖r‖² of one more full step: half the squared distance in standard errors */
    int values, derivatives;
};

/*
 * Trust-region Gauss–Newton with an active set for the bounds. x[n] in/out: the best point found, also after an
 * interruption. Along null directions of J the step has minimum norm, so they stay where they were. Fails only when
 * there is no value at the start.
 */
enum bf_status optimise_local(const struct least_squares *problem, const struct optimise_options *options, double x[],
                              struct optimise_result *out, struct bf_error *err);

/*
 * The predicted fall of ½‖r‖² of the full Gauss–Newton step from x, given gradient[n] and gram[n × n], and the step
 * itself (NULL: not wanted). Unknowns at a bound that the gradient presses against are held; 0 at a stationary point.
 */
enum bf_status optimise_decrement(const struct least_squares *problem, const double x[], const double gradient[],
                                  const double gram[], double rank, double *decrement, double step[],
                                  struct bf_error *err);

/*
 * Independent check by NLopt's gradient method (SLSQP) in whitened unknowns, from x: does a method that shares nothing
 * with optimise_local() find a lower value? x is replaced when it does; *gain is the fall of ½‖r‖².
 */
enum bf_status optimise_polish(const struct least_squares *problem, int evaluations, double x[], double *gain,
                               struct bf_error *err);

enum optimise_search { OPTIMISE_CRS, OPTIMISE_DIRECT, OPTIMISE_MLSL };

/*
 * Search of a box by NLopt with at most `evaluations` values (MLSL: of values and derivatives). Bounds of the problem
 * must be finite. x[n] in/out. Deterministic: the seed is fixed.
 */
enum bf_status optimise_global(const struct least_squares *problem, enum optimise_search search, int evaluations,
                               double x[], double *half_square, struct bf_error *err);

#endif
