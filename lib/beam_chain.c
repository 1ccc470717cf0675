/* SPDX-License-Identifier: MIT */
/*
 * The measurement chain of each output: filters v(s) = (b1 s + b0)/(a1 s + a0) e^{−sd} w(s), maps, signals, in order.
 * Between samples w is what the hold says (first order for zero order), and the filter is then exact: with
 * b/a = D + R/(s + α), d = (q − ε)Δt, v_m = Σ_l (D κ(l + ε) + R Δt E_l(ε)) w_{m−q−l} + ξ_m, ξ one state with pole −α.
 */
#include "beam_plan.h"

/* D, R, α of a filter; α = 0 and R = 0 when it has no pole. */
struct section {
    beam_real direct, residue, rate;
};

static enum beam_status make_section(const struct beam_filter *f, struct section *out)
{
    const beam_real zero = BEAM_K(0.0);
    *out = (struct section){zero, zero, zero};
    if (!beam_finite(f->b1) || !beam_finite(f->b0) || !beam_finite(f->a1) || !beam_finite(f->a0) ||
        !beam_finite(f->delay_s) || beam_less(f->delay_s, zero))
        return BEAM_ERROR_FILTER;
    if (!beam_less(zero, beam_fabs(f->a1))) {
        if (!beam_less(zero, beam_fabs(f->a0)) || beam_less(zero, beam_fabs(f->b1)))
            return BEAM_ERROR_FILTER;
        out->direct = f->b0 / f->a0;
        return BEAM_OK;
    }
    out->rate = f->a0 / f->a1;
    out->direct = f->b1 / f->a1;
    out->residue = (f->b0 - out->direct * f->a0) / f->a1;
    return beam_less(out->rate, zero) ? BEAM_ERROR_FILTER : BEAM_OK;
}

/* Whole samples of a delay, rounded up, and the fraction that is too much; rounding of d/Δt is not a fraction. */
static enum beam_status split_delay(beam_real samples, int *whole, beam_real *fraction)
{
    if (!beam_less(samples, (beam_real)BEAM_HISTORY))
        return BEAM_ERROR_CAPACITY;
    *whole = (int)samples;
    *fraction = (beam_real)*whole + BEAM_K(1.0) - samples;
    if (beam_less(BEAM_K(1.0) - BEAM_K(32.0) * BEAM_EPSILON * (BEAM_K(1.0) + samples), *fraction))
        *fraction = BEAM_K(0.0);
    else
        *whole += 1;
    return BEAM_OK;
}

static enum beam_status make_filter(const struct beam_filter *filter, const struct beam_kernel *kernel, int o, int c,
                                    int *taps_used, int *history_used, struct beam_plan *plan)
{
    struct beam_link *link = &plan->n.link[o][c];
    const beam_real dt_s = plan->x.dt_s;
    const int width = kernel->half_width;
    struct section section;
    beam_real e_re[BEAM_RESPONSE], e_im[BEAM_RESPONSE], fraction;
    int whole;
    enum beam_status status = make_section(filter, &section);
    if (status == BEAM_OK)
        status = split_delay(filter->delay_s / dt_s, &whole, &fraction);
    if (status != BEAM_OK)
        return status;
    const int fractional = beam_less(BEAM_K(0.0), fraction);
    const int plain = !fractional && !beam_less(BEAM_K(0.0), beam_fabs(section.residue));
    const int ahead = plain ? 0 : width - 1 + fractional; /* samples needed after the one wanted */
    link->n_taps = (beam_count)(plain ? 1 : ahead + width);
    link->wait = (beam_count)(whole > ahead ? whole - ahead : 0);
    link->latency = (beam_count)(link->latency + (whole > ahead ? 0 : ahead - whole));
    link->tap = (beam_count)*taps_used;
    *taps_used += link->n_taps;
    if (*taps_used > BEAM_TAPS)
        return BEAM_ERROR_CAPACITY;
    beam_real *taps = &plan->x.taps[link->tap];
    beam_kernel_response(kernel, -section.rate * dt_s, BEAM_K(0.0), fraction, e_re, e_im);
    for (int i = 0; i < link->n_taps; i++) {
        const int l = i - ahead;
        taps[i] = section.direct * beam_kernel_at(kernel, l, fraction) + section.residue * dt_s * e_re[l + width];
    }
    if (!plain) {
        beam_real phi_re, phi_im;
        beam_phi(1, -section.rate * dt_s, BEAM_K(0.0), &phi_re, &phi_im);
        plan->x.link_phi[o][c] = -section.rate * dt_s * phi_re;
        plan->x.link_gamma[o][c] = section.residue * dt_s * e_re[2 * width];
    }
    return beam_plan_reserve(link->wait + link->n_taps + 1, history_used, &link->ring);
}

