/* SPDX-License-Identifier: GPL-3.0-or-later */
/* newmark.h — the textbook reference beside the exact step of lib/: Newmark's average acceleration. */
#ifndef NEWMARK_H
#define NEWMARK_H

#include "beam.h"

/* Second order: frequency is warped by (2/ωΔt) atan(ωΔt/2). Inputs sampled, outputs without chain, drives or base. */
struct beam_newmark {
    beam_real dt_s;
    beam_real C[BEAM_N][BEAM_N], K[BEAM_N][BEAM_N];
    beam_real S[BEAM_N][BEAM_N]; /* Cholesky factor of M + Δt/2 C + Δt²/4 K */
    int n_inputs, n_outputs, n_ports, law_evaluations;
    beam_real input[BEAM_INPUTS][BEAM_N], output[BEAM_OUTPUTS][BEAM_N], port[BEAM_PORTS][BEAM_N];
    beam_real port_response[BEAM_PORTS][BEAM_N];      /* S⁻¹ g */
    beam_real compliance[2 * BEAM_PORTS][BEAM_PORTS]; /* Δt²/4 GᵀS⁻¹G and Δt/2 GᵀS⁻¹G, rows interleaved */
    beam_real weight[BEAM_PORTS];
    beam_count port_use[BEAM_PORTS], port_coordinate[BEAM_PORTS];
    enum beam_output_kind kind[BEAM_OUTPUTS];
    struct beam_use use[BEAM_USES];
};

struct beam_newmark_state {
    uint32_t k;
    beam_real y[BEAM_N], v[BEAM_N], a[BEAM_N];
    beam_real force[BEAM_PORTS], w_old[BEAM_PORTS], z[BEAM_PORTS][BEAM_LAW_STATES];
};

/*
 * Zero a state to start from rest, or set y, v, a. MASS when S is not positive definite; MEMORY when the model
 * has memory terms, which this method lacks; INTERVAL, ARGUMENT.
 */
enum beam_status beam_newmark_factor(const struct beam_model *model, beam_real dt_s, struct beam_newmark *out);
enum beam_status beam_newmark_step(const struct beam_newmark *newmark, struct beam_newmark_state *state,
                                   const beam_real u[], beam_real y[]);

#endif
