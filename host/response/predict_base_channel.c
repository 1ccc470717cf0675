/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a shaken clamp adds to every channel: the closed form of predict_base.c, then the channel's filters. */
#include "predict_base.h"

#include <stdint.h>
#include <stdlib.h>

struct channel_work {
    struct question q;
    const struct predict_channel *channel;
    const struct response_grid *grid;
    bool filtered;
    double *x;             /* [n + n_tail] */
    double complex *F, *Y; /* [m] */
};

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
    const struct run *run = w->q.run;
    size_t output = w->channel->output;
    double complex *slope = bf_alloc(w->grid->m, sizeof *slope);
    double clock_by = run->p->geometry.clock_by[parameter] / run->p->geometry.clock;
    enum bf_status status = BF_OK;
    if (w->q.steady) {
        struct question changed = w->q;
        changed.filter_parameter = parameter;
        base_answer(&changed, row);
    } else if (channel_filter_derivative(run, w->channel->record, output, parameter, w->grid->s, w->grid->m, slope)) {
        clear(w);
        base_answer(&w->q, w->x);
        status = put(w, slope, row, err);
    } else if (w->filtered && (clock_by < 0.0 || clock_by > 0.0)) {
        status = channel_filter_slope(run, w->channel->record, output, w->grid->s, w->grid->m, slope, err);
        for (size_t k = 0; k < w->grid->m; k++)
            slope[k] *= -clock_by * w->grid->s[k];
        clear(w);
        base_answer(&w->q, w->x);
        if (status == BF_OK)
            status = put(w, slope, row, err);
    }
    free(slope);
    return status;
}

static enum bf_status channel_derivatives(struct channel_work *w, double gain, size_t gain_parameter,
                                          struct bf_error *err)
{
    const struct run *run = w->q.run;
    enum bf_status status = BF_OK;
    for (size_t j = 0; status == BF_OK && j < run->p->map.n; j++) {
        if (!run_wants(run, j))
            continue;
        double *row = run_column(run, j, w->channel);
        clear(w);
        bool any = base_answer_derivative(&w->q, j, w->x);
        if (j == gain_parameter) {
            struct question unit = w->q;
            unit.F /= gain;
            clear(w);
            base_answer(&unit, w->x);
            any = true;
        }
        if (any)
            status = put(w, w->F, row, err);
        if (status == BF_OK)
            status = put_filter_change(w, j, row, err);
    }
    return status;
}

static enum bf_status shake_channel(const struct run *run, const struct predict_channel *channel, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[channel->record];
    const struct response_grid *grid = &p->grids[plan->grid];
    enum output_kind kind = p->model.outputs[channel->output].kind;
    size_t gain_parameter;
    double gain = output_gain(run, channel->output, &gain_parameter);
    struct channel_work w = {.channel = channel, .grid = grid};
    w.q = (struct question){.run = run,
                            .record = channel->record,
                            .f = &p->outputs[channel->output],
                            .order = output_order(kind),
                            .absolute = kind != OUTPUT_PATCH_STRAIN,
                            .steady = plan->free_decay,
                            .F = gain,
                            .output = plan->free_decay ? channel->output : SIZE_MAX,
                            .filter_parameter = SIZE_MAX,
                            .t0_s = (double)plan->start * grid->dt_s,
                            .h_s = grid->dt_s,
                            .n = channel->n};
    w.x = bf_alloc(grid->n + grid->n_tail, sizeof *w.x);
    w.F = bf_alloc(2 * grid->m, sizeof *w.F);
    w.Y = w.F + grid->m;
    enum bf_status status =
        channel_filter(run, channel->record, channel->output, grid->s, grid->m, w.F, &w.filtered, err);
    if (w.filtered && !w.q.steady)
        w.q.n = grid->n + grid->n_tail;
    if (status == BF_OK) {
        base_answer(&w.q, w.x);
        status = put(&w, w.F, run->out->y + channel->row, err);
    }
    if (status == BF_OK && run->want != NULL)
        status = channel_derivatives(&w, gain, gain_parameter, err);
    free(w.x);
    free(w.F);
    return status;
}

enum bf_status predict_base(const struct run *run, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t c = 0; run->p->base_load != NULL && status == BF_OK && c < run->p->n_channels; c++)
        status = shake_channel(run, &run->p->channels[c], err);
    return status;
}
