/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_run.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "dense.h"
#include "spectrum.h"

/* A pole with |p| h above this follows the force without dynamics of its own. */
static const double far_step = 1.5;
/* The step's equation is solved to this part of the largest force so far. */
static const double step_tolerance = 1e-11;
enum { MOST_WORKERS = 16, PICARD_STEPS = 8, NEWTON_STEPS = 40, OVERSAMPLE_POINT = 8, OVERSAMPLE_SPAN = 4 };
/* More unsolved steps than this part of a record are an error. */
static const double most_failed = 1e-3;

/* ---- The laws of a model on the current base ---- */

enum bf_status laws_new(struct predictor *p, struct bf_error *err)
{
    double dt = INFINITY;
    for (size_t r = 0; r < p->n_records; r++)
        dt = fmin(dt, p->records[r].dt_s);
    p->laws = bf_alloc(p->model.n_effects, sizeof *p->laws);
    p->n_coordinates = 0;
    p->nonlinear = false;
    p->moves = bf_alloc(p->map.n, sizeof *p->moves);
    enum bf_status status = BF_OK;
    for (size_t e = 0; status == BF_OK && e < p->model.n_effects; e++) {
        status = law_new(&p->model, &p->reduced, &p->map, e, acos(-1.0) / dt, &p->laws[e], err);
        p->n_coordinates += p->laws[e].d;
        p->nonlinear = p->nonlinear || p->laws[e].d > 0;
        if (p->laws[e].at_parameter != SIZE_MAX)
            p->moves[p->laws[e].at_parameter] = true;
        if (p->laws[e].width_parameter != SIZE_MAX)
            p->moves[p->laws[e].width_parameter] = true;
    }
    if (status == BF_OK && p->n_coordinates > MOST_COORDINATES)
        status = bf_fail(err, BF_NUMERIC, "the nonlinear effects need %zu coordinates, %d are possible; drop one",
                         p->n_coordinates, MOST_COORDINATES);
    if (status != BF_OK)
        return status;
    p->coordinates = bf_alloc(p->n_coordinates, sizeof *p->coordinates);
    size_t c = 0, n = p->reduced.n;
    for (size_t e = 0; e < p->model.n_effects; e++) {
        for (size_t j = 0; j < p->laws[e].d; j++, c++) {
            p->coordinates[c].g = bf_alloc(n, sizeof(double));
            memcpy(p->coordinates[c].g, p->laws[e].g + j * n, n * sizeof(double));
        }
    }
    return BF_OK;
}

void laws_free(struct predictor *p)
{
    for (size_t e = 0; p->laws != NULL && e < p->model.n_effects; e++)
        law_free(&p->laws[e]);
    free(p->laws);
    p->laws = NULL;
    free(p->moves);
    p->moves = NULL;
}

size_t law_first_coordinate(const struct predictor *p, size_t effect)
{
    size_t first = 0;
    for (size_t e = 0; e < effect; e++)
        first += p->laws[e].d;
    return first;
}

size_t law_first_dependency(const struct predictor *p, size_t effect)
{
    size_t first = 0;
    for (size_t e = 0; e < effect; e++)
        first += p->laws[e].n_dependencies;
    return first;
}

/* A point law whose place is a parameter: its functional follows the parameter. */
static void add_move(const struct run *run, struct functional *f, size_t parameter, const double g_move[])
{
    if (parameter == SIZE_MAX || !run_wants(run, parameter))
        return;
    size_t n_poles = run->p->system->n_poles;
    double complex *moved = bf_alloc(n_poles, sizeof *moved);
    system_functional(run->p->system, g_move, moved);
    for (size_t k = 0; k < n_poles; k++)
        f->d_alpha[parameter * n_poles + k] += moved[k];
    free(moved);
}

static enum bf_status evaluate_coordinates(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    for (size_t e = 0; e < p->model.n_effects; e++) {
        struct law *law = &p->laws[e];
        struct functional *first = p->coordinates + law_first_coordinate(p, e);
        double parameters[BEAM_EFFECT_PARAMETERS];
        if (law->d == 0)
            continue;
        parameter_map_effect(&p->map, 0, e, run->theta, parameters);
        enum bf_status status = law_move(law, &p->model, &p->reduced, parameters, err);
        if (status != BF_OK)
            return status;
        memcpy(first->g, law->g, p->reduced.n * sizeof(double)); /* a law over the span never moves: the same again */
        functionals_evaluate(run, first, law->d);
        add_move(run, first, law->at_parameter, law->g_at);
        add_move(run, first, law->width_parameter, law->g_width);
    }
    return BF_OK;
}

