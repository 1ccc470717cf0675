/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_step.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* The step's equation is solved to this part of the largest force so far. */
static const double step_tolerance = 1e-11;
/* A step of a known rate of convergence that must end below this is not checked by another evaluation. */
static const double trusted_tolerance = 1e-10;
/* So it is with the last of Newton's steps in a smooth law: it squares an error of this part of the largest force. */
static const double last_newton = 1e-6;
enum { MOST_STEPS = 48 };
/* More unsolved steps than this part of a record are an error. */
static const double most_failed = 1e-3;

/* ---- One step's equation ---- */

static void move(const struct law_run *l, struct stepper *s)
{
    size_t D = l->D;
    for (size_t c = 0; c < D; c++) {
        s->w[c] = s->w_free[c];
        s->v[c] = s->v_free[c];
        for (size_t b = 0; b < D; b++) {
            s->w[c] += l->S_w[c * D + b] * s->f[b];
            s->v[c] += l->S_v[c * D + b] * s->f[b];
        }
    }
    for (size_t c = 0; l->uses_a && c < D; c++) {
        s->a[c] = s->a_free[c];
        for (size_t b = 0; b < D; b++)
            s->a[c] += l->S_a[c * D + b] * s->f[b];
    }
}

static void keep_memory(struct law_memory *out, const struct law_force *force)
{
    memcpy(out->by_z, force->by_z, sizeof out->by_z);
    memcpy(out->z_by_w, force->z_by_w, sizeof out->z_by_w);
    memcpy(out->z_by_v, force->z_by_v, sizeof out->z_by_v);
    memcpy(out->z_by_w_old, force->z_by_w_old, sizeof out->z_by_w_old);
    memcpy(out->z_by_z, force->z_by_z, sizeof out->z_by_z);
    memcpy(out->z_by_parameter, force->z_by_parameter, sizeof out->z_by_parameter);
}

/* Into the big arrays of one step: tangents (block diagonal in the effects), derivatives, state. */
static void keep(struct law_run *l, size_t step, size_t e, size_t first, size_t dependency,
                 const struct law_force *force)
{
    const struct law *law = l->laws[e].law;
    size_t D = l->D, d = law->d;
    for (size_t i = 0; i < d; i++)
        memcpy(l->T_old + (step * D + first + i) * D + first, force->by_w_old + i * d, d * sizeof(double));
    memcpy(l->f_p + (step * l->n_dependencies + dependency) * LAW_COORDINATES, force->by_parameter,
           law->n_dependencies * sizeof force->by_parameter[0]);
    if (law->effect->n_law_states > 0)
        keep_memory(&l->state[step * l->n_laws + e], force);
}

/* A force that is faded: everything by which it acts is. What happens to its internal states is not. */
static void fade_force(struct law_force *force, const struct law *law, double factor, bool tangents, bool derivatives)
{
    size_t d = law->d, square = d * d;
    for (size_t i = 0; i < d; i++)
        force->f[i] *= factor;
    for (size_t i = 0; tangents && i < square; i++) {
        force->by_w[i] *= factor;
        force->by_v[i] *= factor;
        force->by_w_old[i] *= factor;
        if (law->shortening != NULL)
            force->by_a[i] *= factor;
    }
    for (size_t p = 0; derivatives && p < law->n_dependencies; p++)
        for (size_t i = 0; i < d; i++)
            force->by_parameter[p][i] *= factor;
    for (int k = 0; derivatives && k < law->effect->n_law_states; k++)
        force->by_z[k] *= factor;
}

