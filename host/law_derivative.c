/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Derivatives of a nonlinear record by every parameter: the stepped equations, linearised along the stored motion.
 * Parameters go through the record four at a time, so that the inner loops have a constant length.
 */
#include "law_run.h"
#include "vector.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 4 };

/* Linearised state of four parameters. Complex numbers are split; the last index is the lane. */
struct lanes {
    const struct law_run *l;
    size_t count, parameter[LANES];
    double (*q_re)[LANES], (*q_im)[LANES];             /* [n_dynamic] δq */
    double (*a_re)[LANES], (*a_im)[LANES];             /* [D · n_dynamic] δα */
    double (*e_re)[LANES], (*e_im)[LANES];             /* [n_dynamic] δe, and so on */
    double (*g0_re)[LANES], (*g0_im)[LANES], (*g1_re)[LANES], (*g1_im)[LANES], (*p_re)[LANES], (*p_im)[LANES];
    double *far;                                       /* [D × D][LANES] */
    double *w_lin, *v_lin;                             /* [LANES][D][N] */
    double *f;                                         /* [LANES][D][N] δf, the result */
    double w[MOST_COORDINATES][LANES], v[MOST_COORDINATES][LANES];
    double w_old[MOST_COORDINATES][LANES], df[MOST_COORDINATES][LANES];
    double (*z)[BEAM_LAW_STATES][LANES];               /* [n_effects] δz */
    double *storage;
};

static double (*take(double **next, size_t rows))[LANES]
{
    double(*block)[LANES] = (double(*)[LANES])*next;
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
                set_complex(a->a_re, a->a_im, c * l->n_dynamic + next, lane, p->coordinates[c].d_alpha[j * n_poles + k]);
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
    enum bf_status status = law_upsample(l, W, a->w_lin + (lane * l->D + c) * l->N, err);
    for (size_t k = 0; k < m; k++)
        W[k] *= l->grid->s[k];
    if (status == BF_OK)
        status = law_upsample(l, W, a->v_lin + (lane * l->D + c) * l->N, err);
    free(H);
    return status;
}

/* ---- One linearised step ---- */

/* Force on pole k, Σ_c α f_c, at an instant. */
VECTOR_INLINE double complex pole_force(const struct law_run *l, size_t k, const double f[])
{
    double complex sum = 0.0;
    for (size_t c = 0; c < l->D; c++)
        sum += l->alpha[c * l->n_dynamic + k] * f[c];
    return sum;
}

struct split {
    double re[LANES], im[LANES];
};

/* out += x · y for a scalar x and four y. */
VECTOR_INLINE void add_scalar_times(struct split *out, double complex x, const double re[LANES], const double im[LANES])
{
    double xr = creal(x), xi = cimag(x);
    for (int i = 0; i < LANES; i++) {
        out->re[i] += xr * re[i] - xi * im[i];
        out->im[i] += xr * im[i] + xi * re[i];
    }
}

/* δ(free q): everything of δq⁺ but −g1 Σ α δf⁺. f0, f1: forces at the beginning and end of the step. */
VECTOR_INLINE void free_state(struct lanes *a, size_t k, double complex q_old, const double f0[], const double f1[])
{
    const struct law_run *l = a->l;
    struct split next = {{0}, {0}}, force0 = {{0}, {0}}, force1 = {{0}, {0}};
    for (size_t c = 0; c < l->D; c++) {
        size_t row = c * l->n_dynamic + k;
        double x = f0[c], y = f1[c], ar = creal(l->alpha[row]), ai = cimag(l->alpha[row]);
        const double *re = a->a_re[row], *im = a->a_im[row], *df = a->df[c];
        for (int i = 0; i < LANES; i++) {
            force0.re[i] += x * re[i] + ar * df[i];
            force0.im[i] += x * im[i] + ai * df[i];
            force1.re[i] += y * re[i];
            force1.im[i] += y * im[i];
        }
    }
    add_scalar_times(&next, l->step[k].e, a->q_re[k], a->q_im[k]);
    add_scalar_times(&next, q_old, a->e_re[k], a->e_im[k]);
    add_scalar_times(&next, -pole_force(l, k, f0), a->g0_re[k], a->g0_im[k]);
    add_scalar_times(&next, -pole_force(l, k, f1), a->g1_re[k], a->g1_im[k]);
    add_scalar_times(&next, -l->step[k].g0, force0.re, force0.im);
    add_scalar_times(&next, -l->step[k].g1, force1.re, force1.im);
    memcpy(a->q_re[k], next.re, sizeof next.re);
    memcpy(a->q_im[k], next.im, sizeof next.im);
}

