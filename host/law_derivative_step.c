/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_lanes.h"

#include <string.h>

#include "vector.h"

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
            a->v[c][i] += pq_re * da_re[i] - pq_im * da_im[i] + pa_re * dq_re[i] - pa_im * dq_im[i] + aq_re * dp_re[i] -
                          aq_im * dp_im[i];
        }
        for (int i = 0; l->uses_w && i < LANES; i++)
            a->w[c][i] += q_re * da_re[i] - q_im * da_im[i] + a_re * dq_re[i] - a_im * dq_im[i];
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

VECTOR_CLONES void law_lanes_march(struct lanes *a)
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