/* Motion, forces and tangents at the trial f; store: into the record's arrays too. −1: out of range. */
static int step_evaluate(struct law_run *l, struct stepper *s, size_t step, bool tangents, bool store)
{
    size_t D = l->D, first = 0, dependency = 0;
    move(l, s);
    for (size_t e = 0; e < l->n_laws; e++) {
        const struct law *law = l->laws[e].law;
        struct law_motion motion = {.w = s->w + first,
                                    .v = s->v + first,
                                    .w_old = s->w_old + first,
                                    .a = s->a + first,
                                    .z = s->z + e * BEAM_LAW_STATES,
                                    .t_s = l->system->t0_s + ((double)step - (double)l->lead) * l->h_s,
                                    .dt_s = l->h_s};
        struct law_force force;
        if (law_force(&l->laws[e], &motion, tangents, store, &force) != 0)
            return -1;
        if (l->fade != NULL && l->fade[step] < 1.0)
            fade_force(&force, law, l->fade[step], tangents, store);
        memcpy(s->law + first, force.f, law->d * sizeof(double));
        for (int k = 0; k < law->effect->n_law_states; k++)
            s->z_next[e * BEAM_LAW_STATES + (size_t)k] = force.z[k];
        for (size_t i = 0; tangents && i < law->d; i++) {
            memcpy(s->T_w + (first + i) * D + first, force.by_w + i * law->d, law->d * sizeof(double));
            memcpy(s->T_v + (first + i) * D + first, force.by_v + i * law->d, law->d * sizeof(double));
            if (law->shortening != NULL)
                memcpy(s->T_a + (first + i) * D + first, force.by_a + i * law->d, law->d * sizeof(double));
        }
        if (store)
            keep(l, step, e, first, dependency, &force);
        first += law->d;
        dependency += law->n_dependencies;
    }
    return 0;
}

static double residual_size(const struct law_run *l, struct stepper *s)
{
    double worst = 0.0;
    for (size_t c = 0; c < l->D; c++) {
        double residual = fabs(s->f[c] - s->law[c]), size = fabs(s->law[c]);
        worst = residual <= worst ? worst : residual; /* takes a NaN */
        s->scale = size > s->scale ? size : s->scale;
    }
    return worst;
}

static enum bf_status out_of_range(struct bf_error *err)
{
    return bf_fail(err, BF_NUMERIC, "a nonlinear effect is outside its physical range");
}

static enum bf_status unbounded(struct bf_error *err)
{
    return bf_fail(err, BF_NUMERIC, "the motion grows without bound in a nonlinear effect");
}

/*
 * One coordinate: g(f) = f − law(f) grows with f for every law that opposes motion (S_w, S_v ≤ 0), so its sign brackets
 * the root; Newton inside the bracket, bisection where Newton leaves it or creeps (stiff friction, contact).
 */
static enum bf_status solve_scalar(struct law_run *l, struct stepper *s, size_t step, struct bf_error *err)
{
    double low = -INFINITY, high = INFINITY, previous = INFINITY;
    for (int i = 0; i < MOST_STEPS; i++) {
        if (step_evaluate(l, s, step, true, false) != 0)
            return out_of_range(err);
        double g = s->f[0] - s->law[0], size = residual_size(l, s);
        if (!isfinite(size))
            return unbounded(err);
        if (size <= step_tolerance * s->scale || !(high - low > step_tolerance * s->scale))
            return BF_OK;
        if (g > 0.0)
            high = s->f[0] < high ? s->f[0] : high;
        else
            low = s->f[0] > low ? s->f[0] : low;
        double slope = 1.0 - s->T_w[0] * l->S_w[0] - s->T_v[0] * l->S_v[0] - s->T_a[0] * l->S_a[0];
        double next = s->f[0] - g / slope;
        bool creeps = i > 1 && size > 0.5 * previous;
        if ((creeps || !(next > low && next < high)) && isfinite(low) && isfinite(high))
            next = 0.5 * (low + high);
        else if (l->held == HOLD_CUBIC && size <= last_newton * s->scale) {
            s->f[0] = next;
            return BF_OK;
        }
        previous = size;
        s->f[0] = next;
    }
    l->failed_steps++;
    return BF_OK;
}

/* A⁻¹ at the trial f, for the steps to come. */
static enum bf_status refresh(struct law_run *l, struct stepper *s, size_t step, struct bf_error *err)
{
    if (step_evaluate(l, s, step, true, false) != 0)
        return out_of_range(err);
    s->newton = true;
    return step_inverse(l, s, s->inverse, err);
}

static void correct(const struct law_run *l, struct stepper *s)
{
    size_t D = l->D;
    double residual[MOST_COORDINATES];
    for (size_t c = 0; c < D; c++)
        residual[c] = s->law[c] - s->f[c];
    for (size_t c = 0; c < D; c++) {
        double change = s->newton ? 0.0 : residual[c];
        for (size_t b = 0; s->newton && b < D; b++)
            change += s->inverse[c * D + b] * residual[b];
        s->f[c] += change;
    }
}

