/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * clamp_motion.h — the motion of one functional on a clamp that shakes with tones a_b(t) = Im(E e^(iωt)), in closed form.
 *
 * The load −ρ(x) a_b acts on the motion relative to the clamp, from relative rest at the record's first sample. In partial
 * fractions
 *     y = Im(E (T(iω) e^(iωt) + Σ_k R_k p_k^ν/(p_k − iω) e^(p_k t))),   T(s) = s^ν Σ_k R_k/(s − p_k),
 * so neither samples nor a step are involved. A sensor that stands on the ground adds (iω)^(ν−2) to T. In a free decay
 * the second sum is left to the unknown initial state.
 */
#ifndef BEAMFIT_CLAMP_MOTION_H
#define BEAMFIT_CLAMP_MOTION_H

#include <math.h>
#include "beam_effect.h"
#include "functional.h"

/* The tone of one effect in a record. */
struct clamp_tone {
    struct beam_tone tone;
    int n_parameters;                         /* of the effect */
    size_t parameter[BEAM_EFFECT_PARAMETERS]; /* where they stand in the parameter vector */
};

/* A shaken clamp in a record. */
struct clamp {
    const struct system *system;
    const struct functional *load; /* what its acceleration does */
    const bool *structural;        /* as functionals_evaluate() was given it */
    double clock;                  /* instants move by t/clock with it … */
    const double *clock_by;        /* … and it moves by this with each parameter */
    size_t n_tones;
    struct clamp_tone *tones;
};

/* What is asked for: the motion of a functional at t = t0 + k h, times a constant and, if steady, a filter. */
struct clamp_question {
    const struct clamp *clamp;
    const struct functional *f;
    int order;             /* time derivatives */
    bool absolute, steady; /* as a sensor on the ground sees it; without the part that starts from rest */
    double complex gain;
    const double complex *filter, *slope; /* [n_tones] F(iω) and dF/ds there; NULL: 1 and 0 */
    double t0_s, h_s;
    size_t n;
};

static inline double clamp_omega(const struct clamp_tone *tone)
{
    return 2.0 * acos(-1.0) * tone->tone.frequency_Hz;
}

/* The motion relative to the clamp from the record's first sample on. */
struct clamp_question clamp_relative(const struct clamp *clamp, const struct functional *f, int order, double h_s,
                                     size_t n);
/* out[n] += the motion; += its derivative by a parameter, false when that is zero. */
void clamp_motion_add(const struct clamp_question *q, double out[]);
bool clamp_derivative_add(const struct clamp_question *q, size_t parameter, double out[]);

#endif
