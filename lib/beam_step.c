/* SPDX-License-Identifier: MIT */
/* One sample: x ← x + (Φ − 1) x + Γ u, y = H x + taps, laws, chain. */
#include "beam_plan.h"

void beam_reset(const struct beam_plan *plan, struct beam_state *state)
{
    (void)plan;
    *state = (struct beam_state){.k = 0};
}

/* A memory that has forgotten pulls with −E X y0 against the instant stiffness. */
static void add_relaxed_memory(const struct beam_memory *memory, const struct beam_poles *poles, int k,
                               const beam_real y0[BEAM_N], beam_real *re, beam_real *im)
{
    beam_real a = BEAM_K(0.0), b = BEAM_K(0.0);
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++) {
            a += poles->shape_re[k][i] * memory->form[i][j] * y0[j];
            b += poles->shape_im[k][i] * memory->form[i][j] * y0[j];
        }
    const beam_real d_re = poles->re[k] + BEAM_K(1.0) / memory->relaxation_s, d_im = poles->im[k];
    const beam_real size = d_re * d_re + d_im * d_im;
    *re += (a * d_re + b * d_im) / size;
    *im += (b * d_re - a * d_im) / size;
}

void beam_start(const struct beam_model *model, const struct beam_work *work, const struct beam_plan *plan,
                const beam_real y0[BEAM_N], const beam_real v0[BEAM_N], struct beam_state *state)
{
    const struct beam_poles *poles = &work->poles;
    beam_real momentum[BEAM_N], rate[BEAM_N]; /* M y0; C y0 + M v0 */
    for (int i = 0; i < BEAM_N; i++) {
        momentum[i] = rate[i] = BEAM_K(0.0);
        for (int j = 0; j < BEAM_N; j++) {
            momentum[i] += model->M[i][j] * y0[j];
            rate[i] += model->C[i][j] * y0[j] + model->M[i][j] * v0[j];
        }
    }
    beam_reset(plan, state);
    for (int k = 0; k < poles->n_complex + poles->n_real; k++) {
        const beam_real *a = poles->shape_re[k], *b = poles->shape_im[k];
        beam_real re = BEAM_K(0.0), im = BEAM_K(0.0);
        for (int i = 0; i < BEAM_N; i++) { /* ξ = φᵀ(C y0 + M v0) + p φᵀM y0 */
            re += a[i] * (rate[i] + poles->re[k] * momentum[i]) - b[i] * poles->im[k] * momentum[i];
            im += b[i] * (rate[i] + poles->re[k] * momentum[i]) + a[i] * poles->im[k] * momentum[i];
        }
        for (int m = 0; m < model->n_memories; m++) /* + φᵀ E X y0/(p + 1/τ) */
            add_relaxed_memory(&model->memory[m], poles, k, y0, &re, &im);
        const int slot = k < poles->n_complex ? 2 * k : poles->n_complex + k;
        state->x[slot] = re;
        if (k < poles->n_complex)
            state->x[slot + 1] = im;
    }
    for (int p = 0; p < model->n_ports; p++)
        for (int i = 0; i < BEAM_N; i++)
            state->w_old[p] += model->port[p].vector[i] * y0[i];
}

/* Commands through the drives, and the clamp's acceleration; newest samples into the rings. Returns the drive command. */
static enum beam_status take_inputs(const struct beam_plan *plan, struct beam_state *state, const beam_real u[],
                                    beam_real now[BEAM_ALL_INPUTS])
{
    const struct beam_plan_counts *n = &plan->n;
    enum beam_status status = BEAM_OK;
    for (int i = 0; i < n->n_inputs; i++) {
        now[i] = u[i];
        for (int use = 0; use < n->n_uses; use++) {
            const struct beam_use *drive = &plan->use[use];
            if (!drive->effect->drive || !(drive->channels >> i & 1u))
                continue;
            struct beam_drive_output out = {.u = BEAM_K(0.0)};
            if (drive->effect->drive(drive->p, now[i], state->u_old[i][use], state->drive_z[i][use], &out) != 0) {
                status = BEAM_ERROR_EFFECT_RANGE;
                continue;
            }
            state->u_old[i][use] = now[i];
            for (int s = 0; s < BEAM_DRIVE_STATES; s++)
                state->drive_z[i][use][s] = out.z[s];
            now[i] = out.u;
        }
    }
    if (BEAM_BASE && n->base_use >= 0) {
        struct beam_sample_output out = {.y = BEAM_K(0.0)};
        const struct beam_use *base = &plan->use[n->base_use];
        if (base->effect->base(base->p, (beam_real)state->k * plan->x.dt_s, &out) != 0)
            status = BEAM_ERROR_EFFECT_RANGE;
        now[n->n_inputs] = out.y;
    }
    return status;
}

