/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_run.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "dense.h"

/* The step's equation is solved to this part of the largest force so far. */
static const double step_tolerance = 1e-11;
/* A contracting fixed-point step that begins below this ends far below the tolerance. */
static const double last_picard = 1e-9;
enum { PICARD_STEPS = 8, NEWTON_STEPS = 40 };
/* More unsolved steps than this part of a record are an error. */
static const double most_failed = 1e-3;

struct stepper {
    double complex *q, *free_q; /* [n_dynamic] */
    double w[MOST_COORDINATES], v[MOST_COORDINATES], w_old[MOST_COORDINATES];
    double w_free[MOST_COORDINATES], v_free[MOST_COORDINATES];
    double f[MOST_COORDINATES], f_old[MOST_COORDINATES], law[MOST_COORDINATES], scale;
    double *z, *z_next; /* [n_effects][BEAM_LAW_STATES] */
    double T_w[MOST_COORDINATES * MOST_COORDINATES], T_v[MOST_COORDINATES * MOST_COORDINATES];
};

/* Forces (and tangents, block diagonal in the effects) at the trial f. */
static int evaluate_laws(const struct law_run *l, struct stepper *s, size_t step, bool tangents, size_t store)
{
    const struct predictor *p = l->run->p;
    size_t D = l->D;
    for (size_t c = 0; c < D; c++) {
        s->w[c] = s->w_free[c];
        s->v[c] = s->v_free[c];
        for (size_t b = 0; b < D; b++) {
            s->w[c] += l->S_w[c * D + b] * s->f[b];
            s->v[c] += l->S_v[c * D + b] * s->f[b];
        }
    }
    for (size_t e = 0; e < p->model.n_effects; e++) {
        const struct law *law = &p->laws[e];
        if (law->d == 0)
            continue;
        size_t first = law_first_coordinate(p, e);
        struct law_motion motion = {.w = s->w + first,
                                    .v = s->v + first,
                                    .w_old = s->w_old + first,
                                    .z = s->z + e * BEAM_LAW_STATES,
                                    .t_s = (double)step * l->h_s,
                                    .dt_s = l->h_s};
        struct law_force local,
            *force = store != SIZE_MAX && l->state != NULL ? &l->state[store * p->model.n_effects + e] : &local;
        if (law_evaluate(law, &p->map, l->run->theta, &motion, tangents, store != SIZE_MAX, force) != 0)
            return -1;
        memcpy(s->law + first, force->f, law->d * sizeof(double));
        for (int k = 0; k < law->effect->n_law_states; k++)
            s->z_next[e * BEAM_LAW_STATES + (size_t)k] = force->z[k];
        for (size_t i = 0; tangents && i < law->d; i++) {
            for (size_t j = 0; j < law->d; j++) {
                s->T_w[(first + i) * D + first + j] = force->by_w[i * law->d + j];
                s->T_v[(first + i) * D + first + j] = force->by_v[i * law->d + j];
                if (store != SIZE_MAX)
                    l->T_old[(store * D + first + i) * D + first + j] = force->by_w_old[i * law->d + j];
            }
        }
        if (store != SIZE_MAX)
            memcpy(l->f_p + (store * l->n_dependencies + law_first_dependency(p, e)) * LAW_COORDINATES,
                   force->by_parameter, law->n_dependencies * sizeof force->by_parameter[0]);
    }
    return 0;
}

/* A = I − T_w S_w − T_v S_v, column-major for LAPACK. */
static void step_matrix(const struct law_run *l, const struct stepper *s, double A[])
{
    size_t D = l->D;
    for (size_t i = 0; i < D; i++) {
        for (size_t j = 0; j < D; j++) {
            double sum = i == j ? 1.0 : 0.0;
            for (size_t b = 0; b < D; b++)
                sum -= s->T_w[i * D + b] * l->S_w[b * D + j] + s->T_v[i * D + b] * l->S_v[b * D + j];
            A[i + j * D] = sum;
        }
    }
}

