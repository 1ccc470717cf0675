/* SPDX-License-Identifier: MIT */
/*
 * From poles to the step. Each pole gives ξ̇ = p ξ + φᵀb u, y = 2 Re(cᵀφ ξ); with u(t) = Σ u_j κ(t/Δt − j) the state at
 * sample m holds what samples j ≤ m − L did, and the younger ones act through direct taps:
 *     ξ_m = e^{pΔt} ξ_{m−1} + Δt φᵀb E_L u_{m−L},    y_m = 2 Re Σ cᵀφ (ξ_m + Δt Σ_{|l|<L} φᵀb E_l u_{m−l})
 * E_l = ∫ κ(s) e^{pΔt (l−s)} ds. First order hold: L = 1, one tap, the usual Γ1 u_{k+1} in front of the output.
 */
#include "beam_plan.h"

/* Everything known of one pole in one step. */
struct pole_step {
    int real, slot; /* slot: first of its one or two states */
    beam_real re, im, sign;
    const beam_real *shape_re, *shape_im;
    beam_real e_re[BEAM_RESPONSE], e_im[BEAM_RESPONSE]; /* Δt E_l of the inputs' hold */
    beam_real port_re[2], port_im[2];                   /* Δt E_0, Δt E_1 of the laws' linear hold */
};

