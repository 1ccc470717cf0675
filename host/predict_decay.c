/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Free decays: y(t) = Σ_k 2 Re(a_k c_k p_k^ν F(p_k) e^(p_k t)) with unknown complex amplitudes a_k, one for each
 * vibrating mode in the band; two columns (real and imaginary part of a_k) for each.
 */
#include "predict_work.h"

#include <math.h>
#include <stdlib.h>

/* Modes above this part of the sampling frequency are not seen. */
static const double band_part = 0.45;

static bool in_band(const struct predictor *p, size_t record, size_t pole)
{
    double frequency_Hz = cimag(p->system->p[pole]) / (2.0 * acos(-1.0));
    return pole < p->system->n_pairs && frequency_Hz * p->records[record].dt_s < band_part;
}

/* Poles are not sorted: the pairs by ascending frequency, the lowest `limit` of them. */
static size_t lowest_poles(const struct predictor *p, size_t limit, size_t out[])
{
    size_t count = 0;
    for (size_t k = 0; k < p->system->n_pairs; k++) {
        size_t at = count;
        while (at > 0 && cimag(p->system->p[out[at - 1]]) > cimag(p->system->p[k])) {
            out[at] = out[at - 1];
            at--;
        }
        out[at] = k;
        count++;
    }
    return count < limit ? count : limit;
}

size_t decay_unknowns(const struct predictor *p, size_t record)
{
    size_t *poles = bf_alloc(p->system->n_poles, sizeof *poles);
    size_t n = 0, pairs = lowest_poles(p, p->system->n_pairs, poles);
    while (n < pairs && in_band(p, record, poles[n]))
        n++;
    free(poles);
    return 2 * n;
}

struct decay {
    double complex p, shape; /* shape = c p^ν F(p) gain */
    double complex amplitude;
    double *column_re, *column_im; /* [n] */
};

static enum bf_status make_decay(const struct run *run, const struct predict_channel *channel, size_t pole,
                                 size_t nuisance, struct decay *out, struct bf_error *err)
{
    const struct predictor *p = run->p;
    size_t gain_parameter;
    bool filtered;
    double complex F;
    out->p = p->system->p[pole];
    enum bf_status status = channel_filter(run, channel->record, channel->output, &out->p, 1, &F, &filtered, err);
    out->shape = p->outputs[channel->output].alpha[pole] * F * output_gain(run, channel->output, &gain_parameter);
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

static void fill_columns(const struct predict_channel *channel, double dt_s, const struct decay *d)
{
    for (size_t k = 0; k < channel->n; k++) {
        double complex x = 2.0 * d->shape * cexp(d->p * (double)k * dt_s);
        d->column_re[k] = creal(x);
        d->column_im[k] = -cimag(x);
    }
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

static void add_derivatives(const struct run *run, const struct predict_channel *channel, const struct decay *d,
                            size_t pole)
{
    for (size_t j = 0; j < run->p->map.n; j++) {
        if (!run_wants(run, j))
            continue;
        double complex dp, change = relative_change(run, channel, pole, j, &dp);
        dp += d->p * run->p->geometry.clock_by[j] / run->p->geometry.clock; /* d(p t) by the clock */
        double *column = run_column(run, j, channel);
        for (size_t k = 0; k < channel->n; k++) {
            double complex x = CMPLX(d->column_re[k], -d->column_im[k]); /* 2 shape e^(pt) */
            column[k] += creal(d->amplitude * x * (change + dp * (double)k * interval_s(run, channel)));
        }
    }
}

enum bf_status predict_decay(const struct run *run, size_t record, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    size_t *poles = bf_alloc(p->system->n_poles, sizeof *poles);
    size_t last = record + 1 < p->n_records ? p->plans[record + 1].first_nuisance : p->n_nuisance;
    size_t n = lowest_poles(p, (last - plan->first_nuisance) / 2, poles);
    enum bf_status status = BF_OK;
    for (size_t c = 0; c < plan->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[plan->first_channel + c];
        for (size_t i = 0; status == BF_OK && i < n; i++) {
            struct decay d;
            status = make_decay(run, channel, poles[i], plan->first_nuisance + 2 * i, &d, err);
            if (status != BF_OK)
                break;
            fill_columns(channel, interval_s(run, channel), &d);
            if (run->want != NULL)
                add_derivatives(run, channel, &d, poles[i]);
        }
    }
    free(poles);
    return status;
}
