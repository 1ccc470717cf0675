/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The response of the linear model to the recorded inputs: Y_o(s) = F_o Ks s^ν Σ_i H_oi KB U_i, and its derivatives. */
#include "predictor.h"

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
    struct pair *pairs;                  /* [n_outputs][n_sources] */
    double complex *F, *Y, *D, *Z, *sum; /* [m] filters, response, with gain and residuals, scratch */
};

static bool record_uses(const struct record_plan *plan, const struct predictor *p, size_t output, size_t source)
{
    size_t input = p->sources[source].input;
    if (plan->input[input] == NULL || plan->source[input] != source)
        return false;
    for (size_t c = 0; c < plan->n_channels; c++)
        if (p->channels[plan->first_channel + c].output == output)
            return true;
    return false;
}

static bool pair_needed(const struct predictor *p, size_t grid, size_t output, size_t source)
{
    for (size_t r = 0; r < p->n_records; r++)
        if (p->plans[r].grid == grid && record_uses(&p->plans[r], p, output, source))
            return true;
    return false;
}

/* f, or the system it is taken of, depends on this parameter, and the run wants that derivative. */
static bool functional_depends(const struct run *run, const struct functional *f, size_t parameter)
{
    return run_wants(run, parameter) &&
           (run->p->system->derivative[parameter].Z != NULL || functional_changes(f, parameter));
}

static bool pair_depends(const struct run *run, size_t output, size_t source, size_t parameter)
{
    return functional_depends(run, &run->p->outputs[output], parameter) ||
           functional_depends(run, &run->p->inputs[source], parameter);
}

static void fill_pair(const struct run *run, size_t grid, size_t output, size_t source, struct pair *pair)
{
    const struct predictor *p = run->p;
    size_t m = p->grids[grid].m, n_poles = p->system->n_poles;
    const struct functional *c = &p->outputs[output], *b = &p->inputs[source];
    int order = output_order(p->model.outputs[output].kind);
    pair->H = bf_grow(NULL, m, sizeof *pair->H); /* not zeroed: what is used is filled here */
    response_value(p->kernels[grid], order, c->alpha, b->alpha, pair->H);
    if (run->want == NULL)
        return;
    pair->dH = bf_grow(NULL, m * p->map.n, sizeof *pair->dH);
    struct response_change *changes = bf_alloc(p->map.n + 1, sizeof *changes);
    size_t n = 0;
    for (size_t j = 0; j < p->map.n; j++)
        if (pair_depends(run, output, source, j))
            changes[n++] = (struct response_change){.d_alpha = c->d_alpha + j * n_poles,
                                                    .d_beta = b->d_alpha + j * n_poles,
                                                    .d_p = p->system->derivative[j].p,
                                                    .H = pair->dH + j * m};
    response_derivatives(p->kernels[grid], order, c->alpha, b->alpha, changes, n);
    free(changes);
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
        const struct pair *pair = &w->pairs[output * p->n_sources + plan->source[i]];
        const double complex *H = pair->H;
        if (derivative != SIZE_MAX && derivative == parameter)
            gain = 1.0; /* d/dKB */
        else if (derivative != SIZE_MAX && !pair_depends(run, output, plan->source[i], derivative))
            continue;
        else if (derivative != SIZE_MAX)
            H = pair->dH + derivative * w->m;
        for (size_t k = 0; k < w->m; k++)
            /* every pair is filled: NOLINTNEXTLINE(clang-analyzer-core.NullDereference) */
            sum[k] += gain * (H[k] * plan->U[i][k]);
    }
}

static enum bf_status put(const struct run *run, const struct grid_work *w, double scale, const double complex F[],
                          const double complex Y[], double out[], struct bf_error *err)
{
    for (size_t k = 0; k < w->m; k++)
        w->Z[k] = scale * (F[k] * Y[k]);
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
            status = put(run, w, 1.0, w->F, w->Y, column, err);
        } else if (run_structural(run, j) || is_input_gain(p, j)) {
            sum_inputs(run, w, plan, channel->output, j, w->sum);
            status = put(run, w, gain, w->F, w->sum, column, err);
        } else if (channel_filter_derivative(run, channel->record, channel->output, j, p->grids[w->grid].s, w->m, dF)) {
            status = put(run, w, 1.0, dF, w->D, column, err);
        }
    }
    free(dF);
    return status;
}

