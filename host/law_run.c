/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_run.h"

#include <math.h>
#include <stdlib.h>

#include "spectrum.h"

/* A pole with |p| h above this follows the force without dynamics of its own. */
static const double far_step = 1.5;
enum { OVERSAMPLE_POINT = 8, OVERSAMPLE_SPAN = 4 };

static int oversampling(const struct predictor *p)
{
    int factor = p->options.oversample;
    for (size_t e = 0; factor == 0 && e < p->model.n_effects; e++)
        if (p->laws[e].g_at != NULL)
            factor = OVERSAMPLE_POINT;
    return factor > 0 ? factor : OVERSAMPLE_SPAN;
}

/* Poles that move on the grid are stepped; the others add Re(αα'/p) to the compliance (their static response). */
static void split_poles(struct law_run *l)
{
    const struct system *s = l->run->p->system;
    l->pole = bf_alloc(s->n_poles, sizeof *l->pole);
    l->multiplicity = bf_alloc(s->n_poles, sizeof *l->multiplicity);
    l->step = bf_alloc(s->n_poles, sizeof *l->step);
    for (size_t k = 0; k < s->n_poles; k++) {
        double multiplicity = k < s->n_pairs ? 2.0 : 1.0;
        if (cabs(s->p[k]) * l->h_s <= far_step) {
            l->pole[l->n_dynamic] = k;
            l->multiplicity[l->n_dynamic] = multiplicity;
            l->step[l->n_dynamic++] = pole_step(s->p[k], l->h_s);
            continue;
        }
        for (size_t a = 0; a < l->D; a++)
            for (size_t b = 0; b < l->D; b++)
                l->far[a * l->D + b] += multiplicity * creal(l->run->p->coordinates[a].alpha[k] *
                                                             l->run->p->coordinates[b].alpha[k] / s->p[k]);
    }
}

static void fill_compliance(struct law_run *l)
{
    size_t D = l->D, P = l->n_dynamic;
    l->alpha = bf_alloc(D * P, sizeof *l->alpha);
    for (size_t c = 0; c < D; c++)
        for (size_t k = 0; k < P; k++)
            l->alpha[c * P + k] = l->run->p->coordinates[c].alpha[l->pole[k]];
    for (size_t a = 0; a < D; a++) {
        for (size_t b = 0; b < D; b++) {
            double w = l->far[a * D + b], v = 0.0;
            for (size_t k = 0; k < P; k++) {
                double complex r = l->alpha[a * P + k] * l->step[k].g1 * l->alpha[b * P + k];
                w -= l->multiplicity[k] * creal(r);
                v -= l->multiplicity[k] * creal(r * l->run->p->system->p[l->pole[k]]);
            }
            l->S_w[a * D + b] = w;
            l->S_v[a * D + b] = v;
        }
    }
}

