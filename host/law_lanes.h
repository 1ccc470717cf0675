/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * law_lanes.h — the linearised state of four parameters at once, so that the inner loops have a constant length; shared
 * by law_derivative.c (what the parameters change, outputs) and law_derivative_step.c (the steps), and nobody else.
 */
#ifndef BEAMFIT_LAW_LANES_H
#define BEAMFIT_LAW_LANES_H

#include "law_run.h"

enum { LANES = 4 };

/* Complex numbers are split; the last index is the lane. */
struct lanes {
    const struct law_run *l;
    size_t count, parameter[LANES];
    double (*q_re)[LANES], (*q_im)[LANES]; /* [n_dynamic] δq */
    double (*a_re)[LANES], (*a_im)[LANES]; /* [D · n_dynamic] δα */
    double (*e_re)[LANES], (*e_im)[LANES]; /* [n_dynamic] δe, and so on */
    double (*g0_re)[LANES], (*g0_im)[LANES], (*g1_re)[LANES], (*g1_im)[LANES], (*p_re)[LANES], (*p_im)[LANES];
    double *far;           /* [D × D][LANES] */
    double *w_lin, *v_lin; /* [LANES][D][N] */
    double *f;             /* [LANES][D][N] δf, the result */
    double w[MOST_COORDINATES][LANES], v[MOST_COORDINATES][LANES];
    double w_old[MOST_COORDINATES][LANES], df[MOST_COORDINATES][LANES];
    double (*z)[BEAM_LAW_STATES][LANES]; /* [n_effects] δz */
    double *storage;
};

/* f of the whole record, from what the parameters change. */
void law_lanes_march(struct lanes *a);

#endif
