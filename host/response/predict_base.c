/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The shaken clamp of a record, and what it adds to a channel: the motion of clamp_motion.h behind the channel's filters. */
#include "clamp_motion.h"
#include "predictor.h"

#include <stdint.h>
#include <stdlib.h>

/* ---- The clamp ---- */

bool clamp_new(const struct run *run, size_t record, struct clamp *out)
{
    const struct predictor *p = run->p;
    if (p->base_load == NULL)
        return false;
    *out = (struct clamp){.system = p->system,
                          .load = p->base_load,
                          .structural = run_structure(run),
                          .clock = p->geometry.clock,
                          .clock_by = p->geometry.clock_by};
    out->tones = bf_alloc(p->model.n_effects, sizeof *out->tones);
    for (size_t e = 0; e < p->model.n_effects; e++) {
        const struct beam_effect *effect = p->model.effects[e].effect;
        struct clamp_tone at = {.n_parameters = effect->n_parameters};
        double parameters[BEAM_EFFECT_PARAMETERS];
        if (effect->tone == NULL)
            continue;
        parameter_map_effect(&p->map, record, e, run->theta, parameters);
        if (effect->tone(parameters, &at.tone) != 0)
            continue;
        for (int s = 0; s < effect->n_parameters; s++)
            at.parameter[s] = parameter_map_slot(&p->map, record, e, s);
        out->tones[out->n_tones++] = at;
    }
    return true;
}

void clamp_free(struct clamp *clamp)
{
    free(clamp->tones);
    *clamp = (struct clamp){0};
}

/* ---- A channel ---- */

struct channel_work {
    const struct run *run;
    struct clamp_question q;
    const struct predict_channel *channel;
    const struct response_grid *grid;
    bool filtered;
    double *x;                      /* [n + n_tail] */
    double complex *F, *Y;          /* [m] */
    double complex *filter, *slope; /* [n_tones] of a steady motion: the channel's filters at each tone */
};

/* The channel's filters at every tone; `parameter` not SIZE_MAX: their derivative by it. */
static void filter_tones(struct channel_work *w, size_t parameter)
{
    const struct clamp *clamp = w->q.clamp;
    size_t record = w->channel->record, output = w->channel->output;
    struct bf_error err;
    bool filtered;
    for (size_t i = 0; i < clamp->n_tones; i++) {
        double complex s = CMPLX(0.0, clamp_omega(&clamp->tones[i])), *F = &w->filter[i], *slope = &w->slope[i];
        *F = *slope = 0.0;
        if (parameter != SIZE_MAX)
            (void)channel_filter_derivative(w->run, record, output, parameter, &s, 1, F);
        else if (channel_filter(w->run, record, output, &s, 1, F, &filtered, &err) == BF_OK)
            (void)channel_filter_slope(w->run, record, output, &s, 1, slope, &err);
    }
}

/* row += x behind the filters of the channel (F), or as it is. */
static enum bf_status put(struct channel_work *w, const double complex F[], double row[], struct bf_error *err)
{
    size_t n = w->channel->n;
    if (w->q.steady || !w->filtered) {
        for (size_t k = 0; k < n; k++)
            row[k] += w->x[k];
        return BF_OK;
    }
    size_t total = w->grid->n + w->grid->n_tail; /* the closed form goes on past the record: only the fade is needed */
    double *faded = bf_alloc(total, sizeof *faded);
    response_tail(w->grid, w->x, total, faded);
    enum bf_status status = response_transform(w->grid, faded, total, w->Y, err);
    for (size_t k = 0; status == BF_OK && k < w->grid->m; k++)
        w->Y[k] *= F[k];
    if (status == BF_OK)
        status = response_back(w->grid, w->Y, faded, err);
    for (size_t k = 0; status == BF_OK && k < n; k++)
        row[k] += faded[k];
    free(faded);
    return status;
}

static void clear(struct channel_work *w)
{
    for (size_t k = 0; k < w->q.n; k++)
        w->x[k] = 0.0;
}

