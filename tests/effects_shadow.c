/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "effects_shadow.h"
#include <string.h>
#include "beam_effect.h"

_Static_assert((int)SHADOW_P == (int)BEAM_EFFECT_PARAMETERS, "parameters");
_Static_assert((int)SHADOW_P + 3 * (int)BEAM_LAW_WIDTH + (int)BEAM_LAW_STATES <= (int)SHADOW_IN, "inputs");
_Static_assert(6 * (int)BEAM_EFFECT_TERMS <= (int)SHADOW_OUT, "outputs");

#if defined BEAM_COMPLEX
#define REAL(x)        creal(x)
#define IMAG(x)        cimag(x)
#define NUMBER(re, im) CMPLX(re, im)
#else
#define REAL(x)        ((double)(x))
#define IMAG(x)        0.0
#define NUMBER(re, im) ((beam_real)(re))
#endif

static void value(struct shadow_answer *out, int row, beam_real y)
{
    out->y[row] = REAL(y);
    out->y_imaginary[row] = IMAG(y);
    if (out->n_out < row + 1)
        out->n_out = row + 1;
}

static void slopes(struct shadow_answer *out, int row, int first, const beam_real d[], int n)
{
    for (int j = 0; j < n; j++)
        out->slope[row][first + j] = REAL(d[j]);
}

static void coefficients(struct shadow_answer *out, int row, const struct beam_coefficients *c, int column)
{
    const beam_real x[5] = {c->mass, c->damping, c->stiffness, c->memory, c->relaxation_s};
    for (int i = 0; i < 5; i++) {
        if (column < 0)
            value(out, row + i, x[i]);
        else
            out->slope[row + i][column] = REAL(x[i]);
    }
}

static int terms(const struct beam_effect *e, const beam_real x[], const struct beam_place *place,
                 struct shadow_answer *out)
{
    struct beam_term t[BEAM_EFFECT_TERMS];
    memset(t, 0, sizeof t);
    const int status = e->terms(x, place, t);
    for (int i = 0; i < e->n_terms; i++) {
        coefficients(out, 6 * i, &t[i].value, -1);
        for (int j = 0; j < SHADOW_P; j++)
            coefficients(out, 6 * i, &t[i].by_parameter[j], j);
        value(out, 6 * i + 5, t[i].place.at_m);
        if (t[i].place.at_parameter > 0)
            out->slope[6 * i + 5][t[i].place.at_parameter - 1] = 1.0;
    }
    return status;
}

static int law_place(const struct beam_effect *e, const beam_real x[], const struct beam_place *place,
                     struct shadow_answer *out)
{
    struct beam_law_place at;
    memset(&at, 0, sizeof at);
    const int status = e->law_place(x, place, &at);
    value(out, 0, at.at_m);
    value(out, 1, at.width_m);
    if (at.at_parameter > 0)
        out->slope[0][at.at_parameter - 1] = 1.0;
    if (at.width_parameter > 0)
        out->slope[1][at.width_parameter - 1] = 1.0;
    return status;
}

static int law(const struct beam_effect *e, const beam_real x[], const struct shadow_case *c, struct shadow_answer *out)
{
    enum { W = BEAM_LAW_WIDTH, Z = BEAM_LAW_STATES, P = SHADOW_P };
    struct beam_law_input in;
    struct beam_law_output o;
    memset(&o, 0, sizeof o);
    memcpy(in.w, x + P, sizeof in.w);
    memcpy(in.v, x + P + W, sizeof in.v);
    memcpy(in.w_old, x + P + 2 * W, sizeof in.w_old);
    memcpy(in.z, x + P + 3 * W, sizeof in.z);
    in.t_s = (beam_real)c->t_s;
    in.dt_s = (beam_real)c->dt_s;
    const int status = e->law(x, &in, &o);
    for (int i = 0; i < W; i++) {
        value(out, i, o.f[i]);
        slopes(out, i, 0, o.f_p[i], P);
        slopes(out, i, P, o.f_w[i], W);
        slopes(out, i, P + W, o.f_v[i], W);
        slopes(out, i, P + 2 * W, o.f_w_old[i], W);
        slopes(out, i, P + 3 * W, o.f_z[i], Z);
    }
    for (int i = 0; i < Z; i++) {
        value(out, W + i, o.z[i]);
        slopes(out, W + i, 0, o.z_p[i], P);
        slopes(out, W + i, P, o.z_w[i], W);
        slopes(out, W + i, P + W, o.z_v[i], W);
        slopes(out, W + i, P + 2 * W, o.z_w_old[i], W);
        slopes(out, W + i, P + 3 * W, o.z_z[i], Z);
    }
    out->n_in = P + 3 * W + Z;
    return status;
}