static double residual_size(const struct law_run *l, struct stepper *s)
{
    double worst = 0.0;
    for (size_t c = 0; c < l->D; c++) {
        worst = fmax(worst, fabs(s->f[c] - s->law[c]));
        s->scale = fmax(s->scale, fabs(s->law[c]));
    }
    return worst;
}

/* δ = A⁻¹ (law − f); f += δ. */
static enum bf_status newton_step(const struct law_run *l, struct stepper *s, struct bf_error *err)
{
    size_t D = l->D;
    double A[MOST_COORDINATES * MOST_COORDINATES], b[MOST_COORDINATES];
    step_matrix(l, s, A);
    for (size_t c = 0; c < D; c++)
        b[c] = s->law[c] - s->f[c];
    enum bf_status status = dense_solve(D, 1, A, b, err);
    for (size_t c = 0; c < D; c++)
        s->f[c] += b[c];
    return status;
}

/*
 * One coordinate: g(f) = f − law(f) grows with f for every law that opposes motion (S_w, S_v ≤ 0), so its sign brackets
 * the root; Newton inside the bracket, bisection where Newton leaves it or creeps (stiff friction, contact).
 */
static enum bf_status solve_scalar(struct law_run *l, struct stepper *s, size_t step, struct bf_error *err)
{
    double low = -INFINITY, high = INFINITY, previous = INFINITY;
    for (int i = 0; i < NEWTON_STEPS; i++) {
        if (evaluate_laws(l, s, step, true, SIZE_MAX) != 0)
            return bf_fail(err, BF_NUMERIC, "a nonlinear effect is outside its physical range");
        double g = s->f[0] - s->law[0], size = residual_size(l, s);
        if (!isfinite(size))
            return bf_fail(err, BF_NUMERIC, "the motion grows without bound in a nonlinear effect");
        if (size <= step_tolerance * s->scale || !(high - low > step_tolerance * s->scale))
            return BF_OK;
        if (g > 0.0)
            high = fmin(high, s->f[0]);
        else
            low = fmax(low, s->f[0]);
        double slope = 1.0 - s->T_w[0] * l->S_w[0] - s->T_v[0] * l->S_v[0], next = s->f[0] - g / slope;
        bool creeps = i > 1 && size > 0.5 * previous;
        if ((creeps || !(next > low && next < high)) && isfinite(low) && isfinite(high))
            next = 0.5 * (low + high);
        previous = size;
        s->f[0] = next;
    }
    l->failed_steps++;
    return BF_OK;
}

/* f = law(f): fixed-point steps while the law is weak, then Newton. */
static enum bf_status solve_step(struct law_run *l, struct stepper *s, size_t step, struct bf_error *err)
{
    if (l->D == 1)
        return solve_scalar(l, s, step, err);
    double previous = INFINITY;
    bool newton = l->D == 2;
    for (int i = 0; i < PICARD_STEPS + NEWTON_STEPS; i++) {
        if (evaluate_laws(l, s, step, newton, SIZE_MAX) != 0)
            return bf_fail(err, BF_NUMERIC, "a nonlinear effect is outside its physical range");
        double size = residual_size(l, s);
        if (!isfinite(size))
            return bf_fail(err, BF_NUMERIC, "the motion grows without bound in a nonlinear effect");
        if (size <= step_tolerance * s->scale)
            return BF_OK;
        if (newton) {
            enum bf_status status = newton_step(l, s, err);
            if (status != BF_OK)
                return status;
            continue;
        }
        memcpy(s->f, s->law, l->D * sizeof(double));
        if (size < 0.1 * previous && size <= last_picard * s->scale)
            return BF_OK; /* the step just taken shrinks what is left by another factor of ten or more */
        newton = size > 0.1 * previous || i >= PICARD_STEPS;
        previous = size;
    }
    l->failed_steps++;
    return BF_OK;
}

