/* SPDX-License-Identifier: GPL-3.0-or-later */
/* score_base.h — the baseline at its optimum, as every score sees it: residual and what it can absorb; private to estimate/. */
#ifndef BEAMFIT_SCORE_BASE_H
#define BEAMFIT_SCORE_BASE_H

#include "estimate.h"

struct score_base {
    const struct model *model;
    const struct record *records;
    size_t n_records;
    struct score_options options;
    const char **names; /* [n_records] base names */
    size_t n_refs;
    struct parameter_ref *refs;
    double *theta; /* [n_refs] */
    size_t n_channels;
    struct predict_channel *channels;
    bool has_decay;
    double *levels;       /* [n_records] factor of the excitation */
    size_t n_rows, n_all; /* rows of data; with the rows of priors */
    double *weight;       /* [n_rows] 1/σ */
    double *fitted;       /* [n_rows] ŷ, unit of the channel */
    double *residual;     /* [n_all] P r̃ */
    size_t rank;          /* of what the baseline can absorb */
    double *absorbed;     /* [rank][n_all] orthonormal basis of it */
    double misfit;        /* ‖P r̃‖² */
    /*
     * Positive parameters that the misfit has driven to 0 (a damping): with a candidate they may come back. Not absorbed;
     * columns of their own, δ ≥ 0.
     */
    size_t n_limited;
    double *limited;     /* [n_limited][n_all] projected */
    double *start_theta; /* [n_refs] theta with these where they can be seen again: for starts of refits */
    double white_misfit; /* Σ (r/σ)² + Σ priors */
};

/* column[n_rows] in units of the channels -> out[n_all], weighted, whitened, projected; returns ‖out‖/‖before projection‖. */
double score_project(const struct score_base *base, const double column[], double out[]);

#endif
