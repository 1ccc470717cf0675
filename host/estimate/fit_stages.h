/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_stages.h — a fit in windows that grow, down to whole records; private to estimate/. */
#ifndef BEAMFIT_FIT_STAGES_H
#define BEAMFIT_FIT_STAGES_H

#include "fit_problem.h"

struct progress;
struct tried;

/*
 * The windows e^(−s t): s falls from about 4.5 times the first frequency (a fifth of its period is seen) until
 * the window is longer than the records, then 0. At large s only the first instants count, where no phase error has
 * grown, so that the fit has one minimum; each window starts where the one before ended (continuation).
 */
struct staircase {
    double first_ps;  /* largest s */
    double longest_s; /* longest record */
    bool gentle;      /* s/3 in every step: the phase of a nonlinear motion drifts faster than a linear one's */
    const struct predict_options
        *predict;        /* gentle: to look how far the motion can be predicted, refit_horizon.h; NULL: not */
    int iterations;      /* of the last step, per reduced space */
    int rounds;          /* reduced spaces of the last step, at most */
    double nats;         /* the last step ends when the log likelihood would rise by less: fit_problem_end_within() */
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

#endif
