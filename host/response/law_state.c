/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The free motion of a record's initial state at the contact coordinates. */
#include "law_run.h"

#include <math.h>

/* Re((a + b t) e^(pt)) of one pole. Before the record the motion neither grows nor decays: that keeps fast modes bounded there. */
struct free_motion {
    double complex p, a, b;
};

static double complex power(double complex p, int order)
{
    double complex x = 1.0;
    for (int i = 0; i < order; i++)
        x *= p;
    return x;
}

/* Products of e^(ph), begun anew often enough to stay exact. */
static void add_motion(const struct law_run *l, const struct free_motion *m, const struct free_motion *before,
                       double out[])
{
    enum { ANEW = 64 };
    double complex z = 0.0, step = 0.0;
    for (size_t k = 0; k < l->N; k++) {
        const struct free_motion *now = k < l->lead ? before : m;
        double t = ((double)k - (double)l->lead) * l->h_s;
        if (k % ANEW == 0 || k == l->lead) {
            z = cexp(now->p * t);
            step = cexp(now->p * l->h_s);
        }
        out[k] += creal((now->a + now->b * t) * z);
        z *= step;
    }
}

/* dp: the pole moves; b belongs to it. */
static void add(const struct law_run *l, double complex p, double complex a, double complex by_dp, double complex dp,
                double out[])
{
    const struct free_motion m = {.p = p, .a = a, .b = by_dp * dp};
    const struct free_motion before = {.p = CMPLX(0.0, cimag(p)), .a = a, .b = by_dp * CMPLX(0.0, cimag(dp))};
    add_motion(l, &m, &before, out);
}

void law_state_add(const struct law_run *l, size_t c, int order, double out[])
{
    const struct modal_system *s = l->system;
    for (size_t i = 0; i < s->n_states; i++) {
        const struct modal_state *state = &s->states[i];
        double complex p = s->system->p[state->pole], alpha = s->coordinates[c].alpha[state->pole];
        add(l, p, 2.0 * state->amplitude * state->to_beam * alpha * power(p, order), 0.0, 0.0, out);
    }
}

bool law_state_derivative_add(const struct law_run *l, size_t c, int order, size_t parameter, double out[])
{
    const struct modal_system *s = l->system;
    if (s->n_states == 0 || !s->parameters[parameter].structural)
        return false;
    for (size_t i = 0; i < s->n_states; i++) {
        const struct modal_state *state = &s->states[i];
        size_t k = state->pole;
        double complex p = s->system->p[k], alpha = s->coordinates[c].alpha[k], twice = 2.0 * state->amplitude;
        double complex d_alpha = s->coordinates[c].d_alpha[parameter * s->system->n_poles + k];
        double complex dp = s->system->derivative[parameter].p != NULL ? s->system->derivative[parameter].p[k] : 0.0;
        double complex d_b = state->d_to_beam != NULL ? state->d_to_beam[parameter] : 0.0;
        double complex change = d_alpha * power(p, order) * state->to_beam + alpha * power(p, order) * d_b;
        if (order > 0)
            change += alpha * state->to_beam * (double)order * power(p, order - 1) * dp;
        add(l, p, twice * change, twice * state->to_beam * alpha * power(p, order), dp, out);
    }
    return true;
}

void law_state_column_add(const struct law_run *l, size_t c, int order, size_t unknown, double out[])
{
    const struct modal_system *s = l->system;
    const struct modal_state *state = &s->states[unknown / 2];
    double complex p = s->system->p[state->pole], unit = unknown % 2 == 0 ? CMPLX(1.0, 0.0) : CMPLX(0.0, 1.0);
    add(l, p, 2.0 * unit * state->to_beam * s->coordinates[c].alpha[state->pole] * power(p, order), 0.0, 0.0, out);
}
