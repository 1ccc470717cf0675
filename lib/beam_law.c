/* SPDX-License-Identifier: MIT */
/* The few implicit equations of the laws in one step. */
#include "beam_plan.h"

/* Residual of a solved law, relative to the largest force or to the coordinates it moves. */
#ifdef BEAM_FLOAT
#define TOLERANCE BEAM_K(2e-6)
#else
#define TOLERANCE BEAM_K(1e-11)
#endif

/* Residual, Jacobian and new internal states at forces g. */
struct evaluation {
    beam_real residual[BEAM_PORTS];
    beam_real jacobian[BEAM_PORTS][BEAM_PORTS];
    beam_real w[BEAM_PORTS], z[BEAM_PORTS][BEAM_LAW_STATES];
    beam_real size; /* Σ residual² */
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
                                       struct evaluation *e)
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
            e->jacobian[p + i][q] = sum;
        }
    }
    return BEAM_OK;
}

static enum beam_status evaluate(const struct beam_law_system *system, const beam_real free[], const beam_real force[],
                                 const beam_real w_old[], beam_real z_old[BEAM_PORTS][BEAM_LAW_STATES],
                                 struct evaluation *e)
{
    for (int p = 0; p < system->n_ports;) {
        int width = 1;
        while (width < BEAM_LAW_WIDTH && p + width < system->n_ports && system->port_coordinate[p + width] > 0)
            width++;
        const enum beam_status status = evaluate_point(system, free, force, w_old, z_old, p, width, e);
        if (status != BEAM_OK)
            return status;
        p += width;
    }
    e->size = BEAM_K(0.0);
    for (int p = 0; p < system->n_ports; p++)
        e->size += e->residual[p] * e->residual[p];
    return BEAM_OK;
}

/* Residual below rounding: of the largest force, or, through the compliance, of every coordinate. */
static int converged(const struct beam_law_system *system, const beam_real free[], const beam_real force[],
                     const beam_real residual[])
{
    beam_real largest_force = BEAM_K(0.0), largest_residual = BEAM_K(0.0);
    for (int p = 0; p < system->n_ports; p++) {
        if (beam_less(largest_force, beam_fabs(force[p])))
            largest_force = beam_fabs(force[p]);
        if (beam_less(largest_residual, beam_fabs(residual[p])))
            largest_residual = beam_fabs(residual[p]);
    }
    if (!beam_less(TOLERANCE * largest_force, largest_residual))
        return 1;
    for (int row = 0; row < 2 * system->n_ports; row++) {
        beam_real error = BEAM_K(0.0), size = beam_fabs(free[row]);
        for (int q = 0; q < system->n_ports; q++) {
            error += beam_fabs(system->compliance[row][q] * residual[q]);
            size += beam_fabs(system->compliance[row][q] * force[q]);
        }
        if (beam_less(TOLERANCE * size, error))
            return 0;
    }
    return 1;
}

enum beam_status beam_laws_solve(const struct beam_law_system *system, const beam_real free[2 * BEAM_PORTS],
                                 beam_real force[BEAM_PORTS], beam_real w_old[BEAM_PORTS],
                                 beam_real z[BEAM_PORTS][BEAM_LAW_STATES])
{
    struct evaluation room[2], *best = &room[0], *trial = &room[1];
    beam_real move[BEAM_PORTS] = {BEAM_K(0.0)}, tried[BEAM_PORTS];
    const int n = system->n_ports;
    enum beam_status status = evaluate(system, free, force, w_old, z, best);
    int done = status == BEAM_OK && converged(system, free, force, best->residual), fresh = 1;
    for (int count = 1; count < system->evaluations && status == BEAM_OK && !done; count++) {
        for (int p = 0; p < n; p++)
            move[p] = fresh ? -best->residual[p] : BEAM_K(0.5) * move[p];
        if (fresh && beam_real_solve(n, best->jacobian, move) != 0)
            break;
        for (int p = 0; p < n; p++)
            tried[p] = force[p] + move[p];
        status = evaluate(system, free, tried, w_old, z, trial);
        fresh = status == BEAM_OK && beam_less(trial->size, best->size);
        if (!fresh) {
            done = status == BEAM_OK && converged(system, free, force, move); /* no better point exists */
            continue;
        }
        struct evaluation *swap = best;
        best = trial;
        trial = swap;
        for (int p = 0; p < n; p++)
            force[p] = tried[p];
        done = converged(system, free, force, best->residual);
    }
    if (status != BEAM_OK)
        return status;
    for (int p = 0; p < n; p++) {
        w_old[p] = best->w[p];
        for (int s = 0; s < BEAM_LAW_STATES; s++)
            z[p][s] = best->z[p][s];
    }
    return done ? BEAM_OK : BEAM_ERROR_SOLVE;
}