/* All links of output o; its latency is left in *latency. */
static enum beam_status make_chain(const struct beam_kernel *kernel, int o, int *taps_used, int *history_used,
                                   struct beam_plan *plan, int *latency)
{
    *latency = plan->n.beam_latency;
    for (int u = 0; u < plan->n.n_uses; u++) {
        const struct beam_use *use = &plan->use[u];
        const struct beam_effect *effect = use->effect;
        if (!(use->channels >> o & 1u) || (!effect->filter && !effect->map && !effect->signal))
            continue;
        if (plan->n.n_links[o] == BEAM_CHAIN)
            return BEAM_ERROR_CAPACITY;
        const int c = plan->n.n_links[o]++;
        struct beam_link *link = &plan->n.link[o][c];
        link->use = (beam_count)u;
        link->latency = (beam_count)*latency;
        if (effect->filter) {
            struct beam_filter_output filter = {.value = {.b1 = BEAM_K(0.0)}};
            if (effect->filter(use->p, &filter) != 0)
                return BEAM_ERROR_EFFECT_RANGE;
            const enum beam_status status = make_filter(&filter.value, kernel, o, c, taps_used, history_used, plan);
            if (status != BEAM_OK)
                return status;
        }
        *latency = link->latency;
    }
    return BEAM_OK;
}

enum beam_status beam_plan_chains(const struct beam_model *model, const struct beam_kernel *kernel, int *taps_used,
                                  int *history_used, struct beam_plan *plan)
{
    struct beam_kernel between = *kernel;
    int latency[BEAM_OUTPUTS];
    enum beam_status status = BEAM_OK;
    if (between.hold == BEAM_HOLD_ZERO_ORDER)
        between.hold = BEAM_HOLD_FIRST_ORDER;
    plan->n.latency = plan->n.beam_latency;
    for (int o = 0; o < model->n_outputs; o++) {
        status = make_chain(&between, o, taps_used, history_used, plan, &latency[o]);
        if (status != BEAM_OK)
            return status;
        if (latency[o] > plan->n.latency)
            plan->n.latency = (beam_count)latency[o];
    }
    for (int o = 0; o < model->n_outputs && status == BEAM_OK; o++)
        status = beam_plan_reserve(plan->n.latency - latency[o] + 1, history_used, &plan->n.output_ring[o]);
    if (status == BEAM_OK)
        status = beam_plan_reserve(plan->n.latency + 1, history_used, &plan->n.command_ring);
    return status;
}

beam_real beam_ring_filter(const struct beam_ring *ring, const beam_real history[BEAM_HISTORY], int at, int first,
                           int n, const beam_real taps[])
{
    const beam_real *samples = history + ring->offset;
    beam_real sum = BEAM_K(0.0);
    int place = at >= first ? at - first : at - first + ring->length;
    for (int i = 0; i < n; i++) {
        sum += taps[i] * samples[place];
        place = place > 0 ? place - 1 : ring->length - 1;
    }
    return sum;
}

static enum beam_status step_link(const struct beam_plan *plan, struct beam_state *state, int o, int c,
                                  beam_real *value)
{
    const struct beam_link *link = &plan->n.link[o][c];
    const struct beam_use *use = &plan->use[link->use];
    struct beam_sample_output out = {.y = BEAM_K(0.0)};
    if (link->n_taps > 0) {
        beam_count *at = &state->link_at[o][c];
        beam_ring_push(&link->ring, state->history, at, *value);
        state->link_x[o][c] +=
            plan->x.link_phi[o][c] * state->link_x[o][c] +
            plan->x.link_gamma[o][c] * beam_ring_get(&link->ring, state->history, *at, link->wait + link->n_taps);
        *value = state->link_x[o][c] +
                 beam_ring_filter(&link->ring, state->history, *at, link->wait, link->n_taps, &plan->x.taps[link->tap]);
    }
    if (use->effect->map) {
        const beam_real command =
            beam_ring_get(&plan->n.command_ring, state->history, state->command_at, link->latency);
        if (use->effect->map(use->p, *value, command, &out) != 0)
            return BEAM_ERROR_EFFECT_RANGE;
        *value = out.y;
    }
    if (use->effect->signal) {
        const int32_t latency = link->latency, sample = (int32_t)(state->k - (uint32_t)latency);
        if (use->effect->signal(use->p, (beam_real)sample * plan->x.dt_s, *value, &out) != 0)
            return BEAM_ERROR_EFFECT_RANGE;
        *value = out.y;
    }
    return BEAM_OK;
}

enum beam_status beam_chain_step(const struct beam_plan *plan, struct beam_state *state, beam_real command,
                                 const beam_real row[BEAM_OUTPUTS], beam_real y[])
{
    enum beam_status status = BEAM_OK;
    beam_ring_push(&plan->n.command_ring, state->history, &state->command_at, command);
    for (int o = 0; o < plan->n.n_outputs; o++) {
        beam_real value = row[o];
        for (int c = 0; c < plan->n.n_links[o]; c++) {
            const enum beam_status link_status = step_link(plan, state, o, c, &value);
            if (link_status != BEAM_OK)
                status = link_status;
        }
        const struct beam_ring *ring = &plan->n.output_ring[o];
        if (ring->length > 1) {
            beam_ring_push(ring, state->history, &state->output_at[o], value);
            value = beam_ring_get(ring, state->history, state->output_at[o], ring->length - 1);
        }
        y[o] = value;
    }
    return status;
}
