/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * refit_search.h — starts of the effects that are new to a model, and the staircase from the best; private to
 * estimate/. Used by refit_run() and, for nonlinear effects, by fit_run().
 */
#ifndef BEAMFIT_REFIT_SEARCH_H
#define BEAMFIT_REFIT_SEARCH_H

#include "fit_stages.h"

struct refit_search {
    struct fit_problem *p;
    struct staircase stairs;
    size_t first_effect;    /* effects from here on are new */
    const double *baseline; /* [n_refs] the model without the new law, fitted: its trial begins there; NULL: no trial */
    bool quick;             /* half the starts, and only the best goes down */
    bool near;              /* theta0 is near the optimum: whole records at once, no other start */
    double *theta0;         /* [n_refs] where the rest begins */
    size_t n_starts;        /* further starts, on whole records */
    const double *starts;   /* [n_starts][n_refs] */
    double raise_below;     /* as of struct refit_options; best_raise_vanished(), which laws always go through */
    struct predict_options predict;
    struct progress *bar; /* may be NULL */
    size_t tried;         /* out: starts that were tried */
};

/*
 * Linear effects: a grid of thresholds, time constants and places, the amount by the linearised problem, a few steps in a
 * short window; the best again in one ten times as long; the best two down the staircase until one explains the records.
 * Near: the last step of the staircase alone. Nonlinear ones: law_trial() first; then the starts of law_starts(), windows in steps of three. x[n_unknowns]: the best, with the scales of p then;
 * p is in the stage of whole records there (up to the horizons, refit_horizon.h); BF_NUMERIC when no start has a value.
 */
enum bf_status refit_search_run(struct refit_search *t, double x[], struct optimise_result *found,
                                struct bf_error *err);

#endif
