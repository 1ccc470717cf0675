/* SPDX-License-Identifier: GPL-3.0-or-later */
/* law_step.h — the state of a record's steps; shared by law_step.c and law_step_matrix.c, and nobody else. */
#ifndef BEAMFIT_LAW_STEP_H
#define BEAMFIT_LAW_STEP_H

#include "law_run.h"

struct stepper {
    struct law_row q, free_q;     /* [P] */
    struct law_row F[HOLD_CUBIC]; /* [P] Σ_c α_c f_c, i steps ago; the first is scratch */
    double w[MOST_COORDINATES], v[MOST_COORDINATES], w_old[MOST_COORDINATES];
    double w_free[MOST_COORDINATES], v_free[MOST_COORDINATES];
    double a[MOST_COORDINATES], a_free[MOST_COORDINATES]; /* where the record uses accelerations */
    double f[MOST_COORDINATES], past[HOLD_CUBIC][MOST_COORDINATES], law[MOST_COORDINATES];
    double scale;       /* largest force so far */
    double rate;        /* by which a correction shrank the residual, lately and at worst */
    double *z, *z_next; /* [n_laws][BEAM_LAW_STATES] */
    double T_w[MOST_COORDINATES * MOST_COORDINATES], T_v[MOST_COORDINATES * MOST_COORDINATES];
    double T_a[MOST_COORDINATES * MOST_COORDINATES];
    bool newton; /* the inverse has been made */
    double inverse[MOST_COORDINATES * MOST_COORDINATES];
};

/* (I − T_w S_w − T_v S_v − T_a S_a)⁻¹, row by column, at the tangents of the last evaluation. */
enum bf_status step_inverse(const struct law_run *l, const struct stepper *s, double inverse[], struct bf_error *err);

#endif