enum bf_status law_upsample(const struct law_run *l, const double complex W[], double out[], struct bf_error *err)
{
    size_t m = l->grid->m, factor = (size_t)l->oversample, n_fine = l->grid->n_fft * factor;
    const struct fft *plan;
    enum bf_status status = fft_get(n_fine, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *wide = bf_alloc(n_fine / 2 + 1, sizeof *wide);
    double *x = bf_alloc(n_fine, sizeof *x);
    for (size_t k = 0; k < m; k++)
        wide[k] = (double)factor * W[k];
    if (factor > 1)
        wide[m - 1] *= 0.5; /* one line at the old Nyquist frequency becomes a pair */
    fft_inverse(plan, wide, x);
    for (size_t k = 0; k < l->N; k++)
        out[k] = x[k] * exp(l->grid->sigma * l->h_s * (double)k);
    free(wide);
    free(x);
    return BF_OK;
}

enum bf_status law_transform(const struct law_run *l, const double f[], size_t stride, double complex F[],
                             struct bf_error *err)
{
    size_t factor = (size_t)l->oversample, n_fine = l->grid->n_fft * factor;
    const struct fft *plan;
    enum bf_status status = fft_get(n_fine, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *wide = bf_alloc(n_fine / 2 + 1, sizeof *wide);
    double *x = bf_alloc(n_fine, sizeof *x);
    for (size_t k = 0; k < l->N; k++)
        x[k] = f[k * stride] * exp(-l->grid->sigma * l->h_s * (double)k);
    fft_forward(plan, x, wide);
    for (size_t k = 0; k < l->grid->m; k++)
        F[k] = wide[k] / (double)factor;
    free(wide);
    free(x);
    return BF_OK;
}

/* w_lin and v_lin of coordinate c on the fine grid. */
static enum bf_status linear_motion(struct law_run *l, size_t c, struct bf_error *err)
{
    const struct predictor *p = l->run->p;
    size_t m = l->grid->m;
    double complex *H = bf_alloc(2 * m, sizeof *H), *W = H + m;
    for (size_t i = 0; i < p->model.n_inputs; i++) {
        size_t parameter;
        if (l->plan->input[i] == NULL)
            continue;
        double gain = input_gain(l->run, i, &parameter);
        response_value(p->kernels[l->plan->grid], 0, p->coordinates[c].alpha, p->inputs[i].alpha, H);
        for (size_t k = 0; k < m; k++)
            W[k] += gain * (H[k] * l->plan->U[i][k]);
    }
    enum bf_status status = l->uses_w ? law_upsample(l, W, l->w_lin + c * l->N, err) : BF_OK;
    for (size_t k = 0; k < m; k++)
        W[k] *= l->grid->s[k];
    if (status == BF_OK)
        status = law_upsample(l, W, l->v_lin + c * l->N, err);
    free(H);
    return status;
}

static bool uses_w(const struct predictor *p)
{
    for (size_t e = 0; e < p->model.n_effects; e++)
        if (p->laws[e].d > 0 && (p->laws[e].uses_w || p->laws[e].uses_w_old))
            return true;
    return false;
}

static bool has_states(const struct predictor *p)
{
    for (size_t e = 0; e < p->model.n_effects; e++)
        if (p->laws[e].d > 0 && p->laws[e].effect->n_law_states > 0)
            return true;
    return false;
}

enum bf_status law_run_new(struct law_run *l, struct bf_error *err)
{
    struct predictor *p = l->run->p;
    l->uses_w = uses_w(p);
    l->D = p->n_coordinates;
    l->oversample = oversampling(p);
    l->N = l->plan->n * (size_t)l->oversample;
    l->h_s = l->grid->dt_s / (double)l->oversample;
    split_poles(l);
    fill_compliance(l);
    l->w_lin = bf_alloc(2 * l->D * l->N, sizeof(double));
    l->v_lin = l->w_lin + l->D * l->N;
    l->f = bf_alloc(l->N * l->D, sizeof(double));
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < l->D; c++)
        status = linear_motion(l, c, err);
    if (status != BF_OK || l->run->want == NULL)
        return status;
    l->n_dependencies = law_first_dependency(p, p->model.n_effects);
    l->q = bf_alloc(l->N * l->n_dynamic, sizeof *l->q);
    l->T_w = bf_alloc(4 * l->N * l->D * l->D, sizeof(double));
    l->T_v = l->T_w + l->N * l->D * l->D;
    l->T_old = l->T_v + l->N * l->D * l->D;
    l->inverse = l->T_old + l->N * l->D * l->D;
    l->f_p = bf_alloc(l->N * l->n_dependencies * LAW_COORDINATES, sizeof(double));
    l->state = has_states(p) ? bf_alloc(l->N * p->model.n_effects, sizeof *l->state) : NULL;
    return BF_OK;
}

void law_run_free(struct law_run *l)
{
    free(l->pole);
    free(l->multiplicity);
    free(l->step);
    free(l->alpha);
    free(l->w_lin);
    free(l->f);
    free(l->q);
    free(l->T_w);
    free(l->f_p);
    free(l->state);
}