static beam_real dot(const beam_real a[BEAM_N], const beam_real b[BEAM_N])
{
    beam_real sum = BEAM_K(0.0);
    for (int i = 0; i < BEAM_N; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Channels of an effect: its own mask, or the default channels of its kind in this model. */
static unsigned use_channels(const struct beam_model *model, const struct beam_use *use)
{
    unsigned mask = use->channels;
    const enum beam_channels kind = use->effect->channels;
    if (mask != 0)
        return mask;
    for (int o = 0; o < model->n_outputs; o++)
        if (kind == BEAM_CHANNELS_EVERY_OUTPUT ||
            (kind == BEAM_CHANNELS_PATCH_OUTPUT && model->output[o].kind == BEAM_OUTPUT_PATCH_STRAIN))
            mask |= 1u << o;
    for (int i = 0; i < model->n_inputs; i++)
        if ((kind == BEAM_CHANNELS_PATCH_INPUT && model->input[i].kind == BEAM_INPUT_PATCH_MOMENT) ||
            (kind == BEAM_CHANNELS_POINT_INPUT && model->input[i].kind == BEAM_INPUT_POINT_FORCE))
            mask |= 1u << i;
    return mask;
}

enum beam_status beam_plan_reserve(int length, int *used, struct beam_ring *out)
{
    if (length < 1 || length > BEAM_HISTORY - *used)
        return BEAM_ERROR_CAPACITY;
    out->offset = (beam_count)*used;
    out->length = (beam_count)length;
    *used += length;
    return BEAM_OK;
}

static void make_pole_step(const struct beam_poles *poles, int k, const struct beam_kernel *kernel, beam_real dt_s,
                           struct pole_step *out)
{
    static const struct beam_kernel linear = {BEAM_HOLD_FIRST_ORDER, 1, BEAM_K(0.0), BEAM_K(1.0)};
    beam_real re[BEAM_RESPONSE], im[BEAM_RESPONSE];
    const int width = kernel->half_width;
    out->real = k >= poles->n_complex;
    out->slot = out->real ? poles->n_complex + k : 2 * k;
    out->re = poles->re[k];
    out->im = poles->im[k];
    out->sign = poles->sign[k];
    out->shape_re = poles->shape_re[k];
    out->shape_im = poles->shape_im[k];
    beam_kernel_response(kernel, out->re * dt_s, out->im * dt_s, BEAM_K(0.0), out->e_re, out->e_im);
    for (int l = 0; l <= 2 * width; l++) {
        out->e_re[l] *= dt_s;
        out->e_im[l] *= dt_s;
    }
    beam_kernel_response(&linear, out->re * dt_s, out->im * dt_s, BEAM_K(0.0), re, im);
    for (int l = 0; l < 2; l++) {
        out->port_re[l] = re[l + 1] * dt_s;
        out->port_im[l] = im[l + 1] * dt_s;
    }
}

/* Φ − 1 = z φ₁(z), accurate for slow poles too. */
static void put_block(const struct pole_step *pole, beam_real dt_s, struct beam_plan *plan)
{
    const beam_real z_re = pole->re * dt_s, z_im = pole->im * dt_s;
    beam_real phi_re, phi_im;
    beam_phi(1, z_re, z_im, &phi_re, &phi_im);
    const beam_real re = z_re * phi_re - z_im * phi_im, im = z_re * phi_im + z_im * phi_re;
    beam_real *block = plan->x.phi[pole->slot / 2];
    if (pole->real) {
        block[3 * (pole->slot % 2)] = re;
        return;
    }
    block[0] = block[3] = re;
    block[1] = -im;
    block[2] = im;
}

static void put_input(const struct pole_step *pole, const beam_real vector[BEAM_N], beam_real e_re, beam_real e_im,
                      beam_real gamma[BEAM_STATES])
{
    const beam_real b_re = dot(pole->shape_re, vector), b_im = dot(pole->shape_im, vector);
    gamma[pole->slot] = b_re * e_re - b_im * e_im;
    if (!pole->real)
        gamma[pole->slot + 1] = b_re * e_im + b_im * e_re;
}

/* A row's own view of a pole: weights of Re ξ and Im ξ in cᵀ y^{(order)}. */
static void row_weights(const struct pole_step *pole, const beam_real vector[BEAM_N], int order, beam_real *w_re,
                        beam_real *w_im)
{
    beam_real re = dot(pole->shape_re, vector), im = dot(pole->shape_im, vector);
    for (int d = 0; d < order; d++) { /* × p */
        const beam_real t = re * pole->re - im * pole->im;
        im = re * pole->im + im * pole->re;
        re = t;
    }
    *w_re = pole->real ? pole->sign * re : BEAM_K(2.0) * re;
    *w_im = pole->real ? BEAM_K(0.0) : BEAM_K(-2.0) * im;
}

/* The vector, order of derivative and place of row r. */
struct row {
    const beam_real *vector;
    int order;
};

static struct row row_of(const struct beam_model *model, int r)
{
    static const int orders[] = {[BEAM_OUTPUT_DISPLACEMENT] = 0,
                                 [BEAM_OUTPUT_VELOCITY] = 1,
                                 [BEAM_OUTPUT_ACCELERATION] = 2,
                                 [BEAM_OUTPUT_PATCH_STRAIN] = 0};
    if (r < model->n_outputs)
        return (struct row){model->output[r].vector, orders[model->output[r].kind]};
    return (struct row){model->port[(r - model->n_outputs) / 2].vector, (r - model->n_outputs) % 2};
}

static const beam_real *input_vector(const struct beam_model *model, int i)
{
    return i < model->n_inputs ? model->input[i].vector : model->base_load;
}

/* This pole's share of every state column, row, tap and compliance. */
static void add_pole(const struct beam_model *model, const struct pole_step *pole, struct beam_plan *plan)
{
    const int n_taps = plan->n.n_taps, inputs = plan->n.n_inputs + (plan->n.base_use >= 0);
    put_block(pole, plan->x.dt_s, plan);
    for (int i = 0; i < inputs; i++)
        put_input(pole, input_vector(model, i), pole->e_re[n_taps + 1], pole->e_im[n_taps + 1], plan->x.gamma[i]);
    for (int p = 0; p < model->n_ports; p++)
        put_input(pole, model->port[p].vector, pole->port_re[1], pole->port_im[1], plan->x.gamma_port[p]);
    for (int r = 0; r < model->n_outputs + 2 * model->n_ports; r++) {
        const struct row row = row_of(model, r);
        beam_real w_re, w_im;
        row_weights(pole, row.vector, row.order, &w_re, &w_im);
        plan->x.row[r][pole->slot] = w_re;
        if (!pole->real)
            plan->x.row[r][pole->slot + 1] = w_im;
        for (int i = 0; i < inputs; i++) {
            const beam_real b_re = dot(pole->shape_re, input_vector(model, i));
            const beam_real b_im = dot(pole->shape_im, input_vector(model, i));
            const beam_real g_re = w_re * b_re + w_im * b_im, g_im = w_im * b_re - w_re * b_im;
            for (int t = 0; t < n_taps; t++)
                plan->x.taps[(r * inputs + i) * n_taps + t] += g_re * pole->e_re[t + 1] + g_im * pole->e_im[t + 1];
        }
        for (int p = 0; p < model->n_ports; p++) {
            const beam_real b_re = dot(pole->shape_re, model->port[p].vector);
            const beam_real b_im = dot(pole->shape_im, model->port[p].vector);
            plan->x.compliance[r][p] +=
                (w_re * b_re + w_im * b_im) * pole->port_re[0] + (w_im * b_re - w_re * b_im) * pole->port_im[0];
        }
    }
}

/* Accelerations answer a force at once: cᵀM⁻¹b, M⁻¹ = ΨΨᵀ. */
static void add_feedthrough(const struct beam_model *model, const struct beam_work *work, struct beam_plan *plan)
{
    const int inputs = plan->n.n_inputs + (plan->n.base_use >= 0);
    for (int o = 0; o < model->n_outputs; o++) {
        if (model->output[o].kind != BEAM_OUTPUT_ACCELERATION)
            continue;
        beam_real inverse[BEAM_N] = {BEAM_K(0.0)}; /* M⁻¹c */
        for (int j = 0; j < BEAM_N; j++) {
            beam_real projection = BEAM_K(0.0);
            for (int i = 0; i < BEAM_N; i++)
                projection += work->modes.shape[i][j] * model->output[o].vector[i];
            for (int i = 0; i < BEAM_N; i++)
                inverse[i] += work->modes.shape[i][j] * projection;
        }
        for (int i = 0; i < inputs; i++) /* κ(l) = 1 at l = 0 only: the middle tap */
            plan->x.taps[(o * inputs + i) * plan->n.n_taps + plan->n.beam_latency] +=
                dot(inverse, input_vector(model, i));
        for (int p = 0; p < model->n_ports; p++)
            plan->x.compliance[o][p] += dot(inverse, model->port[p].vector);
        plan->x.base_gain[o] = BEAM_K(1.0);
    }
}

static enum beam_status make_counts(const struct beam_model *model, const struct beam_options *options,
                                    const struct beam_kernel *kernel, const struct beam_poles *poles, int *taps_used,
                                    int *history_used, struct beam_plan *plan)
{
    struct beam_plan_counts *n = &plan->n;
    enum beam_status status = BEAM_OK;
    if (options->law_evaluations < 0 || options->law_evaluations > 1000)
        return BEAM_ERROR_ARGUMENT;
    n->n_blocks = (beam_count)(poles->n_complex + (poles->n_real + 1) / 2);
    n->n_inputs = (beam_count)model->n_inputs;
    n->n_outputs = (beam_count)model->n_outputs;
    n->n_ports = (beam_count)model->n_ports;
    n->n_uses = (beam_count)model->n_uses;
    n->base_use = n->drive_input = -1;
    n->beam_latency = (beam_count)(kernel->half_width - 1);
    n->n_taps = (beam_count)(2 * kernel->half_width - 1);
    n->law_evaluations = (beam_count)(options->law_evaluations == 0 ? 16 : options->law_evaluations);
    for (int u = 0; u < model->n_uses; u++) {
        plan->use[u] = model->use[u];
        plan->use[u].channels = use_channels(model, &model->use[u]);
        if (model->use[u].effect->base && n->base_use < 0)
            n->base_use = (beam_count)u;
    }
    if (n->base_use >= 0 && !BEAM_BASE)
        return BEAM_ERROR_CAPACITY;
    for (int i = model->n_inputs - 1; i >= 0; i--)
        if (model->input[i].kind == BEAM_INPUT_PATCH_MOMENT)
            n->drive_input = (beam_count)i;
    for (int p = 0; p < model->n_ports; p++) {
        n->port_use[p] = (beam_count)model->port[p].use;
        n->port_coordinate[p] = (beam_count)model->port[p].coordinate;
        plan->x.weight[p] = model->port[p].weight;
    }
    const int inputs = n->n_inputs + (n->base_use >= 0);
    for (int i = 0; i < inputs && status == BEAM_OK; i++)
        status = beam_plan_reserve(n->n_taps + 1, history_used, &n->input_ring[i]);
    *taps_used = n->n_taps * inputs * (n->n_outputs + 2 * n->n_ports);
    return status != BEAM_OK || *taps_used <= BEAM_TAPS ? status : BEAM_ERROR_CAPACITY;
}

enum beam_status beam_factor(const struct beam_model *model, const struct beam_options *options, struct beam_work *work,
                             struct beam_plan *out)
{
    struct beam_kernel kernel;
    struct pole_step pole;
    int taps_used = 0, history_used = 0;
    if (!beam_finite(options->dt_s) || !beam_less(BEAM_K(0.0), options->dt_s))
        return BEAM_ERROR_INTERVAL;
    enum beam_status status = beam_kernel_make(options->hold, options->half_width, &kernel);
    if (status == BEAM_OK)
        status = beam_find_poles(model, work);
    if (status != BEAM_OK)
        return status;
    *out = (struct beam_plan){.n = {.n_blocks = 0}};
    out->x.dt_s = options->dt_s;
    status = make_counts(model, options, &kernel, &work->poles, &taps_used, &history_used, out);
    if (status != BEAM_OK)
        return status;
    for (int k = 0; k < work->poles.n_complex + work->poles.n_real; k++) {
        make_pole_step(&work->poles, k, &kernel, options->dt_s, &pole);
        add_pole(model, &pole, out);
    }
    add_feedthrough(model, work, out);
    return beam_plan_chains(model, &kernel, &taps_used, &history_used, out);
}