/* f = law(f): fixed-point steps while they contract well, else Newton's with a matrix that is kept while it serves. */
static enum bf_status solve_step(struct law_run *l, struct stepper *s, size_t step, struct bf_error *err)
{
    static const double good_rate = 0.1, forget = 0.9;
    double previous = INFINITY;
    for (int i = 0; i < MOST_STEPS; i++) {
        if (step_evaluate(l, s, step, false, false) != 0)
            return out_of_range(err);
        double size = residual_size(l, s);
        if (!isfinite(size))
            return unbounded(err);
        if (size <= step_tolerance * s->scale)
            return BF_OK;
        if (i > 0) {
            double rate = size / previous;
            s->rate = rate > forget * s->rate ? rate : forget * s->rate;
            enum bf_status status = rate > good_rate ? refresh(l, s, step, err) : BF_OK;
            if (status != BF_OK)
                return status;
        }
        correct(l, s);
        if (l->held == HOLD_CUBIC && s->rate * size <= trusted_tolerance * s->scale)
            return BF_OK;
        previous = size;
    }
    l->failed_steps++;
    return BF_OK;
}

/* Tangents and derivatives at the accepted f, for the derivatives of the record. */
static enum bf_status step_store(struct law_run *l, struct stepper *s, size_t step, struct bf_error *err)
{
    size_t square = l->D * l->D;
    if (step_evaluate(l, s, step, true, true) != 0)
        return out_of_range(err);
    memcpy(l->T_w + step * square, s->T_w, square * sizeof(double));
    memcpy(l->T_v + step * square, s->T_v, square * sizeof(double));
    if (l->uses_a)
        memcpy(l->T_a + step * square, s->T_a, square * sizeof(double));
    return step_inverse(l, s, l->inverse + step * square, err);
}

/* ---- From step to step ---- */

/* The forces of the step begin where the polynomial through the last ones leads. */
static void extrapolate(const struct law_run *l, struct stepper *s)
{
    double(*past)[MOST_COORDINATES] = s->past;
    for (size_t c = 0; c < l->D; c++) {
        double line = 2.0 * past[0][c] - past[1][c];
        double cubic = 4.0 * past[0][c] - 6.0 * past[1][c] + 4.0 * past[2][c] - past[3][c];
        s->f[c] = l->held == HOLD_CUBIC ? cubic : line;
    }
}

/* Everything of the next instant that does not depend on its forces. */
VECTOR_INLINE void free_motion(const struct law_run *l, struct stepper *s, size_t step, size_t held)
{
    size_t D = l->D, P = l->P;
    for (size_t k = 0; k < P; k += VECTOR_LENGTH) {
        vector_real q_re, q_im, a, b, re, im;
        vector_load(&q_re, s->q.re + k);
        vector_load(&q_im, s->q.im + k);
        vector_load(&a, l->e.re + k);
        vector_load(&b, l->e.im + k);
        re = a * q_re - b * q_im;
        im = a * q_im + b * q_re;
        for (size_t i = 1; i < held; i++) {
            vector_load(&q_re, s->F[i].re + k);
            vector_load(&q_im, s->F[i].im + k);
            vector_load(&a, l->g[i].re + k);
            vector_load(&b, l->g[i].im + k);
            re -= a * q_re - b * q_im;
            im -= a * q_im + b * q_re;
        }
        vector_store(s->free_q.re + k, &re);
        vector_store(s->free_q.im + k, &im);
    }
    for (size_t c = 0; c < D; c++) {
        s->w_free[c] = s->v_free[c] = 0.0;
        if (l->uses_w)
            s->w_free[c] = l->w_lin[c * l->N + step] + vector_dot(P, l->to_w.re + c * P, s->free_q.re) -
                           vector_dot(P, l->to_w.im + c * P, s->free_q.im);
        if (l->uses_v)
            s->v_free[c] = l->v_lin[c * l->N + step] + vector_dot(P, l->to_v.re + c * P, s->free_q.re) -
                           vector_dot(P, l->to_v.im + c * P, s->free_q.im);
        if (l->uses_a)
            s->a_free[c] = l->a_lin[c * l->N + step] + vector_dot(P, l->to_a.re + c * P, s->free_q.re) -
                           vector_dot(P, l->to_a.im + c * P, s->free_q.im);
    }
}

