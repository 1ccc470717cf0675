/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_stages.h — the order of a fit: staircase of windows, search, polish; inside the fit stage only. */
#ifndef BEAMFIT_FIT_STAGES_H
#define BEAMFIT_FIT_STAGES_H

#include "fit_problem.h"

struct progress;
struct tried;

/*
 * The ladder of windows e^(−s t): s falls from about 4.5 times the first frequency (a fifth of its period is seen) until
 * the window is longer than the records, then 0. A window turns the maze of local minima of a time-domain fit into a
 * homotopy: at large s only the first instants count, where no phase error can have grown.
 */
struct staircase {
    double first_ps;  /* largest s */
    double longest_s; /* longest record */
    bool gentle;      /* s/3 in every step: the phase of a nonlinear motion drifts faster than a linear one's */
    const struct predict_options
        *predict;    /* gentle: to look how far the motion can be predicted, refit_horizon.h; NULL: not */
    int iterations;  /* of the last step, per reduced space */
    int rounds;      /* reduced spaces of the last step, at most */
    double relative; /* the last step ends when ½‖r‖² would fall by less than this share, divided by the rows */
    struct tried *tried; /* where the end of every window is noted (fit_tried.h), unless gentle; NULL: not */
};
struct staircase staircase_for(const struct model *model, const struct record records[], size_t n_records);

/* From x through every window down to the whole records with the weights of the noise. x[n_unknowns] in/out. */
enum bf_status staircase_run(struct fit_problem *p, const struct staircase *stairs, struct progress *bar, double x[],
                             struct optimise_result *out, struct bf_error *err);
/* The last step alone: whole records, weights of the noise, rebased until the optimum stays where it is. */
enum bf_status staircase_last(struct fit_problem *p, const struct staircase *stairs, double x[],
                              struct optimise_result *out, struct bf_error *err);
/* One window, weights with the usual floor of 2 % of the windowed signal. */
enum bf_status staircase_step(struct fit_problem *p, double decay_ps, int iterations, double x[],
                              struct optimise_result *out, struct bf_error *err);
/* Residual of the last evaluation in floors, over the rows that count: rows that have decayed to nothing are not rows. */
double staircase_misfit(const struct fit_problem *p);

/*
 * Effects that are a sinusoid of unknown amplitude and phase (hum, base motion) have a minimum in every wrong phase, and
 * nothing to say in a short window. phases_hold() takes them out (amplitude 0, not moved); phases_find() puts them back
 * where the residual of the whole records says: a linear fit of sine and cosine per record, at the best of the start and
 * the six most prominent lines of the residual's spectrum when the frequency is free.
 */
void phases_hold(struct fit_problem *p, double x[]);
enum bf_status phases_find(struct fit_problem *p, double x[], struct bf_error *err);
/* Free phases into −π … π; the prediction stays. */
void phases_wrap(const struct fit_problem *p, double x[]);

/* Minima found by a search, best first, each a whole θ[n_refs]: scales of x change between them. */
struct minima {
    size_t n, room;
    double *half_square;
    double *theta; /* [room][n_refs] */
};
struct minima minima_new(size_t room, const struct fit_problem *p);
/* Keeps the best `room` distinct ones: two are the same when ½χ² agrees to 1 % (or 1) and x to 0.1. */
void minima_add(struct minima *minima, const struct fit_problem *p, const double theta[], double half_square);
void minima_free(struct minima *minima);

/*
 * Global stage: scales, signs and places of effect parameters, and a controlled random search (NLopt) over what sets the
 * frequencies, all at the cheapest window; the best few go through the staircase. start: θ[n_refs]. What comes out is added to
 * minima.
 */
enum bf_status search_run(struct fit_problem *p, const struct model *model, const struct staircase *stairs,
                          struct progress *bar, const double start[], struct minima *minima, struct bf_error *err);

#endif
