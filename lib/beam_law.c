/* SPDX-License-Identifier: MIT */
/* The few implicit equations of the laws in one step. */
#include "beam_plan.h"

/* Error of a solved force (Newton's next correction), relative to the largest force or to the coordinates it moves; and N of no account. */
#ifdef BEAM_FLOAT
#define TOLERANCE BEAM_K(2e-6)
#define NOTHING   BEAM_K(1e-30)
#else
#define TOLERANCE BEAM_K(1e-9)
#define NOTHING   BEAM_K(1e-290)
#endif

/* Residual and new internal states at forces g. The Jacobian there is kept beside it: only the last one is needed. */
struct evaluation {
    beam_real residual[BEAM_PORTS];
    beam_real w[BEAM_PORTS], z[BEAM_PORTS][BEAM_LAW_STATES];
    beam_real size; /* of the largest residual */
};

static beam_real coordinate(const struct beam_law_system *system, const beam_real free[], const beam_real force[],
                            int row)
{
    beam_real value = free[row];
    for (int q = 0; q < system->n_ports; q++)
        value -= system->compliance[row][q] * force[q];
    return value;
}

/* One law point: ports p .. p + width − 1. r = g − weight f, ∂r/∂g = 1 + weight (f_w S_w + f_v S_v). */
static enum beam_status evaluate_point(const struct beam_law_system *system, const beam_real free[],
                                       const beam_real force[], const beam_real w_old[],
                                       beam_real z_old[BEAM_PORTS][BEAM_LAW_STATES], int p, int width,
                                       struct evaluation *e, beam_real jacobian[BEAM_PORTS][BEAM_PORTS])
{
    const struct beam_use *use = &system->use[system->port_use[p]];
    struct beam_law_input in = {.t_s = system->t_s, .dt_s = system->dt_s};
    struct beam_law_output out = {.f = {BEAM_K(0.0)}};
    for (int i = 0; i < width; i++) {
        in.w[i] = e->w[p + i] = coordinate(system, free, force, 2 * (p + i));
        in.v[i] = coordinate(system, free, force, 2 * (p + i) + 1);
        in.w_old[i] = w_old[p + i];
    }
    for (int s = 0; s < BEAM_LAW_STATES; s++)
        in.z[s] = z_old[p][s];
    if (use->effect->law(use->p, &in, &out) != 0)
        return BEAM_ERROR_EFFECT_RANGE;
    for (int s = 0; s < BEAM_LAW_STATES; s++)
        e->z[p][s] = out.z[s];
    for (int i = 0; i < width; i++) {
        const beam_real weight = system->weight[p + i];
        e->residual[p + i] = force[p + i] - weight * out.f[i];
        for (int q = 0; q < system->n_ports; q++) {
            beam_real sum = p + i == q ? BEAM_K(1.0) : BEAM_K(0.0);
            for (int c = 0; c < width; c++)
                sum += weight * (out.f_w[i][c] * system->compliance[2 * (p + c)][q] +
                                 out.f_v[i][c] * system->compliance[2 * (p + c) + 1][q]);
            jacobian[p + i][q] = sum;
        }
    }
    return BEAM_OK;
}

static enum beam_status evaluate(const struct beam_law_system *system, const beam_real free[], const beam_real force[],
                                 const beam_real w_old[], beam_real z_old[BEAM_PORTS][BEAM_LAW_STATES],
                                 struct evaluation *e, beam_real jacobian[BEAM_PORTS][BEAM_PORTS])
{
    for (int p = 0; p < system->n_ports;) {
        int width = 1;
        while (width < BEAM_LAW_WIDTH && p + width < system->n_ports && system->port_coordinate[p + width] > 0)
            width++;
        const enum beam_status status = evaluate_point(system, free, force, w_old, z_old, p, width, e, jacobian);
        if (status != BEAM_OK)
            return status;
        p += width;
    }
    e->size = BEAM_K(0.0);
    for (int p = 0; p < system->n_ports; p++)
        if (beam_less(e->size, beam_fabs(e->residual[p])))
            e->size = beam_fabs(e->residual[p]);
    return BEAM_OK;
}

/* Correction small against the largest force, or, through the compliance, against every coordinate. */
static int converged(const struct beam_law_system *system, const beam_real free[], const beam_real force[],
                     const beam_real correction[])
{
    beam_real largest_force = BEAM_K(0.0), largest = BEAM_K(0.0);
    for (int p = 0; p < system->n_ports; p++) {
        if (beam_less(largest_force, beam_fabs(force[p])))
            largest_force = beam_fabs(force[p]);
        if (beam_less(largest, beam_fabs(correction[p])))
            largest = beam_fabs(correction[p]);
    }
    if (!beam_less(TOLERANCE * largest_force + NOTHING, largest))
        return 1;
    for (int row = 0; row < 2 * system->n_ports; row++) {
        beam_real error = BEAM_K(0.0), size = beam_fabs(free[row]);
        for (int q = 0; q < system->n_ports; q++) {
            error += beam_fabs(system->compliance[row][q] * correction[q]);
            size += beam_fabs(system->compliance[row][q] * force[q]);
        }
        if (beam_less(BEAM_K(16.0) * BEAM_EPSILON * size, error))
            return 0;
    }
    return 1;
}