/* Y += scale · s^ν U: the direct path of a residual; Ks and KB do not act on it. */
static void residual_path(const struct run *run, const struct grid_work *w, const double complex U[],
                          const struct model_residual *residual, double scale, double complex Y[])
{
    int order = output_order(run->p->model.outputs[residual->output].kind);
    const double complex *s = run->p->grids[w->grid].s;
    for (size_t k = 0; k < w->m; k++) {
        double complex power = scale;
        for (int i = 0; i < order; i++)
            power *= s[k];
        Y[k] += power * U[k];
    }
}

static bool residual_acts(const struct run *run, const struct predict_channel *channel, size_t i)
{
    const struct model_residual *residual = &run->p->model.residuals[i];
    return residual->output == channel->output && run->p->plans[channel->record].input[residual->input] != NULL;
}

static enum bf_status residual_derivatives(const struct run *run, const struct grid_work *w,
                                           const struct predict_channel *channel, struct bf_error *err)
{
    const struct predictor *p = run->p;
    enum bf_status status = BF_OK;
    for (size_t i = 0; status == BF_OK && i < p->model.n_residuals; i++) {
        size_t parameter = p->map.residual[i];
        if (!run_wants(run, parameter) || !residual_acts(run, channel, i))
            continue;
        memset(w->sum, 0, w->m * sizeof *w->sum);
        residual_path(run, w, p->plans[channel->record].U[p->model.residuals[i].input], &p->model.residuals[i], 1.0,
                      w->sum);
        status = put(run, w, 1.0, w->F, w->sum, run_column(run, parameter, channel), err);
    }
    return status;
}

/* Before the filters: D = Ks Y + Σ c s^ν U. */
static void unfiltered(const struct run *run, const struct grid_work *w, const struct predict_channel *channel,
                       double gain)
{
    for (size_t k = 0; k < w->m; k++)
        w->D[k] = gain * w->Y[k];
    for (size_t i = 0; i < run->p->model.n_residuals; i++)
        if (residual_acts(run, channel, i))
            residual_path(run, w, run->p->plans[channel->record].U[run->p->model.residuals[i].input],
                          &run->p->model.residuals[i], run->theta[run->p->map.residual[i]], w->D);
}

/* out += F⁻¹[scale F Y]. */
static enum bf_status add(const struct run *run, const struct grid_work *w, double scale, const double complex F[],
                          const double complex Y[], double out[], struct bf_error *err)
{
    size_t n = run->p->grids[w->grid].n;
    double *y = bf_grow(NULL, n, sizeof *y);
    enum bf_status status = put(run, w, scale, F, Y, y, err);
    for (size_t k = 0; status == BF_OK && k < n; k++)
        out[k] += y[k];
    free(y);
    return status;
}

/* By a drive's parameter: the same paths, under the change of the input. */
static enum bf_status drive_derivatives(const struct run *run, const struct grid_work *w,
                                        const struct predict_channel *channel, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[channel->record];
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < plan->n_changes; c++) {
        const struct drive_change *change = &plan->changes[c];
        size_t parameter;
        double gain = output_gain(run, channel->output, &parameter) * input_gain(run, change->input, &parameter);
        const double complex *H = w->pairs[channel->output * p->n_sources + plan->source[change->input]].H;
        for (size_t k = 0; k < w->m; k++)
            w->sum[k] = gain * (H[k] * change->U[k]);
        for (size_t i = 0; i < p->model.n_residuals; i++)
            if (residual_acts(run, channel, i) && p->model.residuals[i].input == change->input)
                residual_path(run, w, change->U, &p->model.residuals[i], run->theta[p->map.residual[i]], w->sum);
        status = add(run, w, 1.0, w->F, w->sum, run_column(run, change->parameter, channel), err);
    }
    return status;
}

/*
 * By the clock c, s = s₀/c: s^ν Σ αβ/(s − p) changes by (1/c)[(1 − ν) H + s^ν Σ αβ p/(s − p)²], which is what a change
 * δα = (1 − ν)α/c, δp = p/c does; filters by −(s/c) dF/ds, a residual path by −ν/c.
 */
