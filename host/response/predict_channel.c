/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The measurement chain. On each output channel: first every filter (in the frequency domain, so their order does not
 * matter), then maps and signals in the order in which the effects were added.
 */
#include "predictor.h"

#include <stdlib.h>
#include <string.h>

/* ---- Filters ---- */

static double complex filter_at(const struct beam_filter *f, double complex s)
{
    return (f->b1 * s + f->b0) / (f->a1 * s + f->a0) * cexp(-s * f->delay_s);
}

static double complex filter_change(const struct beam_filter *f, const struct beam_filter *d, double complex s)
{
    double complex N = f->b1 * s + f->b0, D = f->a1 * s + f->a0;
    double complex dN = d->b1 * s + d->b0, dD = d->a1 * s + d->a0;
    return ((dN * D - N * dD) / (D * D) - N / D * s * d->delay_s) * cexp(-s * f->delay_s);
}

static enum bf_status effect_filter(const struct run *run, size_t record, size_t e, struct beam_filter_output *out,
                                    struct bf_error *err)
{
    double p[BEAM_EFFECT_PARAMETERS];
    parameter_map_effect(&run->p->map, record, e, run->theta, p);
    memset(out, 0, sizeof *out);
    const struct beam_effect *effect = run->p->model.effects[e].effect;
    if (effect->filter(p, out) != 0)
        return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
    return BF_OK;
}

enum bf_status channel_filter(const struct run *run, size_t record, size_t output, const double complex s[], size_t m,
                              double complex F[], bool *any, struct bf_error *err)
{
    *any = false;
    for (size_t k = 0; k < m; k++)
        F[k] = 1.0;
    for (size_t e = 0; e < run->p->model.n_effects; e++) {
        if (run->p->model.effects[e].effect->filter == NULL || !effect_on_output(&run->p->model, e, output))
            continue;
        struct beam_filter_output filter;
        enum bf_status status = effect_filter(run, record, e, &filter, err);
        if (status != BF_OK)
            return status;
        *any = true;
        for (size_t k = 0; k < m; k++)
            F[k] *= filter_at(&filter.value, s[k]);
    }
    return BF_OK;
}

/* d ln F/ds of one filter. */
static double complex filter_slope(const struct beam_filter *f, double complex s)
{
    return f->b1 / (f->b1 * s + f->b0) - f->a1 / (f->a1 * s + f->a0) - f->delay_s;
}

enum bf_status channel_filter_slope(const struct run *run, size_t record, size_t output, const double complex s[],
                                    size_t m, double complex slope[], struct bf_error *err)
{
    bool any;
    double complex *F = bf_grow(NULL, m, sizeof *F);
    enum bf_status status = channel_filter(run, record, output, s, m, F, &any, err);
    memset(slope, 0, m * sizeof *slope);
    for (size_t e = 0; status == BF_OK && any && e < run->p->model.n_effects; e++) {
        struct beam_filter_output filter;
        if (run->p->model.effects[e].effect->filter == NULL || !effect_on_output(&run->p->model, e, output))
            continue;
        status = effect_filter(run, record, e, &filter, err);
        for (size_t k = 0; status == BF_OK && k < m; k++)
            slope[k] += F[k] * filter_slope(&filter.value, s[k]);
    }
    free(F);
    return status;
}

/* The effect and slot that stand at `parameter` in this record. */
static bool find_slot(const struct run *run, size_t record, size_t parameter, size_t *effect, int *slot)
{
    for (*effect = 0; *effect < run->p->model.n_effects; (*effect)++)
        for (*slot = 0; *slot < run->p->model.effects[*effect].effect->n_parameters; (*slot)++)
            if (parameter_map_slot(&run->p->map, record, *effect, *slot) == parameter)
                return true;
    return false;
}

bool channel_filter_derivative(const struct run *run, size_t record, size_t output, size_t parameter,
                               const double complex s[], size_t m, double complex dF[])
{
    size_t owner;
    int slot;
    struct bf_error err;
    struct beam_filter_output filter;
    if (!find_slot(run, record, parameter, &owner, &slot) || run->p->model.effects[owner].effect->filter == NULL ||
        !effect_on_output(&run->p->model, owner, output))
        return false;
    for (size_t k = 0; k < m; k++)
        dF[k] = 1.0;
    for (size_t e = 0; e < run->p->model.n_effects; e++) {
        if (run->p->model.effects[e].effect->filter == NULL || !effect_on_output(&run->p->model, e, output))
            continue;
        if (effect_filter(run, record, e, &filter, &err) != BF_OK)
            return false;
        for (size_t k = 0; k < m; k++)
            dF[k] *= e == owner ? filter_change(&filter.value, &filter.by_parameter[slot], s[k])
                                : filter_at(&filter.value, s[k]);
    }
    return true;
}