/* What a search needs besides the system itself. */
struct search {
    const struct beam_law_system *system;
    const beam_real *free, *w_old;
    beam_real (*z)[BEAM_LAW_STATES];
    struct evaluation room[2];
    struct evaluation *best, *trial;
    beam_real jacobian[BEAM_PORTS][BEAM_PORTS]; /* of the last evaluation */
};

/* Residual at `tried`; when it is smaller than the best, it becomes the best and 1 is returned. */
static enum beam_status try_forces(struct search *s, const beam_real tried[BEAM_PORTS], beam_real force[BEAM_PORTS],
                                   int *better)
{
    const enum beam_status status = evaluate(s->system, s->free, tried, s->w_old, s->z, s->trial, s->jacobian);
    *better = status == BEAM_OK && beam_less(s->trial->size, s->best->size);
    if (*better) {
        struct evaluation *swap = s->best;
        s->best = s->trial;
        s->trial = swap;
        for (int p = 0; p < s->system->n_ports; p++)
            force[p] = tried[p];
    }
    return status;
}

/*
 * One port: r(g) rises with g for a passive law, so its sign brackets the root. Newton first; where that jumps between
 * two branches (friction), the force that brings the point to rest; then halves of the bracket.
 */
static enum beam_status solve_one(struct search *s, beam_real force[BEAM_PORTS], int *done)
{
    const beam_real zero = BEAM_K(0.0), rest = s->system->compliance[1][0];
    beam_real low = zero, high = zero, tried[BEAM_PORTS] = {force[0]};
    const struct evaluation *last = s->best;
    int has_low = 0, has_high = 0, better = 1, rested = 0;
    enum beam_status status = BEAM_OK;
    for (int count = 1; status == BEAM_OK; count++) {
        const beam_real at = tried[0], residual = last->residual[0], slope = s->jacobian[0][0];
        const beam_real move = beam_less(zero, slope) ? -residual / slope : -residual;
        *done = better && converged(s->system, s->free, force, &move);
        if (*done)
            force[0] += move; /* known, so taken */
        if (*done || count >= s->system->evaluations)
            break;
        if (beam_less(residual, zero)) {
            low = has_low && beam_less(at, low) ? low : at;
            has_low = 1;
        } else {
            high = has_high && beam_less(high, at) ? high : at;
            has_high = 1;
        }
        tried[0] = at + move;
        if (!better && !rested && beam_less(zero, rest)) {
            tried[0] = s->free[1] / rest;
            rested = 1;
        }
        if (has_low && has_high && (!beam_less(low, tried[0]) || !beam_less(tried[0], high)))
            tried[0] = low + BEAM_K(0.5) * (high - low);
        status = try_forces(s, tried, force, &better);
        last = better ? s->best : s->trial;
    }
    return status;
}

/* Several ports: Newton; a step that makes the residual larger is halved. */
static enum beam_status solve_many(struct search *s, beam_real force[BEAM_PORTS], int *done)
{
    beam_real move[BEAM_PORTS] = {BEAM_K(0.0)}, tried[BEAM_PORTS];
    const int n = s->system->n_ports;
    enum beam_status status = BEAM_OK;
    int better = 1;
    for (int count = 1; status == BEAM_OK; count++) {
        for (int p = 0; p < n; p++)
            move[p] = better ? -s->best->residual[p] : BEAM_K(0.5) * move[p];
        if (better && beam_real_solve(n, s->jacobian, move) != 0)
            break;
        *done = converged(s->system, s->free, force, move);
        for (int p = 0; p < n; p++)
            tried[p] = force[p] + move[p];
        for (int p = 0; p < n && *done && better; p++)
            force[p] = tried[p]; /* known, so taken */
        if (*done || count >= s->system->evaluations)
            break;
        status = try_forces(s, tried, force, &better);
    }
    return status;
}

enum beam_status beam_laws_solve(const struct beam_law_system *system, const beam_real free[2 * BEAM_PORTS],
                                 beam_real force[BEAM_PORTS], beam_real w_old[BEAM_PORTS],
                                 beam_real z[BEAM_PORTS][BEAM_LAW_STATES])
{
    struct search s;
    s.system = system;
    s.free = free;
    s.w_old = w_old;
    s.z = z;
    s.best = &s.room[0];
    s.trial = &s.room[1];
    enum beam_status status = evaluate(system, free, force, w_old, z, s.best, s.jacobian);
    int done = 0;
    if (status == BEAM_OK)
        status = system->n_ports == 1 ? solve_one(&s, force, &done) : solve_many(&s, force, &done);
    if (status != BEAM_OK)
        return status;
    for (int p = 0; p < system->n_ports; p++) {
        w_old[p] = s.best->w[p];
        for (int i = 0; i < BEAM_LAW_STATES; i++)
            z[p][i] = s.best->z[p][i];
    }
    return done ? BEAM_OK : BEAM_ERROR_SOLVE;
}
