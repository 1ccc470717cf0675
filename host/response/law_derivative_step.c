/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_lanes.h"

#include <stdlib.h>

/* ---- Shared by all parameters ---- */

/* R = e' q − Σ_i g_i' F_i, ' the derivative by the pole; F = Σ_c α_c f_c. */
VECTOR_CLONES static void fill_changes(const struct law_run *l, const struct law_row *d_e,
                                       const struct law_row d_g[HOLD_CUBIC], struct law_row *R, struct law_row *F)
{
    size_t D = l->D, P = l->P;
    for (size_t step = 0; step < l->N; step++) {
        for (size_t k = 0; k < P; k += VECTOR_LENGTH) {
            vector_real re = {0.0}, im = {0.0}, a, b, x, y;
            for (size_t c = 0; c < D; c++) {
                vector_load(&a, l->alpha.re + c * P + k);
                vector_load(&b, l->alpha.im + c * P + k);
                re += l->f[step * D + c] * a;
                im += l->f[step * D + c] * b;
            }
            vector_store(F->re + step * P + k, &re);
            vector_store(F->im + step * P + k, &im);
            re = im = (vector_real){0.0};
            if (step > 0) {
                vector_load(&a, d_e->re + k);
                vector_load(&b, d_e->im + k);
                vector_load(&x, l->q.re + (step - 1) * P + k);
                vector_load(&y, l->q.im + (step - 1) * P + k);
                re = a * x - b * y;
                im = a * y + b * x;
            }
            for (size_t i = 0; i < l->held && i <= step; i++) {
                vector_load(&a, d_g[i].re + k);
                vector_load(&b, d_g[i].im + k);
                vector_load(&x, F->re + (step - i) * P + k);
                vector_load(&y, F->im + (step - i) * P + k);
                re -= a * x - b * y;
                im -= a * y + b * x;
            }
            vector_store(R->re + step * P + k, &re);
            vector_store(R->im + step * P + k, &im);
        }
    }
}

struct law_row law_pole_changes(const struct law_run *l)
{
    size_t P = l->P, size = l->N * P;
    double *rates = bf_alloc(2 * P * (1 + HOLD_CUBIC), sizeof *rates);
    double *forces = bf_grow(NULL, 2 * size, sizeof *forces);
    struct law_row R = {.re = bf_grow(NULL, 2 * size, sizeof(double))}, F = {forces, forces + size};
    struct law_row d_e = {rates, rates + P}, d_g[HOLD_CUBIC];
    R.im = R.re + size;
    for (size_t i = 0; i < HOLD_CUBIC; i++)
        d_g[i] = (struct law_row){rates + 2 * (i + 1) * P, rates + (2 * i + 3) * P};
    for (size_t k = 0; k < l->n_dynamic; k++) {
        d_e.re[k] = creal(l->hold[k].d_e);
        d_e.im[k] = cimag(l->hold[k].d_e);
        for (size_t i = 0; i < HOLD_CUBIC; i++) {
            d_g[i].re[k] = creal(l->hold[k].d_g[i]);
            d_g[i].im[k] = cimag(l->hold[k].d_g[i]);
        }
    }
    fill_changes(l, &d_e, d_g, &R, &F);
    free(rates);
    free(forces);
    return R;
}

/* ---- One step of the lanes ---- */

struct complex_lanes {
    vector_real re, im;
};

VECTOR_INLINE void load(struct complex_lanes *out, double (*re)[LANES], double (*im)[LANES], size_t row)
{
    vector_load(&out->re, re[row]);
    vector_load(&out->im, im[row]);
}

VECTOR_INLINE void store(double (*re)[LANES], double (*im)[LANES], size_t row, const struct complex_lanes *x)
{
    vector_store(re[row], &x->re);
    vector_store(im[row], &x->im);
}

/* out += x y for a number x. */
VECTOR_INLINE void add_product(struct complex_lanes *out, double x_re, double x_im, const struct complex_lanes *y)
{
    out->re += x_re * y->re - x_im * y->im;
    out->im += x_re * y->im + x_im * y->re;
}