/* ---- Maps and signals ---- */

/* The record's first patch_moment input, which feedthrough leaks from. */
static const double *drive_column(const struct run *run, const struct record_plan *plan)
{
    for (size_t i = 0; i < run->p->model.n_inputs; i++)
        if (run->p->model.inputs[i].kind == INPUT_PATCH_MOMENT && plan->input[i] != NULL)
            return plan->input[i] + plan->start;
    return NULL;
}

static void scale_row(const struct run *run, const struct predict_channel *channel, size_t k, double y_v)
{
    for (size_t j = 0; j < run->p->map.n; j++)
        if (run_wants(run, j))
            run_column(run, j, channel)[k] *= y_v;
}

/* The columns of a record's initial state follow the slope of a map, too. */
static void scale_states(const struct run *run, const struct predict_channel *channel, size_t k, double y_v)
{
    const struct predictor *p = run->p;
    size_t first = p->first_state[channel->record], n = state_unknowns(p, channel->record);
    for (size_t i = first; i < first + n; i++)
        p->nuisance[i * p->n_rows + channel->row + k] *= y_v;
}

/* A signal of time under another clock: t ∂signal/∂t, from a difference of order four. */
static void signal_by_clock(const struct run *run, const struct predict_channel *channel,
                            const struct beam_effect *effect, const double parameters[], size_t k, double t)
{
    const double h = 0.01 * channel->dt_s, weight[2] = {8.0 / 12.0, -1.0 / 12.0};
    double slope = 0.0;
    bool known = false;
    for (size_t j = 0; j < run->p->map.n; j++) {
        double by = run->p->geometry.clock_by[j];
        if (!run_wants(run, j) || !(by < 0.0 || by > 0.0))
            continue;
        for (int i = 1; !known && i <= 2; i++) {
            struct beam_sample_output up = {.y = 0.0}, down = {.y = 0.0};
            if (effect->signal(parameters, t + i * h, 0.0, &up) == 0 &&
                effect->signal(parameters, t - i * h, 0.0, &down) == 0)
                slope += weight[i - 1] * (up.y - down.y) / h;
        }
        known = true;
        run_column(run, j, channel)[k] += by * slope * t / run->p->geometry.clock;
    }
}

static enum bf_status apply_sample_effect(const struct run *run, const struct predict_channel *channel, size_t e,
                                          struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[channel->record];
    const struct beam_effect *effect = p->model.effects[e].effect;
    const double *u = drive_column(run, plan);
    const double dt_s = p->grids[plan->grid].dt_s; /* of the true clock */
    double parameters[BEAM_EFFECT_PARAMETERS];
    parameter_map_effect(&p->map, channel->record, e, run->theta, parameters);
    if (effect->map != NULL && p->options.intersample == INTERSAMPLE_BAND_LIMITED &&
        map_bends(effect, parameters, run->out->y + channel->row, u, channel->n))
        return map_bend(run, channel, e, parameters, u, err);
    for (size_t k = 0; k < channel->n; k++) {
        struct beam_sample_output out = {.y_v = 1.0};
        double *y = &run->out->y[channel->row + k], t = (double)(plan->start + k) * dt_s;
        int failed = effect->map != NULL ? effect->map(parameters, *y, u != NULL ? u[k] : 0.0, &out)
                                         : effect->signal(parameters, t, *y, &out);
        if (failed != 0)
            return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
        *y = out.y;
        if (effect->map != NULL)
            scale_states(run, channel, k, out.y_v);
        if (run->want == NULL)
            continue;
        if (effect->map != NULL)
            scale_row(run, channel, k, out.y_v);
        for (int slot = 0; slot < effect->n_parameters; slot++) {
            size_t j = parameter_map_slot(&p->map, channel->record, e, slot);
            if (run_wants(run, j))
                run_column(run, j, channel)[k] += out.y_p[slot];
        }
        if (effect->signal != NULL)
            signal_by_clock(run, channel, effect, parameters, k, t);
    }
    return BF_OK;
}

enum bf_status channel_samples(const struct run *run, const struct predict_channel *channel, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t e = 0; status == BF_OK && e < run->p->model.n_effects; e++) {
        const struct beam_effect *effect = run->p->model.effects[e].effect;
        if ((effect->map != NULL || effect->signal != NULL) && effect_on_output(&run->p->model, e, channel->output))
            status = apply_sample_effect(run, channel, e, err);
    }
    return status;
}
