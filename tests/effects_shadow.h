/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * effects_shadow.h — every slot of every effect as one plain function of doubles, in three arithmetics.
 *
 * effects_shadow.c is compiled three times, as double, BEAM_FLOAT and BEAM_COMPLEX, and gives one function each, so
 * that a test can hold them against each other without seeing their types.
 */
#ifndef EFFECTS_SHADOW_H
#define EFFECTS_SHADOW_H

enum shadow_slot {
    SHADOW_TERMS,         /* x = p                              y = (m, d, k, E, τ, at) of each term */
    SHADOW_LAW_PLACE,     /* x = p                              y = at, width */
    SHADOW_LAW,           /* x = p, w[2], v[2], w_old[2], z[2]  y = f[2], z[2] */
    SHADOW_FILTER,        /* x = p                              y = b1, b0, a1, a0, delay */
    SHADOW_MAP,           /* x = p, v, u                        y */
    SHADOW_SIGNAL,        /* x = p, v                           y */
    SHADOW_DRIVE,         /* x = p, u, u_old, z                 y = u, z */
    SHADOW_BASE,          /* x = p                              y = a_b */
    SHADOW_GEOMETRY,      /* x = p                              y = patch shift, input shift, clock */
    SHADOW_AXIAL_INERTIA, /* x = p                              y = κ */
    SHADOW_SLOTS
};

enum { SHADOW_IN = 12, SHADOW_OUT = 12, SHADOW_P = 4 }; /* p takes the first SHADOW_P entries of x always */

struct shadow_case {
    int effect; /* index into beam_effects */
    enum shadow_slot slot;
    double x[SHADOW_IN];
    double length_m, t_s, dt_s;
    int direction; /* which x carries an imaginary part (complex only); −1 none */
    double step;   /* its size */
};

struct shadow_answer {
    int status; /* the slot's return value; 1 when the effect has no such slot */
    int n_in, n_out;
    double y[SHADOW_OUT];
    double y_imaginary[SHADOW_OUT];      /* 0 in real arithmetic */
    double slope[SHADOW_OUT][SHADOW_IN]; /* d y/d x as the effect states it */
};

void beam_shadow(const struct shadow_case *c, struct shadow_answer *out);
void beamf_shadow(const struct shadow_case *c, struct shadow_answer *out);
void beamc_shadow(const struct shadow_case *c, struct shadow_answer *out);

#endif
