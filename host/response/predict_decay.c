/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Unknown initial states: y(t) = Σ_k 2 Re(a_k c_k p_k^ν F(p_k) e^(p_k t)) with unknown complex amplitudes a_k, one for each
 * vibrating mode in the band; two columns (real and imaginary part of a_k) for each. A sensor's filter was at work before the
 * record began, too: one more column e^(p t) for its pole p on that channel; so was the recorder's, of which each pair of poles makes two columns on every
 * channel of a free decay. A blow has set a free beam moving as a whole, too, which the air slows down and what it hangs on turns back, far below its first mode: three columns on each channel, polynomials of time. Where laws or maps act on this motion, the
 * amplitudes' part is added to y here, and predict_law.c adds what laws do about it.
 */
#include "predictor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

struct decay {
    double complex p, shape; /* shape = c p^ν F(p) gain */
    double complex amplitude;
    double *column_re, *column_im; /* [n] */
};

static enum bf_status make_decay(const struct run *run, const struct predict_channel *channel, size_t mode,
                                 size_t nuisance, struct decay *out, struct bf_error *err)
{
    const struct predictor *p = run->p;
    size_t gain_parameter, pole = p->states.pole[mode];
    bool filtered;
    double complex F;
    out->p = p->system->p[pole];
    enum bf_status status = channel_filter(run, channel->record, channel->output, &out->p, 1, &F, &filtered, err);
    out->shape = p->states.sign[mode] * p->outputs[channel->output].alpha[pole] * F *
                 output_gain(run, channel->output, &gain_parameter);
    for (int i = 0; i < output_order(p->model.outputs[channel->output].kind); i++)
        out->shape *= out->p;
    out->amplitude = CMPLX(p->amplitude[nuisance], p->amplitude[nuisance + 1]);
    out->column_re = p->nuisance + nuisance * p->n_rows + channel->row;
    out->column_im = out->column_re + p->n_rows;
    return status;
}

static double interval_s(const struct run *run, const struct predict_channel *channel)
{
    return run->p->grids[run->p->plans[channel->record].grid].dt_s; /* of the true clock */
}

/* out[k] = a b[k], k < n. Real arithmetic: the products of C's complex type look after infinities that cannot occur here, at many times the cost. */
VECTOR_CLONES static void scale(size_t n, double a_re, double a_im, const double b_re[], const double b_im[],
                                double out_re[], double out_im[])
{
    for (size_t k = 0; k < n; k++) {
        out_re[k] = a_re * b_re[k] - a_im * b_im[k];
        out_im[k] = a_re * b_im[k] + a_im * b_re[k];
    }
}

/* re[k] + i im[k] = E e^(p k dt), k < n: one exponential in `BLOCK`; each value is the product of two of them, so that errors do not grow with k. */
static void fill_exponential(double complex E, double complex p, double dt_s, size_t n, double re[], double im[])
{
    enum { BLOCK = 64 };
    double turn_re[BLOCK], turn_im[BLOCK];
    for (size_t i = 0; i < BLOCK; i++) {
        const double complex turn = cexp(p * (double)i * dt_s);
        turn_re[i] = creal(turn), turn_im[i] = cimag(turn);
    }
    for (size_t k = 0; k < n; k += BLOCK) {
        const double complex first = E * cexp(p * (double)k * dt_s);
        scale(n - k < BLOCK ? n - k : BLOCK, creal(first), cimag(first), turn_re, turn_im, re + k, im + k);
    }
}

static void fill_columns(const struct predict_channel *channel, double dt_s, const struct decay *d)
{
    /* 2 Re(a shape e^(p t)) changes by Re(2 shape e^(p t)) with Re(a), and by Im of its conjugate with Im(a) */
    fill_exponential(2.0 * conj(d->shape), conj(d->p), dt_s, channel->n, d->column_re, d->column_im);
}