static int filter(const struct beam_effect *e, const beam_real x[], struct shadow_answer *out)
{
    struct beam_filter_output o;
    memset(&o, 0, sizeof o);
    const int status = e->filter(x, &o);
    for (int j = -1; j < SHADOW_P; j++) {
        const struct beam_filter *f = j < 0 ? &o.value : &o.by_parameter[j];
        const beam_real y[5] = {f->b1, f->b0, f->a1, f->a0, f->delay_s};
        for (int i = 0; i < 5; i++) {
            if (j < 0)
                value(out, i, y[i]);
            else
                out->slope[i][j] = REAL(y[i]);
        }
    }
    return status;
}

static int drive(const struct beam_effect *e, const beam_real x[], struct shadow_answer *out)
{
    enum { P = SHADOW_P, Z = BEAM_DRIVE_STATES };
    struct beam_drive_output o;
    memset(&o, 0, sizeof o);
    const int status = e->drive(x, x[P], x[P + 1], x + P + 2, &o);
    value(out, 0, o.u);
    slopes(out, 0, 0, o.u_p, P);
    slopes(out, 0, P, &o.u_u, 1);
    slopes(out, 0, P + 1, &o.u_u_old, 1);
    slopes(out, 0, P + 2, o.u_z, Z);
    for (int i = 0; i < Z; i++) {
        value(out, 1 + i, o.z[i]);
        slopes(out, 1 + i, 0, o.z_p[i], P);
        slopes(out, 1 + i, P, &o.z_u[i], 1);
        slopes(out, 1 + i, P + 1, &o.z_u_old[i], 1);
        slopes(out, 1 + i, P + 2, o.z_z[i], Z);
    }
    out->n_in = P + 2 + Z;
    return status;
}

/* The slots that answer with a beam_sample_output. */
static int sample(const struct beam_effect *e, const beam_real x[], const struct shadow_case *c,
                  struct shadow_answer *out)
{
    enum { P = SHADOW_P };
    struct beam_sample_output o;
    memset(&o, 0, sizeof o);
    int status = 1;
    if (c->slot == SHADOW_MAP) {
        status = e->map(x, x[P], x[P + 1], &o);
        out->n_in = P + 2;
    } else if (c->slot == SHADOW_SIGNAL) {
        status = e->signal(x, (beam_real)c->t_s, x[P], &o);
        out->n_in = P + 1;
    } else if (c->slot == SHADOW_BASE) {
        status = e->base(x, (beam_real)c->t_s, &o);
    } else {
        status = e->axial_inertia(x, &o);
    }
    value(out, 0, o.y);
    slopes(out, 0, 0, o.y_p, P);
    slopes(out, 0, P, &o.y_v, 1);
    slopes(out, 0, P + 1, &o.y_u, 1);
    return status;
}

static int geometry(const struct beam_effect *e, const beam_real x[], struct shadow_answer *out)
{
    struct beam_geometry o;
    memset(&o, 0, sizeof o);
    const int status = e->geometry(x, &o);
    value(out, 0, o.patch_shift_m);
    value(out, 1, o.input_shift_m);
    value(out, 2, o.clock_relative);
    for (int i = 0; i < 3; i++)
        slopes(out, i, 0, o.by_parameter[i], SHADOW_P);
    return status;
}

static int has(const struct beam_effect *e, enum shadow_slot slot)
{
    const int present[SHADOW_SLOTS] = {e->terms != 0,    e->law_place != 0,    e->law != 0,   e->filter != 0,
                                       e->map != 0,      e->signal != 0,       e->drive != 0, e->base != 0,
                                       e->geometry != 0, e->axial_inertia != 0};
    return present[slot];
}

void BEAM_NAME(shadow)(const struct shadow_case *c, struct shadow_answer *out)
{
    const struct beam_effect *e = beam_effects[c->effect];
    memset(out, 0, sizeof *out);
    out->status = 1;
    out->n_in = SHADOW_P;
    if (!has(e, c->slot))
        return;
    beam_real x[SHADOW_IN];
    for (int j = 0; j < SHADOW_IN; j++)
        x[j] = NUMBER(c->x[j], j == c->direction ? c->step : 0.0);
    const struct beam_place place = {(beam_real)c->length_m, (beam_real)(0.05 * c->length_m),
                                     (beam_real)(0.2 * c->length_m)};
    if (c->slot == SHADOW_TERMS)
        out->status = terms(e, x, &place, out);
    else if (c->slot == SHADOW_LAW_PLACE)
        out->status = law_place(e, x, &place, out);
    else if (c->slot == SHADOW_LAW)
        out->status = law(e, x, c, out);
    else if (c->slot == SHADOW_FILTER)
        out->status = filter(e, x, out);
    else if (c->slot == SHADOW_DRIVE)
        out->status = drive(e, x, out);
    else if (c->slot == SHADOW_GEOMETRY)
        out->status = geometry(e, x, out);
    else
        out->status = sample(e, x, c, out);
}
