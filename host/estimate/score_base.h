/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * score_base.h — the baseline at its optimum, as every score sees it; private to estimate/.
 *
 *     LM = (S̃ᵀP r̃)ᵀ (S̃ᵀP S̃)⁻¹ (S̃ᵀP r̃),   P = I − J̃ (J̃ᵀJ̃)⁻¹ J̃ᵀ
 *
 * r = z − ŷ(θ̂) and S = ∂ŷ/∂c weighted by the noise (and whitened by the channel's colour), J the baseline's Jacobian
 * with the rows of its priors, the free initial states of decays and unknown levels: P takes out what the baseline could
 * absorb (Rao's score test; Newey 1985 for the projection). Strengths that cannot be negative are held at 0 when the data
 * ask for less. Inner parameters (places, time constants, frequencies) are scanned and refined; effects whose response does
 * not begin linearly (a clamp that turns, saturation) get finite trials instead of the derivative.
 */
#ifndef BEAMFIT_SCORE_BASE_H
#define BEAMFIT_SCORE_BASE_H

#include "estimate.h"

/* What one record's unknown level and initial states take of its rows, which are one after the other. */
struct record_basis {
    size_t row, n; /* the first of its rows, and how many */
    size_t rank;
    double *Q; /* [rank][n] orthonormal, weighted and whitened */
};

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
    double *levels;              /* [n_records] factor of the excitation */
    size_t n_rows, n_all;        /* rows of data; with the rows of priors */
    double *weight;              /* [n_rows] 1/σ */
    double *fitted;              /* [n_rows] ŷ, unit of the channel */
    double *residual;            /* [n_all] P r̃ */
    struct record_basis *states; /* [n_records] */
    size_t rank;                 /* of what the parameters can absorb beside these */
    double *absorbed;            /* [rank][n_all] orthonormal basis of it */
    double misfit;               /* ‖P r̃‖² */
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