VECTOR_INLINE void start_motion(const struct lanes *a, size_t step, size_t D, const double f[], vector_real w[],
                                vector_real v[])
{
    for (size_t c = 0; c < D; c++) {
        vector_real far;
        vector_load(&w[c], a->w_lin + (step * D + c) * LANES);
        vector_load(&v[c], a->v_lin + (step * D + c) * LANES);
        for (size_t b = 0; a->structural && b < D; b++) {
            vector_load(&far, a->far + (c * D + b) * LANES);
            w[c] += f[b] * far;
        }
    }
}

/* δq⁺ but for −g0 Σ α δf⁺, of pole k; leaves Σ_c f_c δα_c in F[0]. */
VECTOR_INLINE void free_state(struct lanes *a, size_t k, size_t held, size_t D, const double f[], double R_re,
                              double R_im, struct complex_lanes *next)
{
    const struct law_run *l = a->l;
    struct complex_lanes x, force = {{0.0}, {0.0}};
    *next = force;
    load(&x, a->q_re, a->q_im, k);
    add_product(next, l->e.re[k], l->e.im[k], &x);
    for (size_t i = 1; i < held; i++) {
        load(&x, a->F_re[i], a->F_im[i], k);
        add_product(next, -l->g[i].re[k], -l->g[i].im[k], &x);
    }
    if (a->structural) {
        load(&x, a->p_re, a->p_im, k);
        add_product(next, R_re, R_im, &x);
        for (size_t c = 0; c < D; c++) {
            load(&x, a->a_re, a->a_im, c * l->P + k);
            force.re += f[c] * x.re;
            force.im += f[c] * x.im;
        }
        add_product(next, -l->g[0].re[k], -l->g[0].im[k], &force);
    }
    store(a->F_re[0], a->F_im[0], k, &force);
    store(a->q_re, a->q_im, k, next);
}

/* δw = Re(α δq + q δα), δv = Re(α (p δq + q δp) + p q δα), for a pair twice; without what depends on δf⁺. */
VECTOR_INLINE void add_motion(const struct lanes *a, size_t k, size_t D, double q_re, double q_im,
                              const struct complex_lanes *dq, vector_real w[], vector_real v[])
{
    const struct law_run *l = a->l;
    struct complex_lanes rate = {{0.0}, {0.0}}, x;
    double p_re = l->p.re[k], p_im = l->p.im[k], twice = k < l->n_dynamic ? l->multiplicity[k] : 0.0;
    if (l->has_T_v) {
        add_product(&rate, p_re, p_im, dq);
        if (a->structural) {
            load(&x, a->p_re, a->p_im, k);
            add_product(&rate, q_re, q_im, &x);
        }
    }
    q_re *= twice;
    q_im *= twice;
    double pq_re = p_re * q_re - p_im * q_im, pq_im = p_re * q_im + p_im * q_re;
    for (size_t c = 0; c < D; c++) {
        size_t row = c * l->P + k;
        double to_re = l->to_w.re[row], to_im = l->to_w.im[row];
        if (l->has_T_w)
            w[c] += to_re * dq->re - to_im * dq->im;
        if (l->has_T_v)
            v[c] += to_re * rate.re - to_im * rate.im;
        if (!a->structural)
            continue;
        load(&x, a->a_re, a->a_im, row);
        if (l->has_T_w)
            w[c] += q_re * x.re - q_im * x.im;
        if (l->has_T_v)
            v[c] += pq_re * x.re - pq_im * x.im;
    }
}

VECTOR_INLINE void start_acceleration(struct lanes *a, size_t step, size_t D, const double f[])
{
    for (size_t c = 0; c < D; c++) {
        vector_real sum, jump;
        vector_load(&sum, a->a_lin + (step * D + c) * LANES);
        for (size_t b = 0; a->structural && b < D; b++) {
            vector_load(&jump, a->jump + (c * D + b) * LANES);
            sum -= f[b] * jump;
        }
        vector_store(a->acceleration[c], &sum);
    }
}