/* δw = Re(q δα + α δq) and δv = Re(pq δα + pα δq + αq δp) of pole k, without what depends on δf⁺. */
VECTOR_INLINE void add_free_motion(struct lanes *a, size_t k, double complex q)
{
    const struct law_run *l = a->l;
    double m = l->multiplicity[k];
    double complex p = l->run->p->system->p[l->pole[k]];
    const double *dq_re = a->q_re[k], *dq_im = a->q_im[k], *dp_re = a->p_re[k], *dp_im = a->p_im[k];
    for (size_t c = 0; c < l->D; c++) {
        size_t row = c * l->n_dynamic + k;
        const double *da_re = a->a_re[row], *da_im = a->a_im[row];
        double complex alpha = m * l->alpha[row], mq = m * q, pa = p * alpha, pq = p * mq, aq = alpha * q;
        double a_re = creal(alpha), a_im = cimag(alpha), q_re = creal(mq), q_im = cimag(mq);
        double pa_re = creal(pa), pa_im = cimag(pa), pq_re = creal(pq), pq_im = cimag(pq);
        double aq_re = creal(aq), aq_im = cimag(aq);
        for (int i = 0; i < LANES; i++) {
            a->w[c][i] += q_re * da_re[i] - q_im * da_im[i] + a_re * dq_re[i] - a_im * dq_im[i];
            a->v[c][i] += pq_re * da_re[i] - pq_im * da_im[i] + pa_re * dq_re[i] - pa_im * dq_im[i] +
                          aq_re * dp_re[i] - aq_im * dp_im[i];
        }
    }
}

VECTOR_INLINE void start_motion(struct lanes *a, size_t step, const double f1[])
{
    const struct law_run *l = a->l;
    for (size_t c = 0; c < l->D; c++) {
        for (size_t i = 0; i < LANES; i++) {
            a->w[c][i] = a->w_lin[(i * l->D + c) * l->N + step];
            a->v[c][i] = a->v_lin[(i * l->D + c) * l->N + step];
            for (size_t b = 0; b < l->D; b++)
                a->w[c][i] += a->far[(c * l->D + b) * LANES + i] * f1[b];
        }
    }
}

/* Right side of A δf⁺ = T_w δw_free + T_v δv_free + T_old δw_old + f_z δz + f_p. */
VECTOR_INLINE void right_side(const struct lanes *a, size_t step, double b[MOST_COORDINATES][LANES])
{
    const struct law_run *l = a->l;
    const struct predictor *p = l->run->p;
    size_t D = l->D;
    const double *T_w = l->T_w + step * D * D, *T_v = l->T_v + step * D * D, *T_old = l->T_old + step * D * D;
    for (size_t r = 0; r < D; r++) {
        for (int i = 0; i < LANES; i++) {
            double sum = 0.0;
            for (size_t c = 0; c < D; c++)
                sum += T_w[r * D + c] * a->w[c][i] + T_v[r * D + c] * a->v[c][i] + T_old[r * D + c] * a->w_old[c][i];
            b[r][i] = sum;
        }
    }
    for (size_t e = 0; e < p->model.n_effects; e++) {
        const struct law *law = &p->laws[e];
        size_t first = law_first_coordinate(p, e), dependency = law_first_dependency(p, e);
        for (size_t d = 0; law->d > 0 && d < law->n_dependencies; d++)
            for (size_t i = 0; i < a->count; i++)
                for (size_t r = 0; law->dependency[d] == a->parameter[i] && r < law->d; r++)
                    b[first + r][i] += l->f_p[(step * l->n_dependencies + dependency + d) * LAW_COORDINATES + r];
        for (int k = 0; l->state != NULL && law->d > 0 && k < law->effect->n_law_states; k++)
            for (int i = 0; i < LANES; i++)
                b[first][i] += l->state[step * p->model.n_effects + e].by_z[k] * a->z[e][k][i];
    }
}