/* ---- Setting up one record ---- */

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
                l->far[a * l->D + b] +=
                    multiplicity * creal(l->run->p->coordinates[a].alpha[k] * l->run->p->coordinates[b].alpha[k] / s->p[k]);
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
    enum bf_status status = law_upsample(l, W, l->w_lin + c * l->N, err);
    for (size_t k = 0; k < m; k++)
        W[k] *= l->grid->s[k];
    if (status == BF_OK)
        status = law_upsample(l, W, l->v_lin + c * l->N, err);
    free(H);
    return status;
}

static bool has_states(const struct predictor *p)
{
    for (size_t e = 0; e < p->model.n_effects; e++)
        if (p->laws[e].d > 0 && p->laws[e].effect->n_law_states > 0)
            return true;
    return false;
}

static enum bf_status law_run_new(struct law_run *l, struct bf_error *err)
{
    struct predictor *p = l->run->p;
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

static void law_run_free(struct law_run *l)
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

/* ---- One step ---- */

struct stepper {
    double complex *q, *free_q; /* [n_dynamic] */
    double w[MOST_COORDINATES], v[MOST_COORDINATES], w_old[MOST_COORDINATES];
    double w_free[MOST_COORDINATES], v_free[MOST_COORDINATES];
    double f[MOST_COORDINATES], f_old[MOST_COORDINATES], law[MOST_COORDINATES], scale;
    double *z, *z_next;         /* [n_effects][BEAM_LAW_STATES] */
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
        struct law_motion motion = {.w = s->w + first, .v = s->v + first, .w_old = s->w_old + first,
                                    .z = s->z + e * BEAM_LAW_STATES, .t_s = (double)step * l->h_s, .dt_s = l->h_s};
        struct law_force local, *force = store != SIZE_MAX && l->state != NULL ? &l->state[store * p->model.n_effects + e]
                                                                                : &local;
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
 * the root; Newton inside the bracket, bisection where Newton leaves it (stiff friction, contact).
 */
static enum bf_status solve_scalar(struct law_run *l, struct stepper *s, size_t step, struct bf_error *err)
{
    double low = -INFINITY, high = INFINITY;
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
        if (!(next > low && next < high) && isfinite(low) && isfinite(high))
            next = 0.5 * (low + high);
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

static enum bf_status march(struct law_run *l, struct bf_error *err)
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
    if (status == BF_OK && (double)l->failed_steps > most_failed * (double)l->N)
        status = bf_fail(err, BF_NUMERIC, "%zu of %zu steps of a nonlinear effect did not converge", l->failed_steps, l->N);
    free(s.q);
    free(s.z);
    return status;
}

/* ---- Outputs ---- */

enum bf_status law_add_output(const struct law_run *l, const struct predict_channel *channel, double scale,
                              const double complex filter[], const double complex Y[], double row[],
                              struct bf_error *err)
{
    size_t m = l->grid->m;
    double complex *Z = bf_alloc(m, sizeof *Z);
    double *y = bf_alloc(channel->n, sizeof *y);
    for (size_t k = 0; k < m; k++)
        Z[k] = scale * (filter[k] * Y[k]);
    enum bf_status status = response_back(l->grid, Z, y, err);
    for (size_t k = 0; k < channel->n; k++)
        row[k] += y[k];
    free(Z);
    free(y);
    return status;
}

/* y_o −= Ks F_o Σ_c H_oc f_c; and what depends on Ks and the filters alone. */
static enum bf_status add_channel(const struct law_run *l, const struct predict_channel *channel,
                                  const double complex F[], struct bf_error *err)
{
    const struct predictor *p = l->run->p;
    size_t m = l->grid->m, gain_parameter;
    double gain = output_gain(l->run, channel->output, &gain_parameter);
    double complex *filter = bf_alloc(4 * m, sizeof *filter), *Y = filter + m, *H = Y + m, *dF = H + m;
    bool filtered;
    for (size_t c = 0; c < l->D; c++) {
        response_value(p->kernels[l->plan->grid], output_order(p->model.outputs[channel->output].kind),
                       p->outputs[channel->output].alpha, p->coordinates[c].alpha, H);
        for (size_t k = 0; k < m; k++)
            Y[k] -= H[k] * F[c * m + k];
    }
    enum bf_status status = channel_filter(l->run, l->record, channel->output, l->grid->s, m, filter, &filtered, err);
    if (status == BF_OK)
        status = law_add_output(l, channel, gain, filter, Y, l->run->out->y + channel->row, err);
    for (size_t j = 0; status == BF_OK && l->run->want != NULL && j < p->map.n; j++) {
        if (!run_wants(l->run, j))
            continue;
        if (j == gain_parameter)
            status = law_add_output(l, channel, 1.0, filter, Y, run_column(l->run, j, channel), err);
        else if (channel_filter_derivative(l->run, l->record, channel->output, j, l->grid->s, m, dF))
            status = law_add_output(l, channel, gain, dF, Y, run_column(l->run, j, channel), err);
    }
    free(filter);
    return status;
}

static enum bf_status add_outputs(const struct law_run *l, struct bf_error *err)
{
    const struct predictor *p = l->run->p;
    size_t m = l->grid->m;
    double complex *F = bf_alloc(l->D * m, sizeof *F);
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < l->D; c++)
        status = law_transform(l, l->f + c, l->D, F + c * m, err);
    for (size_t i = 0; status == BF_OK && i < l->plan->n_channels; i++)
        status = add_channel(l, &p->channels[l->plan->first_channel + i], F, err);
    if (status == BF_OK && l->run->want != NULL)
        status = law_derivatives(l, F, err);
    free(F);
    return status;
}

/* Records are independent: each worker takes the next one. */
struct law_queue {
    const struct run *run;
    atomic_size_t next; /* index of the next record */
};

struct law_worker {
    struct law_queue *queue;
    enum bf_status status;
    struct bf_error err;
};

static enum bf_status predict_record(const struct run *run, size_t record, struct bf_error *err)
{
    const struct predictor *p = run->p;
    if (p->plans[record].free_decay)
        return bf_fail_at(err, p->records[record].path, 0,
                          "a free decay cannot be predicted with a nonlinear effect; drop the effect or record the force");
    struct law_run l = {.run = run, .record = record, .plan = &p->plans[record],
                        .grid = &p->grids[p->plans[record].grid]};
    enum bf_status status = law_run_new(&l, err);
    if (status == BF_OK)
        status = march(&l, err);
    if (status == BF_OK)
        status = add_outputs(&l, err);
    law_run_free(&l);
    return status;
}

static void *work(void *argument)
{
    struct law_worker *worker = argument;
    size_t record;
    while (worker->status == BF_OK &&
           (record = atomic_fetch_add(&worker->queue->next, 1)) < worker->queue->run->p->n_records)
        worker->status = predict_record(worker->queue->run, record, &worker->err);
    return NULL;
}

static size_t worker_count(const struct predictor *p)
{
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    size_t most = p->options.threads > 0 ? (size_t)p->options.threads : cores > 0 ? (size_t)cores : 1;
    most = most < MOST_WORKERS ? most : MOST_WORKERS;
    return most < p->n_records ? most : p->n_records;
}

enum bf_status predict_laws(const struct run *run, struct bf_error *err)
{
    enum bf_status status = evaluate_coordinates(run, err);
    if (status != BF_OK)
        return status;
    struct law_queue queue = {.run = run};
    struct law_worker workers[MOST_WORKERS];
    pthread_t threads[MOST_WORKERS];
    size_t n = worker_count(run->p), started = 0;
    for (size_t i = 0; i < n; i++)
        workers[i] = (struct law_worker){.queue = &queue, .status = BF_OK};
    while (started + 1 < n && pthread_create(&threads[started], NULL, work, &workers[started + 1]) == 0)
        started++;
    (void)work(&workers[0]);
    for (size_t i = 0; i < started; i++)
        (void)pthread_join(threads[i], NULL);
    for (size_t i = 0; i <= started && status == BF_OK; i++) {
        status = workers[i].status;
        if (status != BF_OK)
            *err = workers[i].err;
    }
    return status;
}