static enum bf_status clock_change(const struct run *run, const struct grid_work *w,
                                   const struct predict_channel *channel, double complex sum[], struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[channel->record];
    int order = output_order(p->model.outputs[channel->output].kind);
    size_t n_poles = p->system->n_poles, parameter;
    double clock = p->geometry.clock, Ks = output_gain(run, channel->output, &parameter);
    const struct functional *c = &p->outputs[channel->output];
    double complex *H = bf_alloc(w->m + 3 * n_poles, sizeof *H), *da = H + w->m, *zero = da + n_poles;
    double complex *dp = zero + n_poles;
    for (size_t k = 0; k < n_poles; k++) {
        da[k] = (1.0 - order) / clock * c->alpha[k];
        dp[k] = p->system->p[k] / clock;
    }
    memset(sum, 0, w->m * sizeof *sum);
    for (size_t i = 0; i < p->model.n_inputs; i++) {
        if (plan->input[i] == NULL)
            continue;
        double gain = Ks * input_gain(run, i, &parameter);
        const struct response_change clock_runs = {.d_alpha = da, .d_beta = zero, .d_p = dp, .H = H};
        response_derivatives(p->kernels[w->grid], order, c->alpha, p->inputs[plan->source[i]].alpha, &clock_runs, 1);
        for (size_t k = 0; k < w->m; k++)
            sum[k] += gain * (H[k] * plan->U[i][k]);
    }
    for (size_t i = 0; i < p->model.n_residuals; i++)
        if (residual_acts(run, channel, i))
            residual_path(run, w, plan->U[p->model.residuals[i].input], &p->model.residuals[i],
                          -order / clock * run->theta[p->map.residual[i]], sum);
    for (size_t k = 0; k < w->m; k++)
        sum[k] *= w->F[k];
    enum bf_status status =
        channel_filter_slope(run, channel->record, channel->output, p->grids[w->grid].s, w->m, H, err);
    for (size_t k = 0; k < w->m; k++)
        sum[k] -= p->grids[w->grid].s[k] / clock * H[k] * w->D[k];
    free(H);
    return status;
}

static enum bf_status clock_derivatives(const struct run *run, const struct grid_work *w,
                                        const struct predict_channel *channel, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t j = 0; status == BF_OK && j < run->p->map.n; j++) {
        double by = run->p->geometry.clock_by[j];
        if (!run_wants(run, j) || !(by < 0.0 || by > 0.0))
            continue;
        double complex *change = bf_grow(NULL, 2 * w->m, sizeof *change), *one = change + w->m;
        for (size_t k = 0; k < w->m; k++)
            one[k] = 1.0;
        status = clock_change(run, w, channel, change, err);
        if (status == BF_OK)
            status = add(run, w, by, one, change, run_column(run, j, channel), err);
        free(change);
    }
    return status;
}

static enum bf_status channel_response(const struct run *run, const struct grid_work *w,
                                       const struct predict_channel *channel, struct bf_error *err)
{
    const struct predictor *p = run->p;
    size_t gain_parameter;
    double gain = output_gain(run, channel->output, &gain_parameter);
    bool filtered;
    enum bf_status status =
        channel_filter(run, channel->record, channel->output, p->grids[w->grid].s, w->m, w->F, &filtered, err);
    if (status != BF_OK)
        return status;
    sum_inputs(run, w, &p->plans[channel->record], channel->output, SIZE_MAX, w->Y);
    unfiltered(run, w, channel, gain);
    status = put(run, w, 1.0, w->F, w->D, run->out->y + channel->row, err);
    if (status == BF_OK && run->want != NULL)
        status = put_derivatives(run, w, channel, err);
    if (status == BF_OK && run->want != NULL)
        status = residual_derivatives(run, w, channel, err);
    if (status == BF_OK && run->want != NULL)
        status = drive_derivatives(run, w, channel, err);
    if (status == BF_OK && run->want != NULL)
        status = clock_derivatives(run, w, channel, err);
    return status;
}

static enum bf_status grid_response(const struct run *run, size_t grid, struct bf_error *err)
{
    const struct predictor *p = run->p;
    size_t n_pairs = p->model.n_outputs * p->n_sources;
    struct grid_work w = {.grid = grid, .m = p->grids[grid].m};
    w.pairs = bf_alloc(n_pairs, sizeof *w.pairs);
    w.F = bf_alloc(5 * w.m, sizeof *w.F);
    w.Y = w.F + w.m, w.D = w.Y + w.m, w.Z = w.D + w.m, w.sum = w.Z + w.m;
    for (size_t o = 0; o < p->model.n_outputs; o++)
        for (size_t i = 0; i < p->n_sources; i++)
            if (pair_needed(p, grid, o, i))
                fill_pair(run, grid, o, i, &w.pairs[o * p->n_sources + i]);
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
