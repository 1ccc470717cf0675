/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * law_lanes.h — the linearised state of as many parameters at once as a vector has numbers; shared by law_derivative.c
 * (what the parameters change, outputs) and law_derivative_step.c (the steps), and nobody else.
 */
#ifndef BEAMFIT_LAW_LANES_H
#define BEAMFIT_LAW_LANES_H

#include "law_run.h"
#include "maths/maths.h"

enum { LANES = VECTOR_LENGTH };

/* A force depends on the parameter of a lane at a given motion, too. */
struct direct {
    size_t lane, first, d; /* coordinates first … first + d − 1 */
    size_t dependency;     /* entry of f_p */
};

/* Complex numbers are split; the last index is the lane. */
struct lanes {
    const struct law_run *l;
    size_t count, parameter[LANES]; /* from n_parameters on: unknowns of the initial state */
    size_t n_direct;
    struct direct direct[MOST_COORDINATES * LANES];
    bool structural;                                               /* some of them changes poles or residues */
    double (*q_re)[LANES], (*q_im)[LANES];                         /* [P] δq */
    double (*p_re)[LANES], (*p_im)[LANES];                         /* [P] δp */
    double (*a_re)[LANES], (*a_im)[LANES];                         /* [D · P] δα */
    double (*F_re[HOLD_CUBIC])[LANES], (*F_im[HOLD_CUBIC])[LANES]; /* [P] δ(Σ_c α_c f_c), so many steps ago */
    double *far;                                                   /* [D × D][LANES] */
    double *jump;                                                  /* [D × D][LANES] δ Σ_k Re(α_k p_k α_k') */
    double *w_lin, *v_lin;                                         /* [N][D][LANES] */
    double *a_lin; /* [N][D][LANES] where the record uses accelerations */
    double *f;     /* [N][D][LANES] δf, the result */
    double w[MOST_COORDINATES][LANES], v[MOST_COORDINATES][LANES];
    double w_old[MOST_COORDINATES][LANES], df[MOST_COORDINATES][LANES];
    double acceleration[MOST_COORDINATES][LANES]; /* without what depends on δf⁺ */
    double (*z)[BEAM_LAW_STATES][LANES];          /* [n_laws] δz */
    double *storage;
};

/* What a change of each pole does to q in a step: δq⁺ = e δq + R δp − Σ g δF. re, im: [N][P]; free re. */
struct law_row law_pole_changes(const struct law_run *l);

/* f of the whole record, from what the parameters change. R of law_pole_changes(). */
void law_lanes_march(struct lanes *a, const struct law_row *R);

#endif