/* δa = Re(α p (p δq + 2 q δp) + p² q δα), for a pair twice. */
VECTOR_INLINE void add_acceleration(struct lanes *a, size_t k, size_t D, double q_re, double q_im,
                                    const struct complex_lanes *dq)
{
    const struct law_run *l = a->l;
    struct complex_lanes rate = {{0.0}, {0.0}}, x;
    double p_re = l->p.re[k], p_im = l->p.im[k], twice = l->multiplicity[k];
    double pq_re = p_re * q_re - p_im * q_im, pq_im = p_re * q_im + p_im * q_re;
    double ppq_re = twice * (p_re * pq_re - p_im * pq_im), ppq_im = twice * (p_re * pq_im + p_im * pq_re);
    add_product(&rate, p_re, p_im, dq);
    if (a->structural) {
        load(&x, a->p_re, a->p_im, k);
        add_product(&rate, 2.0 * q_re, 2.0 * q_im, &x);
    }
    for (size_t c = 0; c < D; c++) {
        size_t row = c * l->P + k;
        vector_real sum;
        vector_load(&sum, a->acceleration[c]);
        sum += l->to_v.re[row] * rate.re - l->to_v.im[row] * rate.im;
        if (a->structural) {
            load(&x, a->a_re, a->a_im, row);
            sum += ppq_re * x.re - ppq_im * x.im;
        }
        vector_store(a->acceleration[c], &sum);
    }
}

/* Right side of A δf⁺ = T_w δw_free + T_v δv_free + T_a δa_free + T_old δw_old + f_z δz + f_p. */
VECTOR_INLINE void right_side(const struct lanes *a, size_t step, size_t D, double b[MOST_COORDINATES][LANES])
{
    const struct law_run *l = a->l;
    const double *T_w = l->T_w + step * D * D, *T_v = l->T_v + step * D * D, *T_old = l->T_old + step * D * D;
    for (size_t r = 0; r < D; r++) {
        vector_real sum = {0.0}, x;
        for (size_t c = 0; c < D; c++) {
            vector_load(&x, a->w[c]);
            sum += T_w[r * D + c] * x;
            vector_load(&x, a->v[c]);
            sum += T_v[r * D + c] * x;
            vector_load(&x, a->w_old[c]);
            sum += T_old[r * D + c] * x;
        }
        for (size_t c = 0; l->uses_a && c < D; c++) {
            vector_load(&x, a->acceleration[c]);
            sum += l->T_a[(step * D + r) * D + c] * x;
        }
        vector_store(b[r], &sum);
    }
    for (size_t i = 0; i < a->n_direct; i++) {
        const struct direct *direct = &a->direct[i];
        for (size_t r = 0; r < direct->d; r++)
            b[direct->first + r][direct->lane] +=
                l->f_p[(step * l->n_dependencies + direct->dependency) * LAW_COORDINATES + r];
    }
    for (size_t e = 0, first = 0; l->state != NULL && e < l->n_laws; first += l->laws[e++].law->d)
        for (int k = 0; k < l->laws[e].law->effect->n_law_states; k++)
            for (int i = 0; i < LANES; i++)
                /* every row was stored above: NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign) */
                b[first][i] += l->state[step * l->n_laws + e].by_z[k] * a->z[e][k][i];
}