/* δ(shape)/shape and δp of one parameter. */
static double complex relative_change(const struct run *run, const struct predict_channel *channel, size_t pole,
                                      size_t j, double complex *dp)
{
    const struct predictor *p = run->p;
    const struct functional *c = &p->outputs[channel->output];
    double complex at = p->system->p[pole], change = 0.0, dF, F;
    bool filtered;
    struct bf_error err;
    size_t gain_parameter;
    double gain = output_gain(run, channel->output, &gain_parameter);
    *dp = run_structural(run, j) && p->system->derivative[j].p != NULL ? p->system->derivative[j].p[pole] : 0.0;
    if (run_structural(run, j)) {
        change += c->d_alpha[j * p->system->n_poles + pole] / c->alpha[pole];
        change += output_order(p->model.outputs[channel->output].kind) * *dp / at;
    }
    if (j == gain_parameter)
        change += 1.0 / gain;
    if (channel_filter(run, channel->record, channel->output, &at, 1, &F, &filtered, &err) == BF_OK && filtered) {
        double complex nearby[2] = {at * (1.0 + 1e-6), at * (1.0 - 1e-6)}, G[2];
        if (channel_filter(run, channel->record, channel->output, nearby, 2, G, &filtered, &err) == BF_OK)
            change += (G[0] - G[1]) / (nearby[0] - nearby[1]) / F * *dp; /* F'(p)/F δp, F rational and smooth there */
        if (channel_filter_derivative(run, channel->record, channel->output, j, &at, 1, &dF))
            change += dF / F;
    }
    return change;
}

/* column[k] += Re(a conj(x[k]) (change + slope k)); x is what fill_columns() has left, the conjugate of 2 shape e^(p t). */
VECTOR_CLONES static void add_change(size_t n, double complex a, double complex change, double complex slope,
                                     const double x_re[], const double x_im[], double column[])
{
    const double a_re = creal(a), a_im = cimag(a), c_re = creal(change), c_im = cimag(change);
    const double s_re = creal(slope), s_im = cimag(slope);
    for (size_t k = 0; k < n; k++) {
        const double re = a_re * x_re[k] + a_im * x_im[k], im = a_im * x_re[k] - a_re * x_im[k];
        column[k] += re * (c_re + s_re * (double)k) - im * (c_im + s_im * (double)k);
    }
}

static void add_derivatives(const struct run *run, const struct predict_channel *channel, const struct decay *d,
                            size_t pole)
{
    for (size_t j = 0; j < run->p->map.n; j++) {
        if (!run_wants(run, j))
            continue;
        double complex dp, change = relative_change(run, channel, pole, j, &dp);
        dp += d->p * run->p->geometry.clock_by[j] / run->p->geometry.clock; /* d(p t) by the clock */
        add_change(channel->n, d->amplitude, change, dp * interval_s(run, channel), d->column_re, d->column_im,
                   run_column(run, j, channel));
    }
}

/* The column of one filter's initial state, and its derivative at the amplitude. */
static enum bf_status filter_column(const struct run *run, const struct predict_channel *channel, size_t e,
                                    size_t nuisance, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct beam_effect *effect = p->model.effects[e].effect;
    struct beam_filter_output filter;
    double parameters[BEAM_EFFECT_PARAMETERS], dt_s = interval_s(run, channel);
    double *column = p->nuisance + nuisance * p->n_rows + channel->row;
    memset(&filter, 0, sizeof filter);
    parameter_map_effect(&p->map, channel->record, e, run->theta, parameters);
    if (effect->filter(parameters, &filter) != 0)
        return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
    double a1 = filter.value.a1, a0 = filter.value.a0;
    if (!(a1 < 0.0 || a1 > 0.0))
        return BF_OK;
    for (size_t k = 0; k < channel->n; k++)
        column[k] = exp(-a0 / a1 * (double)k * dt_s);
    for (size_t j = 0; run->want != NULL && j < p->map.n; j++) {
        double dp = -a0 / a1 * p->geometry.clock_by[j] / p->geometry.clock; /* d(p t) by the clock */
        for (int s = 0; s < effect->n_parameters; s++)
            if (parameter_map_slot(&p->map, channel->record, e, s) == j)
                dp += (a0 * filter.by_parameter[s].a1 - filter.by_parameter[s].a0 * a1) / (a1 * a1);
        if (!run_wants(run, j) || !(dp < 0.0 || dp > 0.0))
            continue;
        double *row = run_column(run, j, channel);
        for (size_t k = 0; k < channel->n; k++)
            row[k] += p->amplitude[nuisance] * dp * (double)k * dt_s * column[k];
    }
    return BF_OK;
}