/* Everything of the next instant that does not depend on its forces. */
static void free_motion(const struct law_run *l, struct stepper *s, size_t step)
{
    size_t D = l->D, P = l->n_dynamic;
    for (size_t c = 0; c < D; c++) {
        s->w_free[c] = l->w_lin[c * l->N + step];
        s->v_free[c] = l->v_lin[c * l->N + step];
    }
    for (size_t k = 0; k < P; k++) {
        double complex force = 0.0;
        for (size_t c = 0; c < D; c++)
            force += l->alpha[c * P + k] * s->f[c];
        s->free_q[k] = l->step[k].e * s->q[k] - l->step[k].g0 * force;
        double complex p = l->run->p->system->p[l->pole[k]];
        for (size_t c = 0; c < D; c++) {
            double complex a = l->multiplicity[k] * l->alpha[c * P + k] * s->free_q[k];
            s->w_free[c] += creal(a);
            s->v_free[c] += creal(p * a);
        }
    }
}

/* The forces of the step begin at the straight line through the last two. */
static void extrapolate(const struct law_run *l, struct stepper *s)
{
    for (size_t c = 0; c < l->D; c++) {
        double old = s->f[c];
        s->f[c] = 2.0 * old - s->f_old[c];
        s->f_old[c] = old;
    }
}

static void accept_step(struct law_run *l, struct stepper *s, size_t step)
{
    size_t D = l->D, P = l->n_dynamic;
    for (size_t k = 0; k < P; k++) {
        double complex force = 0.0;
        for (size_t c = 0; c < D; c++)
            force += l->alpha[c * P + k] * s->f[c];
        s->q[k] = s->free_q[k] - l->step[k].g1 * force;
    }
    memcpy(l->f + step * D, s->f, D * sizeof(double));
    memcpy(s->w_old, s->w, D * sizeof(double));
    memcpy(s->z, s->z_next, l->run->p->model.n_effects * BEAM_LAW_STATES * sizeof(double));
    if (l->q != NULL)
        memcpy(l->q + step * P, s->q, P * sizeof *s->q);
}

/* Tangents at the accepted state, for the derivatives. */
static enum bf_status store_tangents(struct law_run *l, struct stepper *s, size_t step, struct bf_error *err)
{
    size_t D = l->D;
    double A[MOST_COORDINATES * MOST_COORDINATES];
    if (evaluate_laws(l, s, step, true, step) != 0)
        return bf_fail(err, BF_NUMERIC, "a nonlinear effect is outside its physical range");
    memcpy(l->T_w + step * D * D, s->T_w, D * D * sizeof(double));
    memcpy(l->T_v + step * D * D, s->T_v, D * D * sizeof(double));
    step_matrix(l, s, A);
    double *inverse = l->inverse + step * D * D;
    for (size_t i = 0; i < D; i++)
        for (size_t j = 0; j < D; j++)
            inverse[i + j * D] = i == j ? 1.0 : 0.0;
    if (D == 1) {
        inverse[0] = 1.0 / A[0];
        return BF_OK;
    }
    return dense_solve(D, D, A, inverse, err);
}

enum bf_status law_run_march(struct law_run *l, struct bf_error *err)
{
    size_t states = l->run->p->model.n_effects * BEAM_LAW_STATES;
    struct stepper s = {.scale = 0.0};
    s.q = bf_alloc(2 * l->n_dynamic, sizeof *s.q);
    s.free_q = s.q + l->n_dynamic;
    s.z = bf_alloc(2 * states, sizeof *s.z);
    s.z_next = s.z + states;
    enum bf_status status = BF_OK;
    for (size_t step = 0; status == BF_OK && step < l->N; step++) {
        free_motion(l, &s, step);
        extrapolate(l, &s);
        status = solve_step(l, &s, step, err);
        if (status == BF_OK && l->run->want != NULL)
            status = store_tangents(l, &s, step, err);
        accept_step(l, &s, step);
    }
    if (status == BF_OK && (double)l->failed_steps > 1.0 + most_failed * (double)l->N)
        status =
            bf_fail(err, BF_NUMERIC, "%zu of %zu steps of a nonlinear effect did not converge", l->failed_steps, l->N);
    free(s.q);
    free(s.z);
    return status;
}