/* q of the poles under the forces found; the forces become the past. */
VECTOR_INLINE void accept_step(struct law_run *l, struct stepper *s, size_t step, size_t held)
{
    size_t D = l->D, P = l->P;
    struct law_row newest = s->F[held - 1];
    for (size_t i = held - 1; i > 0; i--)
        s->F[i] = s->F[i - 1];
    s->F[0] = newest; /* free again */
    for (size_t k = 0; k < P; k += VECTOR_LENGTH) {
        vector_real re = {0.0}, im = {0.0}, a, b, q;
        for (size_t c = 0; c < D; c++) {
            vector_load(&a, l->alpha.re + c * P + k);
            vector_load(&b, l->alpha.im + c * P + k);
            re += s->f[c] * a;
            im += s->f[c] * b;
        }
        vector_store(s->F[1].re + k, &re);
        vector_store(s->F[1].im + k, &im);
        vector_load(&a, l->g[0].re + k);
        vector_load(&b, l->g[0].im + k);
        vector_load(&q, s->free_q.re + k);
        q -= a * re - b * im;
        vector_store(s->q.re + k, &q);
        vector_load(&q, s->free_q.im + k);
        q -= a * im + b * re;
        vector_store(s->q.im + k, &q);
    }
    memcpy(l->f + step * D, s->f, D * sizeof(double));
    memmove(s->past[1], s->past[0], (HOLD_CUBIC - 1) * sizeof s->past[0]);
    memcpy(s->past[0], s->f, D * sizeof(double));
    memcpy(s->w_old, s->w, D * sizeof(double));
    memcpy(s->z, s->z_next, l->n_laws * BEAM_LAW_STATES * sizeof(double));
    if (l->q.re != NULL) {
        memcpy(l->q.re + step * P, s->q.re, P * sizeof(double));
        memcpy(l->q.im + step * P, s->q.im, P * sizeof(double));
    }
}

VECTOR_INLINE enum bf_status march(struct law_run *l, struct stepper *s, size_t held, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t step = 0; status == BF_OK && step < l->N; step++) {
        free_motion(l, s, step, held);
        extrapolate(l, s);
        status = l->D == 1 ? solve_scalar(l, s, step, err) : solve_step(l, s, step, err);
        if (status == BF_OK && l->q.re != NULL)
            status = step_store(l, s, step, err);
        else
            move(l, s);
        accept_step(l, s, step, held);
    }
    return status;
}

VECTOR_CLONES static enum bf_status march_clones(struct law_run *l, struct stepper *s, struct bf_error *err)
{
    return l->held == HOLD_CUBIC ? march(l, s, HOLD_CUBIC, err) : march(l, s, HOLD_LINE, err);
}

static bool any(const double x[], size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (x[i] < 0.0 || x[i] > 0.0)
            return true;
    return false;
}

/* Which motions the derivatives must follow. A law with internal states may need them all. */
static void find_tangents(struct law_run *l)
{
    size_t n = l->N * l->D * l->D;
    l->has_T_v = l->state != NULL || any(l->T_v, n);
    l->has_T_w = l->state != NULL || any(l->T_w, n) || any(l->T_old, n);
}

enum bf_status law_run_march(struct law_run *l, struct bf_error *err)
{
    size_t states = l->n_laws * BEAM_LAW_STATES, P = l->P;
    struct stepper s = {.rate = 1.0};
    double *rows = bf_alloc(2 * P * (2 + HOLD_CUBIC) + 2 * states, sizeof *rows);
    s.q = (struct law_row){.re = rows, .im = rows + P};
    s.free_q = (struct law_row){.re = rows + 2 * P, .im = rows + 3 * P};
    for (size_t i = 0; i < HOLD_CUBIC; i++)
        s.F[i] = (struct law_row){.re = rows + (4 + 2 * i) * P, .im = rows + (5 + 2 * i) * P};
    s.z = rows + 2 * P * (2 + HOLD_CUBIC);
    s.z_next = s.z + states;
    enum bf_status status = march_clones(l, &s, err);
    if (status == BF_OK && l->q.re != NULL)
        find_tangents(l);
    if (status == BF_OK && (double)l->failed_steps > 1.0 + most_failed * (double)l->N)
        status =
            bf_fail(err, BF_NUMERIC, "%zu of %zu steps of a nonlinear effect did not converge", l->failed_steps, l->N);
    free(rows);
    return status;
}