static enum bf_status filter_columns(const struct run *run, size_t record, size_t first, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    enum bf_status status = BF_OK;
    for (size_t c = 0; c < plan->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[plan->first_channel + c];
        for (size_t e = 0; status == BF_OK && e < p->model.n_effects; e++)
            if (filter_remembers(p, e, channel->output))
                status = filter_column(run, channel, e, first++, err);
    }
    return status;
}

/* The recorder's filter, which rings of what has set the beam moving: its columns begin at `first` of the nuisance. */
static void recorder_columns(const struct predictor *p, size_t record, size_t first)
{
    const struct record_plan *plan = &p->plans[record];
    for (size_t c = 0; c < plan->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[plan->first_channel + c];
        for (size_t i = 0; i < plan->n_rings; i++, first++)
            recorder_ring(plan->ring, i, channel->n, p->nuisance + first * p->n_rows + channel->row);
    }
}

/* Legendre's polynomials over the record. */
static void whole_columns(const struct predictor *p, size_t record, size_t first)
{
    const struct record_plan *plan = &p->plans[record];
    const size_t n_channels = whole_unknowns(p, record) / WHOLE_TERMS;
    for (size_t c = 0; c < n_channels; c++) {
        const struct predict_channel *channel = &p->channels[plan->first_channel + c];
        double *column = p->nuisance + (first + WHOLE_TERMS * c) * p->n_rows + channel->row;
        for (size_t k = 0; k < channel->n; k++) {
            const double at = 2.0 * ((double)k + 0.5) / (double)channel->n - 1.0;
            column[k] = 1.0, column[p->n_rows + k] = at, column[2 * p->n_rows + k] = 1.5 * at * at - 0.5;
        }
    }
}

static enum bf_status channel_decays(const struct run *run, const struct predict_channel *channel, size_t modes,
                                     struct bf_error *err)
{
    const struct predictor *p = run->p;
    enum bf_status status = BF_OK;
    for (size_t i = 0; status == BF_OK && i < modes; i++) {
        struct decay d;
        status = make_decay(run, channel, i, p->first_state[channel->record] + 2 * i, &d, err);
        if (status != BF_OK)
            break;
        fill_columns(channel, interval_s(run, channel), &d);
        if (run->want != NULL)
            add_derivatives(run, channel, &d, p->states.pole[i]);
    }
    return status;
}

/* y += Σ amplitude · column */
static void add_states(const struct run *run, const struct predict_channel *channel)
{
    const struct predictor *p = run->p;
    size_t first = p->first_state[channel->record], n = state_unknowns(p, channel->record);
    for (size_t i = first; i < first + n; i++)
        add_scaled(channel->n, p->amplitude[i], p->nuisance + i * p->n_rows + channel->row, p->y + channel->row);
}

enum bf_status predict_decay(const struct run *run, size_t record, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    size_t modes = state_modes_of(p, record), n = modes < p->states.n ? modes : p->states.n;
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < plan->n_channels; c++)
        status = channel_decays(run, &p->channels[plan->first_channel + c], n, err);
    if (status == BF_OK)
        status = filter_columns(run, record, p->first_state[record] + 2 * modes, err);
    const size_t whole = p->first_state[record] + state_unknowns(p, record) - whole_unknowns(p, record);
    if (status == BF_OK)
        recorder_columns(p, record, whole - recorder_unknowns(p, record));
    if (status == BF_OK && plan->free_state)
        whole_columns(p, record, whole);
    for (size_t c = 0; status == BF_OK && states_bend(p) && c < plan->n_channels; c++)
        add_states(run, &p->channels[plan->first_channel + c]);
    return status;
}
