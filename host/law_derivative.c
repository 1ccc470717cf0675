/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Derivatives of a nonlinear record by every parameter: the stepped equations, linearised along the stored motion. */
#include "law_lanes.h"

#include <stdint.h>
#include <stdlib.h>

static double (*take(double **next, size_t rows))[LANES]
{
    double(*block)[LANES] = (double(*)[LANES]) * next;
    *next += rows * LANES;
    return block;
}

static void lanes_new(struct lanes *a, const struct law_run *l)
{
    size_t P = l->n_dynamic, D = l->D, effects = l->run->p->model.n_effects;
    *a = (struct lanes){.l = l};
    size_t rows = 10 * P + 2 * D * P + D * D + effects * BEAM_LAW_STATES;
    a->storage = bf_alloc(LANES * rows + 3 * LANES * D * l->N, sizeof(double));
    double *next = a->storage;
    a->q_re = take(&next, P), a->q_im = take(&next, P);
    a->e_re = take(&next, P), a->e_im = take(&next, P);
    a->g0_re = take(&next, P), a->g0_im = take(&next, P);
    a->g1_re = take(&next, P), a->g1_im = take(&next, P);
    a->p_re = take(&next, P), a->p_im = take(&next, P);
    a->a_re = take(&next, D * P), a->a_im = take(&next, D * P);
    a->far = next;
    next += D * D * LANES;
    a->z = (double(*)[BEAM_LAW_STATES][LANES])next;
    next += effects * BEAM_LAW_STATES * LANES;
    a->w_lin = next;
    a->v_lin = a->w_lin + LANES * D * l->N;
    a->f = a->v_lin + LANES * D * l->N;
}

/* ---- What the parameters change ---- */

static void set_complex(double (*re)[LANES], double (*im)[LANES], size_t row, size_t lane, double complex x)
{
    re[row][lane] = creal(x);
    im[row][lane] = cimag(x);
}

static void fill_structure(struct lanes *a, size_t lane)
{
    const struct law_run *l = a->l;
    const struct predictor *p = l->run->p;
    const struct system *s = p->system;
    size_t j = a->parameter[lane], n_poles = s->n_poles, next = 0;
    if (!run_structural(l->run, j))
        return;
    for (size_t k = 0; k < n_poles; k++) {
        double complex dp = s->derivative[j].p != NULL ? s->derivative[j].p[k] : 0.0;
        if (next < l->n_dynamic && l->pole[next] == k) {
            const struct pole_step *step = &l->step[next];
            set_complex(a->p_re, a->p_im, next, lane, dp);
            set_complex(a->e_re, a->e_im, next, lane, step->d_e * dp);
            set_complex(a->g0_re, a->g0_im, next, lane, step->d_g0 * dp);
            set_complex(a->g1_re, a->g1_im, next, lane, step->d_g1 * dp);
            for (size_t c = 0; c < l->D; c++)
                set_complex(a->a_re, a->a_im, c * l->n_dynamic + next, lane,
                            p->coordinates[c].d_alpha[j * n_poles + k]);
            next++;
            continue;
        }
        double multiplicity = k < s->n_pairs ? 2.0 : 1.0;
        for (size_t x = 0; x < l->D; x++) {
            for (size_t y = 0; y < l->D; y++) {
                const struct functional *f = &p->coordinates[x], *g = &p->coordinates[y];
                double complex change = f->d_alpha[j * n_poles + k] * g->alpha[k] +
                                        f->alpha[k] * g->d_alpha[j * n_poles + k] -
                                        f->alpha[k] * g->alpha[k] * dp / s->p[k];
                a->far[(x * l->D + y) * LANES + lane] += multiplicity * creal(change / s->p[k]);
            }
        }
    }
}

/* δw_lin: the linear response of coordinate c to the inputs, differentiated. */
static enum bf_status fill_linear(struct lanes *a, size_t lane, size_t c, struct bf_error *err)
{
    const struct law_run *l = a->l;
    const struct predictor *p = l->run->p;
    size_t j = a->parameter[lane], n_poles = p->system->n_poles, m = l->grid->m;
    bool structural = run_structural(l->run, j);
    if (!structural && j != p->map.KB)
        return BF_OK;
    const struct functional *f = &p->coordinates[c];
    double complex *H = bf_alloc(2 * m, sizeof *H), *W = H + m;
    for (size_t i = 0; i < p->model.n_inputs; i++) {
        size_t gain_parameter;
        double gain = input_gain(l->run, i, &gain_parameter);
        if (l->plan->input[i] == NULL || (!structural && gain_parameter != j))
            continue;
        const struct functional *b = &p->inputs[i];
        if (structural) {
            response_derivative(p->kernels[l->plan->grid], 0, f->alpha, b->alpha, f->d_alpha + j * n_poles,
                                b->d_alpha + j * n_poles, p->system->derivative[j].p, H);
        } else {
            response_value(p->kernels[l->plan->grid], 0, f->alpha, b->alpha, H);
            gain = 1.0;
        }
        for (size_t k = 0; k < m; k++)
            W[k] += gain * (H[k] * l->plan->U[i][k]);
    }
    enum bf_status status = l->uses_w ? law_upsample(l, W, a->w_lin + (lane * l->D + c) * l->N, err) : BF_OK;
    for (size_t k = 0; k < m; k++)
        W[k] *= l->grid->s[k];
    if (status == BF_OK)
        status = law_upsample(l, W, a->v_lin + (lane * l->D + c) * l->N, err);
    free(H);
    return status;
}

