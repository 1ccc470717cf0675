/* SPDX-License-Identifier: MIT */
/* Is a model, is a received plan fit for use. */
#include "beam_dense.h"

#ifdef BEAM_FLOAT
#define SYMMETRY BEAM_K(1e-5)
#else
#define SYMMETRY BEAM_K(1e-9)
#endif

static int finite_list(int n, const beam_real x[])
{
    for (int i = 0; i < n; i++)
        if (!beam_finite(x[i]))
            return 0;
    return 1;
}

/* Entries finite, and aᵢⱼ = aⱼᵢ to a share of the largest diagonal entries they join. */
static enum beam_status check_matrix(const beam_real a[BEAM_N][BEAM_N])
{
    beam_real largest = BEAM_K(0.0);
    if (!finite_list(BEAM_N * BEAM_N, a[0]))
        return BEAM_ERROR_NOT_FINITE;
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            if (beam_less(largest, beam_fabs(a[i][j])))
                largest = beam_fabs(a[i][j]);
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < i; j++)
            if (beam_less(SYMMETRY * largest, beam_fabs(a[i][j] - a[j][i])))
                return BEAM_ERROR_ASYMMETRIC;
    return BEAM_OK;
}

static int count_outside(int count, int least, int most)
{
    return count < least || count > most;
}

static enum beam_status check_counts(const struct beam_model *model)
{
    if (count_outside(model->n_inputs, 0, BEAM_INPUTS) || count_outside(model->n_outputs, 0, BEAM_OUTPUTS) ||
        count_outside(model->n_memories, 0, BEAM_MEMORIES) || count_outside(model->n_uses, 0, BEAM_USES))
        return BEAM_ERROR_ARGUMENT;
    if (count_outside(model->n_ports, 0, BEAM_PORTS))
        return BEAM_ERROR_CAPACITY;
    for (int i = 0; i < model->n_uses; i++)
        if (!model->use[i].effect)
            return BEAM_ERROR_EFFECT;
    for (int i = 0; i < model->n_ports; i++) {
        const struct beam_port *port = &model->port[i];
        if (count_outside(port->use, 0, model->n_uses - 1) || count_outside(port->coordinate, 0, BEAM_LAW_WIDTH - 1) ||
            !model->use[port->use].effect->law || (port->coordinate > 0 && i == 0))
            return BEAM_ERROR_ARGUMENT;
    }
    return BEAM_OK;
}

enum beam_status beam_model_check(const struct beam_model *model)
{
    enum beam_status status = check_counts(model);
    const beam_real(*matrices[3])[BEAM_N] = {model->M, model->C, model->K};
    for (int i = 0; i < 3 && status == BEAM_OK; i++)
        status = check_matrix(matrices[i]);
    for (int i = 0; i < model->n_memories && status == BEAM_OK; i++) {
        status = check_matrix(model->memory[i].form);
        if (status == BEAM_OK && !beam_finite(model->memory[i].relaxation_s))
            status = BEAM_ERROR_NOT_FINITE;
    }
    if (status != BEAM_OK)
        return status;
    int finite = finite_list(BEAM_N, model->base_load);
    for (int i = 0; i < model->n_inputs; i++)
        finite &= finite_list(BEAM_N, model->input[i].vector);
    for (int i = 0; i < model->n_outputs; i++)
        finite &= finite_list(BEAM_N, model->output[i].vector);
    for (int i = 0; i < model->n_ports; i++)
        finite &= finite_list(BEAM_N, model->port[i].vector) && beam_finite(model->port[i].weight);
    for (int i = 0; i < model->n_uses; i++)
        finite &= finite_list(model->use[i].effect->n_parameters, model->use[i].p);
    return finite ? BEAM_OK : BEAM_ERROR_NOT_FINITE;
}

/* Both eigenvalues of Φ = 1 + ψ inside the unit circle, rounding allowed: |det| ≤ 1, |trace| ≤ 1 + det. */
static int block_is_stable(const beam_real psi[4])
{
    const beam_real rounding = BEAM_K(8.0) * BEAM_EPSILON;
    const beam_real trace_off = psi[0] + psi[3]; /* trace − 2 */
    const beam_real product = psi[0] * psi[3] - psi[1] * psi[2];
    const beam_real det_off = trace_off + product; /* det − 1 */
    if (beam_less(rounding, det_off) || beam_less(det_off, BEAM_K(-2.0) - rounding))
        return 0;
    return !beam_less(product, -rounding) && !beam_less(BEAM_K(4.0) + BEAM_K(2.0) * trace_off + product, -rounding);
}

