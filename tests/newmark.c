/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Newmark's average acceleration (β = 1/4, γ = 1/2): Newmark 1959; Hughes, The Finite Element Method, chapter 9. */
#include "newmark.h"
#include "beam_plan.h"

enum beam_status beam_newmark_factor(const struct beam_model *model, beam_real dt_s, struct beam_newmark *out)
{
    if (!beam_finite(dt_s) || !beam_less(BEAM_K(0.0), dt_s))
        return BEAM_ERROR_INTERVAL;
    const enum beam_status status = beam_model_check(model);
    if (status != BEAM_OK)
        return status;
    if (model->n_memories > 0)
        return BEAM_ERROR_MEMORY;
    *out = (struct beam_newmark){.dt_s = dt_s};
    const beam_real half = BEAM_K(0.5) * dt_s, quarter = half * half;
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++) {
            out->C[i][j] = model->C[i][j];
            out->K[i][j] = model->K[i][j];
            out->S[i][j] = model->M[i][j] + half * model->C[i][j] + quarter * model->K[i][j];
        }
    if (beam_cholesky(BEAM_N, BEAM_N, out->S[0]) != 0)
        return BEAM_ERROR_MASS;
    out->n_inputs = model->n_inputs;
    out->n_outputs = model->n_outputs;
    out->n_ports = model->n_ports;
    out->law_evaluations = 16;
    for (int i = 0; i < BEAM_N; i++) {
        for (int k = 0; k < model->n_inputs; k++)
            out->input[k][i] = model->input[k].vector[i];
        for (int k = 0; k < model->n_outputs; k++)
            out->output[k][i] = model->output[k].vector[i];
        for (int p = 0; p < model->n_ports; p++)
            out->port[p][i] = out->port_response[p][i] = model->port[p].vector[i];
    }
    for (int k = 0; k < model->n_outputs; k++)
        out->kind[k] = model->output[k].kind;
    for (int u = 0; u < model->n_uses; u++)
        out->use[u] = model->use[u];
    for (int p = 0; p < model->n_ports; p++) {
        out->weight[p] = model->port[p].weight;
        out->port_use[p] = (beam_count)model->port[p].use;
        out->port_coordinate[p] = (beam_count)model->port[p].coordinate;
        beam_lower_solve(BEAM_N, BEAM_N, out->S[0], out->port_response[p]);
        beam_lower_transposed_solve(BEAM_N, BEAM_N, out->S[0], out->port_response[p]);
        for (int q = 0; q < model->n_ports; q++)
            for (int i = 0; i < BEAM_N; i++) {
                const beam_real product = out->port[q][i] * out->port_response[p][i];
                out->compliance[2 * q][p] += quarter * product;
                out->compliance[2 * q + 1][p] += half * product;
            }
    }
    return BEAM_OK;
}

static beam_real dot(const beam_real a[BEAM_N], const beam_real b[BEAM_N])
{
    beam_real sum = BEAM_K(0.0);
    for (int i = 0; i < BEAM_N; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Corrects y, v, a (free of the laws) by the laws' forces. */
static enum beam_status apply_laws(const struct beam_newmark *newmark, struct beam_newmark_state *state)
{
    const beam_real half = BEAM_K(0.5) * newmark->dt_s;
    const struct beam_law_system system = {newmark->n_ports,
                                           newmark->law_evaluations,
                                           newmark->use,
                                           newmark->port_use,
                                           newmark->port_coordinate,
                                           newmark->weight,
                                           newmark->compliance,
                                           (beam_real)state->k * newmark->dt_s,
                                           newmark->dt_s};
    beam_real free[2 * BEAM_PORTS];
    for (int p = 0; p < newmark->n_ports; p++) {
        free[2 * p] = dot(newmark->port[p], state->y);
        free[2 * p + 1] = dot(newmark->port[p], state->v);
    }
    const enum beam_status status = beam_laws_solve(&system, free, state->force, state->w_old, state->z);
    for (int p = 0; p < newmark->n_ports; p++)
        for (int i = 0; i < BEAM_N; i++) {
            const beam_real kick = newmark->port_response[p][i] * state->force[p];
            state->a[i] -= kick;
            state->v[i] -= half * kick;
            state->y[i] -= half * half * kick;
        }
    return status;
}

enum beam_status beam_newmark_step(const struct beam_newmark *newmark, struct beam_newmark_state *state,
                                   const beam_real u[], beam_real y[])
{
    const beam_real half = BEAM_K(0.5) * newmark->dt_s, quarter = half * half;
    beam_real a[BEAM_N] = {BEAM_K(0.0)};
    enum beam_status status = BEAM_OK;
    for (int i = 0; i < BEAM_N; i++) {
        state->y[i] += newmark->dt_s * state->v[i] + quarter * state->a[i]; /* y*, v* */
        state->v[i] += half * state->a[i];
    }
    for (int i = 0; i < BEAM_N; i++) { /* a = S⁻¹ (f − C v* − K y*) */
        for (int k = 0; k < newmark->n_inputs; k++)
            a[i] += newmark->input[k][i] * u[k];
        a[i] -= dot(newmark->C[i], state->v) + dot(newmark->K[i], state->y);
    }
    beam_lower_solve(BEAM_N, BEAM_N, newmark->S[0], a);
    beam_lower_transposed_solve(BEAM_N, BEAM_N, newmark->S[0], a);
    for (int i = 0; i < BEAM_N; i++) {
        state->a[i] = a[i];
        state->v[i] += half * a[i];
        state->y[i] += quarter * a[i];
    }
    if (newmark->n_ports > 0)
        status = apply_laws(newmark, state);
    for (int o = 0; o < newmark->n_outputs; o++)
        y[o] = dot(newmark->output[o], newmark->kind[o] == BEAM_OUTPUT_VELOCITY       ? state->v
                                       : newmark->kind[o] == BEAM_OUTPUT_ACCELERATION ? state->a
                                                                                      : state->y);
    state->k++;
    return status;
}