/* Free prediction of row r: state, and the youngest input samples through their taps. */
static beam_real predict_row(const struct beam_plan *plan, const struct beam_state *state,
                             const beam_real now[BEAM_ALL_INPUTS], int inputs, int r)
{
    const struct beam_plan_counts *n = &plan->n;
    const beam_real *taps = plan->x.taps + r * inputs * n->n_taps;
    beam_real value = beam_row_times(n->n_blocks, plan->x.row[r], state->x);
    if (n->n_taps == 1) {
        for (int i = 0; i < inputs; i++)
            value += taps[i] * now[i];
        return value;
    }
    for (int i = 0; i < inputs; i++)
        value +=
            beam_ring_filter(&n->input_ring[i], state->history, state->input_at[i], 0, n->n_taps, taps + i * n->n_taps);
    return value;
}

/* State to this step: what enters are the input samples L steps old and the law forces of the last step. */
static void advance_state(const struct beam_plan *plan, struct beam_state *state, const beam_real now[BEAM_ALL_INPUTS],
                          int inputs)
{
    const struct beam_plan_counts *n = &plan->n;
    beam_real entering[BEAM_ALL_INPUTS] = {BEAM_K(0.0)};
    for (int i = 0; i < inputs; i++) {
        entering[i] = state->u_last[i];
        state->u_last[i] = now[i];
        if (n->n_taps > 1) {
            beam_ring_push(&n->input_ring[i], state->history, &state->input_at[i], now[i]);
            entering[i] = beam_ring_get(&n->input_ring[i], state->history, state->input_at[i], n->n_taps);
        }
    }
    beam_turn_blocks(plan, entering[0], state->x);
    for (int i = 1; i < inputs && i < BEAM_ALL_INPUTS; i++)
        beam_add_column(n->n_blocks, plan->x.gamma[i], entering[i], state->x);
    for (int p = 0; p < n->n_ports; p++)
        beam_add_column(n->n_blocks, plan->x.gamma_port[p], -state->force[p], state->x);
}

static enum beam_status apply_laws(const struct beam_plan *plan, struct beam_state *state,
                                   const beam_real now[BEAM_ALL_INPUTS], int inputs, beam_real row[BEAM_OUTPUTS])
{
    const struct beam_plan_counts *n = &plan->n;
    const int32_t latency = n->beam_latency, sample = (int32_t)(state->k - (uint32_t)latency);
    const struct beam_law_system system = {n->n_ports,
                                           n->law_evaluations,
                                           plan->use,
                                           n->port_use,
                                           n->port_coordinate,
                                           plan->x.weight,
                                           &plan->x.compliance[n->n_outputs],
                                           (beam_real)sample * plan->x.dt_s,
                                           plan->x.dt_s};
    beam_real free[2 * BEAM_PORTS];
    for (int r = 0; r < 2 * n->n_ports; r++)
        free[r] = predict_row(plan, state, now, inputs, n->n_outputs + r);
    const enum beam_status status = beam_laws_solve(&system, free, state->force, state->w_old, state->z);
    for (int o = 0; o < n->n_outputs; o++)
        for (int p = 0; p < n->n_ports; p++)
            row[o] -= plan->x.compliance[o][p] * state->force[p];
    return status;
}

enum beam_status beam_general_step(const struct beam_plan *plan, struct beam_state *state, const beam_real u[],
                                   beam_real y[])
{
    const struct beam_plan_counts *n = &plan->n;
    if (n->n_uses == 0 && n->n_taps == 1)
        return beam_linear_step(plan, state, u, y);
    const int inputs = n->n_inputs + (n->base_use >= 0);
    beam_real now[BEAM_ALL_INPUTS] = {BEAM_K(0.0)}, row[BEAM_OUTPUTS] = {BEAM_K(0.0)}, sum = BEAM_K(0.0);
    enum beam_status status = take_inputs(plan, state, u, now), law_status = BEAM_OK, chain_status;
    advance_state(plan, state, now, inputs);
    for (int o = 0; o < n->n_outputs; o++)
        row[o] = predict_row(plan, state, now, inputs, o);
    if (n->n_ports > 0)
        law_status = apply_laws(plan, state, now, inputs, row);
    if (BEAM_BASE && n->base_use >= 0)
        for (int o = 0; o < n->n_outputs; o++)
            row[o] +=
                plan->x.base_gain[o] * (n->n_taps == 1 ? now[n->n_inputs]
                                                       : beam_ring_get(&n->input_ring[n->n_inputs], state->history,
                                                                       state->input_at[n->n_inputs], n->beam_latency));
    chain_status = beam_chain_step(plan, state, n->drive_input >= 0 ? u[n->drive_input] : BEAM_K(0.0), row, y);
    state->k++;
    for (int o = 0; o < n->n_outputs; o++)
        sum += y[o];
    if (!beam_finite(sum))
        return BEAM_ERROR_STATE;
    return status != BEAM_OK ? status : law_status != BEAM_OK ? law_status : chain_status;
}
