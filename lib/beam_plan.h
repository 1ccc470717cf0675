/* SPDX-License-Identifier: MIT */
/* beam_plan.h — what the files that make and run a plan share. Private to lib/. */
#ifndef BEAM_PLAN_H
#define BEAM_PLAN_H

#include "beam_hold.h"

#define beam_plan_reserve BEAM_NAME(plan_reserve)
#define beam_plan_chains  BEAM_NAME(plan_chains)
#define beam_chain_step   BEAM_NAME(chain_step)

#define beam_turn_blocks  BEAM_NAME(turn_blocks)
#define beam_add_column   BEAM_NAME(add_column)
#define beam_row_times    BEAM_NAME(row_times)
#define beam_linear_step  BEAM_NAME(linear_step)
#define beam_general_step BEAM_NAME(general_step)
#define beam_ring_filter  BEAM_NAME(ring_filter)
#define beam_laws_solve   BEAM_NAME(laws_solve)

/* A ring of this length from the history pool; *used counts what is taken. CAPACITY. */
enum beam_status beam_plan_reserve(int length, int *used, struct beam_ring *out);

/* Links of every output, alignment of all outputs to one latency. EFFECT_RANGE, FILTER, CAPACITY. */
enum beam_status beam_plan_chains(const struct beam_model *model, const struct beam_kernel *kernel, int *taps_used,
                                  int *history_used, struct beam_plan *plan);

/* Outputs through their chains: row[o] at time k − beam_latency in, y[o] at k − latency out. */
enum beam_status beam_chain_step(const struct beam_plan *plan, struct beam_state *state, beam_real command,
                                 const beam_real row[BEAM_OUTPUTS], beam_real y[]);

/* x ← Φ x + γ u of input 0; x ← x + γ u; row · x. Over whole pairs of blocks. */
void beam_turn_blocks(const struct beam_plan *plan, beam_real u, beam_real x[BEAM_STATES]);
void beam_add_column(int n_blocks, const beam_real gamma[BEAM_STATES], beam_real u, beam_real x[BEAM_STATES]);
beam_real beam_row_times(int n_blocks, const beam_real row[BEAM_STATES], const beam_real x[BEAM_STATES]);

/* beam_step() where there is neither effect nor history: the same sums in the same order. */
enum beam_status beam_linear_step(const struct beam_plan *plan, struct beam_state *state, const beam_real u[],
                                  beam_real y[]);

/* beam_step() with all that a plan may hold. */
enum beam_status beam_general_step(const struct beam_plan *plan, struct beam_state *state, const beam_real u[],
                                   beam_real y[]);

/* Rings: `at` is the place of the newest sample; age 0 is the newest. */
static inline void beam_ring_push(const struct beam_ring *ring, beam_real history[BEAM_HISTORY], beam_count *at,
                                  beam_real x)
{
    *at = (beam_count)(*at + 1 < ring->length ? *at + 1 : 0);
    history[ring->offset + *at] = x;
}

static inline beam_real beam_ring_get(const struct beam_ring *ring, const beam_real history[BEAM_HISTORY], int at,
                                      int age)
{
    return history[ring->offset + (at >= age ? at - age : at - age + ring->length)];
}

/* Σ taps[i] · (sample of age first + i), i < n; first + n ≤ length. */
beam_real beam_ring_filter(const struct beam_ring *ring, const beam_real history[BEAM_HISTORY], int at, int first,
                           int n, const beam_real taps[]);

/* Laws of one step, whichever integrator asks. */
struct beam_law_system {
    int n_ports, evaluations;
    const struct beam_use *use;
    const beam_count *port_use, *port_coordinate; /* [n_ports] */
    const beam_real *weight;                      /* [n_ports] */
    const beam_real (*compliance)[BEAM_PORTS];    /* [2 n_ports]: row 2p of w_p, 2p + 1 of v_p, per port force */
    beam_real t_s, dt_s;
};

/*
 * Forces g of all ports with g = weight f(free_w − S_w g, free_v − S_v g, …), from the last step's forces; at most
 * `evaluations` evaluations of the laws. In: free[2p], free[2p+1].
 * force, w_old, z are those of the last step and become those of this one. SOLVE (best found is kept), EFFECT_RANGE.
 */
enum beam_status beam_laws_solve(const struct beam_law_system *system, const beam_real free[2 * BEAM_PORTS],
                                 beam_real force[BEAM_PORTS], beam_real w_old[BEAM_PORTS],
                                 beam_real z[BEAM_PORTS][BEAM_LAW_STATES]);

#endif
