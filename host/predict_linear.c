/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The response of the linear model to the recorded inputs: Y_o(s) = F_o Ks s^ν Σ_i H_oi KB U_i, and its derivatives. */
#include "predict_work.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Work arrays of one grid. H and dH of a pair are shared by all records of the grid. */
struct pair {
    double complex *H;  /* [m]; NULL: this pair is not needed */
    double complex *dH; /* [n_parameters][m] structural derivatives */
};

struct grid_work {
    size_t grid, m;
    struct pair *pairs;    /* [n_outputs][n_inputs] */
    double complex *F, *Y, *Z, *sum;
};

static bool record_uses(const struct record_plan *plan, const struct predictor *p, size_t output, size_t input)
{
    if (plan->input[input] == NULL)
        return false;
    for (size_t c = 0; c < plan->n_channels; c++)
        if (p->channels[plan->first_channel + c].output == output)
            return true;
    return false;
}

static bool pair_needed(const struct predictor *p, size_t grid, size_t output, size_t input)
{
    for (size_t r = 0; r < p->n_records; r++)
        if (p->plans[r].grid == grid && record_uses(&p->plans[r], p, output, input))
            return true;
    return false;
}

static void fill_pair(const struct run *run, size_t grid, size_t output, size_t input, struct pair *pair)
{
    const struct predictor *p = run->p;
    size_t m = p->grids[grid].m, n_poles = p->system->n_poles;
    const struct functional *c = &p->outputs[output], *b = &p->inputs[input];
    int order = output_order(p->model.outputs[output].kind);
    pair->H = bf_alloc(m, sizeof *pair->H);
    response_value(p->kernels[grid], order, c->alpha, b->alpha, pair->H);
    if (run->want == NULL)
        return;
    pair->dH = bf_alloc(m * p->map.n, sizeof *pair->dH);
    for (size_t j = 0; j < p->map.n; j++)
        if (run_structural(run, j))
            response_derivative(p->kernels[grid], order, c->alpha, b->alpha, c->d_alpha + j * n_poles,
                                b->d_alpha + j * n_poles, p->system->derivative[j].p, pair->dH + j * m);
}

/* sum = Σ_i gain_i H_i U_i over the record's inputs; `derivative`: dH of that parameter instead of H. */
static void sum_inputs(const struct run *run, const struct grid_work *w, const struct record_plan *plan, size_t output,
                       size_t derivative, double complex sum[])
{
    const struct predictor *p = run->p;
    memset(sum, 0, w->m * sizeof *sum);
    for (size_t i = 0; i < p->model.n_inputs; i++) {
        if (plan->input[i] == NULL)
            continue;
        size_t parameter;
        double gain = input_gain(run, i, &parameter);
        const struct pair *pair = &w->pairs[output * p->model.n_inputs + i];
        const double complex *H = pair->H;
        if (derivative != SIZE_MAX && derivative == parameter)
            gain = 1.0; /* d/dKB */
        else if (derivative != SIZE_MAX && derivative == p->map.KB)
            continue;
        else if (derivative != SIZE_MAX)
            H = pair->dH + derivative * w->m;
        for (size_t k = 0; k < w->m; k++)
            sum[k] += gain * (H[k] * plan->U[i][k]);
    }
}

static enum bf_status put(const struct run *run, const struct grid_work *w, const struct predict_channel *channel,
                          double scale, const double complex F[], const double complex Y[], double out[],
                          struct bf_error *err)
{
    for (size_t k = 0; k < w->m; k++)
        w->Z[k] = scale * (F[k] * Y[k]);
    (void)channel;
    return response_back(&run->p->grids[w->grid], w->Z, out, err);
}

static enum bf_status put_derivatives(const struct run *run, const struct grid_work *w,
                                      const struct predict_channel *channel, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[channel->record];
    size_t gain_parameter;
    double gain = output_gain(run, channel->output, &gain_parameter);
    enum bf_status status = BF_OK;
    double complex *dF = bf_alloc(w->m, sizeof *dF);
    for (size_t j = 0; status == BF_OK && j < p->map.n; j++) {
        if (!run_wants(run, j))
            continue;
        double *column = run_column(run, j, channel);
        if (j == gain_parameter) {
            status = put(run, w, channel, 1.0, w->F, w->Y, column, err);
        } else if (run_structural(run, j) || j == p->map.KB) {
            sum_inputs(run, w, plan, channel->output, j, w->sum);
            status = put(run, w, channel, gain, w->F, w->sum, column, err);
        } else if (channel_filter_derivative(run, channel->record, channel->output, j, p->grids[w->grid].s, w->m, dF)) {
            status = put(run, w, channel, gain, dF, w->Y, column, err);
        }
    }
    free(dF);
    return status;
}

static enum bf_status channel_response(const struct run *run, const struct grid_work *w,
                                       const struct predict_channel *channel, struct bf_error *err)
{
    const struct predictor *p = run->p;
    size_t gain_parameter;
    double gain = output_gain(run, channel->output, &gain_parameter);
    bool filtered;
    enum bf_status status = channel_filter(run, channel->record, channel->output, p->grids[w->grid].s, w->m, w->F,
                                           &filtered, err);
    if (status != BF_OK)
        return status;
    sum_inputs(run, w, &p->plans[channel->record], channel->output, SIZE_MAX, w->Y);
    status = put(run, w, channel, gain, w->F, w->Y, run->out->y + channel->row, err);
    if (status == BF_OK && run->want != NULL)
        status = put_derivatives(run, w, channel, err);
    return status;
}

static enum bf_status grid_response(const struct run *run, size_t grid, struct bf_error *err)
{
    const struct predictor *p = run->p;
    size_t n_pairs = p->model.n_outputs * p->model.n_inputs;
    struct grid_work w = {.grid = grid, .m = p->grids[grid].m};
    w.pairs = bf_alloc(n_pairs, sizeof *w.pairs);
    w.F = bf_alloc(4 * w.m, sizeof *w.F);
    w.Y = w.F + w.m, w.Z = w.Y + w.m, w.sum = w.Z + w.m;
    for (size_t o = 0; o < p->model.n_outputs; o++)
        for (size_t i = 0; i < p->model.n_inputs; i++)
            if (pair_needed(p, grid, o, i))
                fill_pair(run, grid, o, i, &w.pairs[o * p->model.n_inputs + i]);
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < p->n_channels; c++) {
        const struct record_plan *plan = &p->plans[p->channels[c].record];
        if (plan->grid == grid && !plan->free_decay)
            status = channel_response(run, &w, &p->channels[c], err);
    }
    for (size_t i = 0; i < n_pairs; i++) {
        free(w.pairs[i].H);
        free(w.pairs[i].dH);
    }
    free(w.pairs);
    free(w.F);
    return status;
}

enum bf_status predict_linear(const struct run *run, struct bf_error *err)
{
    const struct predictor *p = run->p;
    for (size_t c = 0; c < p->n_channels; c++) /* free decays have no forced part */
        memset(p->y + p->channels[c].row, 0, p->channels[c].n * sizeof *p->y);
    enum bf_status status = BF_OK;
    for (size_t g = 0; status == BF_OK && g < p->n_grids; g++)
        status = grid_response(run, g, err);
    return status;
}