/* The channel's filters as a parameter changes them. */
static enum bf_status put_filter_change(struct channel_work *w, size_t parameter, double row[], struct bf_error *err)
{
    const struct run *run = w->run;
    size_t output = w->channel->output;
    double complex *slope = bf_alloc(w->grid->m, sizeof *slope);
    double clock_by = run->p->geometry.clock_by[parameter] / run->p->geometry.clock;
    enum bf_status status = BF_OK;
    if (w->q.steady) {
        filter_tones(w, parameter);
        clamp_motion_add(&w->q, row);
        filter_tones(w, SIZE_MAX);
    } else if (channel_filter_derivative(run, w->channel->record, output, parameter, w->grid->s, w->grid->m, slope)) {
        clear(w);
        clamp_motion_add(&w->q, w->x);
        status = put(w, slope, row, err);
    } else if (w->filtered && (clock_by < 0.0 || clock_by > 0.0)) {
        status = channel_filter_slope(run, w->channel->record, output, w->grid->s, w->grid->m, slope, err);
        for (size_t k = 0; k < w->grid->m; k++)
            slope[k] *= -clock_by * w->grid->s[k];
        clear(w);
        clamp_motion_add(&w->q, w->x);
        if (status == BF_OK)
            status = put(w, slope, row, err);
    }
    free(slope);
    return status;
}

static enum bf_status channel_derivatives(struct channel_work *w, double gain, size_t gain_parameter,
                                          struct bf_error *err)
{
    const struct run *run = w->run;
    enum bf_status status = BF_OK;
    for (size_t j = 0; status == BF_OK && j < run->p->map.n; j++) {
        if (!run_wants(run, j))
            continue;
        double *row = run_column(run, j, w->channel);
        clear(w);
        bool any = clamp_derivative_add(&w->q, j, w->x);
        if (j == gain_parameter) {
            struct clamp_question unit = w->q;
            unit.gain /= gain;
            clear(w);
            clamp_motion_add(&unit, w->x);
            any = true;
        }
        if (any)
            status = put(w, w->F, row, err);
        if (status == BF_OK)
            status = put_filter_change(w, j, row, err);
    }
    return status;
}

static enum bf_status shake_channel(const struct run *run, const struct clamp *clamp,
                                    const struct predict_channel *channel, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[channel->record];
    const struct response_grid *grid = &p->grids[plan->grid];
    enum output_kind kind = p->model.outputs[channel->output].kind;
    size_t gain_parameter;
    double gain = output_gain(run, channel->output, &gain_parameter);
    struct channel_work w = {.run = run, .channel = channel, .grid = grid};
    w.q = (struct clamp_question){.clamp = clamp,
                                  .f = &p->outputs[channel->output],
                                  .order = output_order(kind),
                                  .absolute = kind != OUTPUT_PATCH_STRAIN,
                                  .steady = plan->free_state,
                                  .gain = gain,
                                  .t0_s = (double)plan->start * grid->dt_s,
                                  .h_s = grid->dt_s,
                                  .n = channel->n};
    w.filter = bf_alloc(2 * clamp->n_tones, sizeof *w.filter);
    w.slope = w.filter + clamp->n_tones;
    if (plan->free_state) {
        filter_tones(&w, SIZE_MAX);
        w.q.filter = w.filter;
        w.q.slope = w.slope;
    }
    w.x = bf_alloc(grid->n + grid->n_tail, sizeof *w.x);
    w.F = bf_alloc(2 * grid->m, sizeof *w.F);
    w.Y = w.F + grid->m;
    enum bf_status status =
        channel_filter(run, channel->record, channel->output, grid->s, grid->m, w.F, &w.filtered, err);
    if (w.filtered && !w.q.steady)
        w.q.n = grid->n + grid->n_tail;
    if (status == BF_OK) {
        clamp_motion_add(&w.q, w.x);
        status = put(&w, w.F, run->out->y + channel->row, err);
    }
    if (status == BF_OK && run->want != NULL)
        status = channel_derivatives(&w, gain, gain_parameter, err);
    free(w.x);
    free(w.F);
    free(w.filter);
    return status;
}

enum bf_status predict_base(const struct run *run, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < run->p->n_channels; c++) {
        const struct predict_channel *channel = &run->p->channels[c];
        struct clamp clamp;
        if (!clamp_new(run, channel->record, &clamp))
            continue;
        status = shake_channel(run, &clamp, channel, err);
        clamp_free(&clamp);
    }
    return status;
}