/* ---- Outputs ---- */

static enum bf_status add_channel(const struct lanes *a, size_t lane, const struct predict_channel *channel,
                                  const double complex F[], const double complex dF[], struct bf_error *err)
{
    const struct law_run *l = a->l;
    const struct predictor *p = l->run->p;
    size_t m = l->grid->m, n_poles = p->system->n_poles, j = a->parameter[lane], gain_parameter;
    int order = output_order(p->model.outputs[channel->output].kind);
    const struct functional *o = &p->outputs[channel->output];
    const struct response_kernel *kernel = p->kernels[l->plan->grid];
    double gain = output_gain(l->run, channel->output, &gain_parameter);
    double complex *H = bf_alloc(3 * m, sizeof *H), *Y = H + m, *filter = Y + m;
    bool filtered;
    for (size_t c = 0; c < l->D; c++) {
        const struct functional *f = &p->coordinates[c];
        response_value(kernel, order, o->alpha, f->alpha, H);
        for (size_t k = 0; k < m; k++)
            Y[k] -= H[k] * dF[c * m + k];
        if (!run_structural(l->run, j))
            continue;
        response_derivative(kernel, order, o->alpha, f->alpha, o->d_alpha + j * n_poles, f->d_alpha + j * n_poles,
                            p->system->derivative[j].p, H);
        for (size_t k = 0; k < m; k++)
            Y[k] -= H[k] * F[c * m + k];
    }
    enum bf_status status = channel_filter(l->run, l->record, channel->output, l->grid->s, m, filter, &filtered, err);
    if (status == BF_OK)
        status = law_add_output(l, channel, gain, filter, Y, run_column(l->run, j, channel), err);
    free(H);
    return status;
}

static enum bf_status run_block(struct lanes *a, const double complex F[], struct bf_error *err)
{
    const struct law_run *l = a->l;
    size_t m = l->grid->m;
    enum bf_status status = BF_OK;
    for (size_t lane = 0; lane < a->count; lane++) {
        fill_structure(a, lane);
        for (size_t c = 0; status == BF_OK && c < l->D; c++)
            status = fill_linear(a, lane, c, err);
    }
    if (status == BF_OK)
        law_lanes_march(a);
    double complex *dF = bf_alloc(l->D * m, sizeof *dF);
    for (size_t lane = 0; status == BF_OK && lane < a->count; lane++) {
        for (size_t c = 0; status == BF_OK && c < l->D; c++)
            status = law_transform(l, a->f + (lane * l->D + c) * l->N, 1, dF + c * m, err);
        for (size_t i = 0; status == BF_OK && i < l->plan->n_channels; i++)
            status = add_channel(a, lane, &l->run->p->channels[l->plan->first_channel + i], F, dF, err);
    }
    free(dF);
    return status;
}

/* The nonlinear motion depends on this parameter. */
static bool matters(const struct law_run *l, size_t j)
{
    const struct predictor *p = l->run->p;
    if (!run_wants(l->run, j))
        return false;
    bool yes = run_structural(l->run, j) || j == p->map.KB;
    for (size_t e = 0; e < p->model.n_effects; e++)
        for (size_t d = 0; d < p->laws[e].n_dependencies; d++)
            yes = yes || p->laws[e].dependency[d] == j;
    return yes;
}

enum bf_status law_derivatives(const struct law_run *l, const double complex F[], struct bf_error *err)
{
    size_t n = l->run->p->map.n, j = 0;
    enum bf_status status = BF_OK;
    while (status == BF_OK && j < n) {
        struct lanes a;
        lanes_new(&a, l);
        for (; j < n && a.count < LANES; j++)
            if (matters(l, j))
                a.parameter[a.count++] = j;
        for (size_t i = a.count; i < LANES; i++)
            a.parameter[i] = SIZE_MAX;
        if (a.count > 0)
            status = run_block(&a, F, err);
        free(a.storage);
    }
    return status;
}