static int ring_outside(const struct beam_ring *ring)
{
    return count_outside(ring->length, 1, BEAM_HISTORY) || count_outside(ring->offset, 0, BEAM_HISTORY - ring->length);
}

static int link_outside(const struct beam_plan *plan, const struct beam_link *link)
{
    if (count_outside(link->use, 0, plan->n.n_uses - 1) || count_outside(link->n_taps, 0, BEAM_TAPS) ||
        count_outside(link->latency, 0, plan->n.latency))
        return 1;
    if (link->n_taps == 0)
        return 0;
    return count_outside(link->tap, 0, BEAM_TAPS - link->n_taps) || ring_outside(&link->ring) ||
           count_outside(link->wait, 0, link->ring.length - link->n_taps - 1);
}

static int counts_outside(const struct beam_plan *plan)
{
    const struct beam_plan_counts *n = &plan->n;
    if (count_outside(n->n_blocks, 1, BEAM_BLOCKS) || count_outside(n->n_inputs, 0, BEAM_INPUTS) ||
        count_outside(n->n_outputs, 0, BEAM_OUTPUTS) || count_outside(n->n_ports, 0, BEAM_PORTS) ||
        count_outside(n->n_uses, 0, BEAM_USES) || count_outside(n->base_use, -1, BEAM_BASE ? n->n_uses - 1 : -1) ||
        count_outside(n->drive_input, -1, n->n_inputs - 1) || count_outside(n->law_evaluations, 1, 1000) ||
        count_outside(n->beam_latency, 0, BEAM_HALF_WIDTH - 1) || n->n_taps != 2 * n->beam_latency + 1 ||
        count_outside(n->latency, n->beam_latency, BEAM_HISTORY - 1))
        return 1;
    const int all_inputs = n->n_inputs + (n->base_use >= 0);
    if (n->n_taps * all_inputs * (n->n_outputs + 2 * n->n_ports) > BEAM_TAPS)
        return 1;
    for (int i = 0; i < all_inputs; i++)
        if (ring_outside(&n->input_ring[i]) || n->input_ring[i].length < n->n_taps + 1)
            return 1;
    if (ring_outside(&n->command_ring))
        return 1;
    for (int o = 0; o < n->n_outputs; o++) {
        if (ring_outside(&n->output_ring[o]) || count_outside(n->n_links[o], 0, BEAM_CHAIN))
            return 1;
        for (int c = 0; c < n->n_links[o]; c++)
            if (link_outside(plan, &n->link[o][c]) || n->command_ring.length <= n->link[o][c].latency)
                return 1;
    }
    for (int i = 0; i < n->n_ports; i++)
        if (count_outside(n->port_use[i], 0, n->n_uses - 1) ||
            count_outside(n->port_coordinate[i], 0, i == 0 ? 0 : BEAM_LAW_WIDTH - 1))
            return 1;
    return 0;
}

enum beam_status beam_plan_check(const struct beam_plan *plan)
{
    const struct beam_plan_numbers *x = &plan->x;
    if (counts_outside(plan))
        return BEAM_ERROR_PLAN;
    for (int i = 0; i < plan->n.n_uses; i++) {
        const struct beam_effect *effect = plan->use[i].effect;
        if (!effect || !finite_list(effect->n_parameters, plan->use[i].p))
            return BEAM_ERROR_PLAN;
    }
    for (int i = 0; i < plan->n.n_ports; i++)
        if (!plan->use[plan->n.port_use[i]].effect->law)
            return BEAM_ERROR_PLAN;
    if (plan->n.base_use >= 0 && !plan->use[plan->n.base_use].effect->base)
        return BEAM_ERROR_PLAN;
    if (!finite_list(BEAM_PLAN_NUMBERS, (const beam_real *)x))
        return BEAM_ERROR_PLAN;
    for (int b = 0; b < plan->n.n_blocks; b++)
        if (!block_is_stable(x->phi[b]))
            return BEAM_ERROR_PLAN;
    for (int o = 0; o < plan->n.n_outputs; o++)
        for (int c = 0; c < plan->n.n_links[o]; c++)
            if (beam_less(BEAM_K(0.0), x->link_phi[o][c]) || beam_less(x->link_phi[o][c], BEAM_K(-2.0)))
                return BEAM_ERROR_PLAN;
    return beam_less(BEAM_K(0.0), x->dt_s) ? BEAM_OK : BEAM_ERROR_PLAN;
}