/* δf⁺, and with it δq⁺, δw⁺, δv⁺. */
VECTOR_INLINE void finish_step(struct lanes *a, size_t step, double b[MOST_COORDINATES][LANES])
{
    const struct law_run *l = a->l;
    size_t D = l->D;
    const double *inverse = l->inverse + step * D * D;
    for (size_t r = 0; r < D; r++) {
        for (int i = 0; i < LANES; i++) {
            double sum = 0.0;
            for (size_t c = 0; c < D; c++)
                sum += inverse[r + c * D] * b[c][i];
            a->df[r][i] = sum;
        }
        for (size_t i = 0; i < LANES; i++)
            a->f[(i * D + r) * l->N + step] = a->df[r][i];
    }
    for (size_t k = 0; k < l->n_dynamic; k++) {
        struct split force = {{0}, {0}}, change = {{0}, {0}};
        for (size_t c = 0; c < D; c++) {
            double complex alpha = l->alpha[c * l->n_dynamic + k];
            for (int i = 0; i < LANES; i++) {
                force.re[i] += creal(alpha) * a->df[c][i];
                force.im[i] += cimag(alpha) * a->df[c][i];
            }
        }
        add_scalar_times(&change, -l->step[k].g1, force.re, force.im);
        for (int i = 0; i < LANES; i++) {
            a->q_re[k][i] += change.re[i];
            a->q_im[k][i] += change.im[i];
        }
    }
    for (size_t r = 0; r < D; r++) {
        for (size_t c = 0; c < D; c++) {
            for (int i = 0; i < LANES; i++) {
                a->w[r][i] += l->S_w[r * D + c] * a->df[c][i];
                a->v[r][i] += l->S_v[r * D + c] * a->df[c][i];
            }
        }
    }
}

static void step_states(struct lanes *a, size_t step)
{
    const struct law_run *l = a->l;
    const struct predictor *p = l->run->p;
    for (size_t e = 0; l->state != NULL && e < p->model.n_effects; e++) {
        const struct law *law = &p->laws[e];
        int n = law->effect->n_law_states;
        if (law->d == 0 || n == 0)
            continue;
        const struct law_force *s = &l->state[step * p->model.n_effects + e];
        size_t c = law_first_coordinate(p, e);
        double next[BEAM_LAW_STATES][LANES] = {{0}};
        for (int k = 0; k < n; k++) {
            for (size_t i = 0; i < LANES; i++) {
                next[k][i] = s->z_by_w[k] * a->w[c][i] + s->z_by_v[k] * a->v[c][i] + s->z_by_w_old[k] * a->w_old[c][i];
                for (int m = 0; m < n; m++)
                    next[k][i] += s->z_by_z[k][m] * a->z[e][m][i];
                for (size_t d = 0; i < a->count && d < law->n_dependencies; d++)
                    if (law->dependency[d] == a->parameter[i])
                        next[k][i] += s->z_by_parameter[k][d];
            }
        }
        memcpy(a->z[e], next, sizeof next);
    }
}

VECTOR_CLONES static void march(struct lanes *a)
{
    const struct law_run *l = a->l;
    size_t D = l->D, P = l->n_dynamic;
    const double zero[MOST_COORDINATES] = {0};
    double b[MOST_COORDINATES][LANES];
    for (size_t step = 0; step < l->N; step++) {
        const double *f0 = step > 0 ? l->f + (step - 1) * D : zero, *f1 = l->f + step * D;
        start_motion(a, step, f1);
        for (size_t k = 0; k < P; k++) {
            double complex q_old = step > 0 ? l->q[(step - 1) * P + k] : 0.0;
            free_state(a, k, q_old, f0, f1);
            add_free_motion(a, k, l->q[step * P + k]);
        }
        right_side(a, step, b);
        finish_step(a, step, b);
        step_states(a, step);
        memcpy(a->w_old, a->w, D * sizeof a->w[0]);
    }
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
        march(a);
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