/* δf⁺, and with it δq⁺, δw⁺, δv⁺. */
VECTOR_INLINE void finish_step(struct lanes *a, size_t step, size_t D, double b[MOST_COORDINATES][LANES])
{
    const struct law_run *l = a->l;
    const double *inverse = l->inverse + step * D * D;
    vector_real df[MOST_COORDINATES], x;
    for (size_t r = 0; r < D; r++) {
        df[r] = (vector_real){0.0};
        for (size_t c = 0; c < D; c++) {
            vector_load(&x, b[c]);
            df[r] += inverse[r * D + c] * x;
        }
        vector_store(a->df[r], &df[r]);
        vector_store(a->f + (step * D + r) * LANES, &df[r]);
    }
    for (size_t k = 0; k < l->n_dynamic; k++) {
        struct complex_lanes force = {{0.0}, {0.0}}, q;
        for (size_t c = 0; c < D; c++) {
            force.re += l->alpha.re[c * l->P + k] * df[c];
            force.im += l->alpha.im[c * l->P + k] * df[c];
        }
        load(&q, a->q_re, a->q_im, k);
        add_product(&q, -l->g[0].re[k], -l->g[0].im[k], &force);
        store(a->q_re, a->q_im, k, &q);
        load(&q, a->F_re[0], a->F_im[0], k);
        force.re += q.re;
        force.im += q.im;
        store(a->F_re[0], a->F_im[0], k, &force);
    }
    for (size_t r = 0; r < D; r++) {
        vector_real w, v;
        vector_load(&w, a->w[r]);
        vector_load(&v, a->v[r]);
        for (size_t c = 0; c < D; c++) {
            w += l->S_w[r * D + c] * df[c];
            v += l->S_v[r * D + c] * df[c];
        }
        vector_store(a->w[r], &w);
        vector_store(a->v[r], &v);
    }
}

static void step_states(struct lanes *a, size_t step)
{
    const struct law_run *l = a->l;
    for (size_t e = 0, c = 0; e < l->n_laws; c += l->laws[e++].law->d) {
        const struct law *law = l->laws[e].law;
        int n = law->effect->n_law_states;
        if (n == 0)
            continue;
        const struct law_memory *s = &l->state[step * l->n_laws + e];
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

/* ---- All steps ---- */

/* The forces of a step become those of one step ago. */
VECTOR_INLINE void rotate(double (*F[HOLD_CUBIC])[LANES], size_t held)
{
    double(*newest)[LANES] = F[held - 1];
    for (size_t i = held - 1; i > 0; i--)
        F[i] = F[i - 1];
    F[0] = newest;
}

VECTOR_INLINE void march(struct lanes *a, const struct law_row *R, size_t held, size_t D)
{
    const struct law_run *l = a->l;
    size_t P = l->P;
    double b[MOST_COORDINATES][LANES];
    for (size_t step = 0; step < l->N; step++) {
        const double *f = l->f + step * D;
        vector_real w[MOST_COORDINATES], v[MOST_COORDINATES];
        start_motion(a, step, D, f, w, v);
        if (l->uses_a)
            start_acceleration(a, step, D, f);
        for (size_t k = 0; k < l->n_dynamic; k++) {
            size_t i = step * P + k;
            struct complex_lanes dq;
            free_state(a, k, held, D, f, R->re[i], R->im[i], &dq);
            add_motion(a, k, D, l->q.re[i], l->q.im[i], &dq, w, v);
            if (l->uses_a)
                add_acceleration(a, k, D, l->q.re[i], l->q.im[i], &dq);
        }
        for (size_t c = 0; c < D; c++) {
            vector_store(a->w[c], &w[c]);
            vector_store(a->v[c], &v[c]);
        }
        right_side(a, step, D, b);
        finish_step(a, step, D, b);
        if (l->state != NULL)
            step_states(a, step);
        memcpy(a->w_old, a->w, D * sizeof a->w[0]);
        rotate(a->F_re, held);
        rotate(a->F_im, held);
    }
}

VECTOR_CLONES void law_lanes_march(struct lanes *a, const struct law_row *R)
{
    bool cubic = a->l->held == HOLD_CUBIC;
    if (a->l->D == 1 && cubic)
        march(a, R, HOLD_CUBIC, 1);
    else if (a->l->D == 1)
        march(a, R, HOLD_LINE, 1);
    else if (cubic)
        march(a, R, HOLD_CUBIC, a->l->D);
    else
        march(a, R, HOLD_LINE, a->l->D);
}
