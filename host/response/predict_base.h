/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * predict_base.h — the motion of one functional on a shaken clamp in closed form; shared by predict_base.c and
 * predict_base_channel.c and nobody else.
 */
#ifndef BEAMFIT_PREDICT_BASE_H
#define BEAMFIT_PREDICT_BASE_H

#include <math.h>
#include "predict_work.h"

/* What is asked for: the motion of a functional at t = t0 + k h, times a constant or a steady filter F(iω). */
struct question {
    const struct run *run;
    size_t record;
    const struct functional *f;
    int order;
    bool absolute, steady;
    double complex F, slope; /* and dF/ds */
    size_t output;           /* steady: F is also multiplied by the filters of this output at iω; SIZE_MAX: by none */
    size_t filter_parameter; /* not SIZE_MAX: by the derivative of those filters by it instead */
    double t0_s, h_s;
    size_t n;
};

/* out[n] += the motion; += its derivative by a parameter, false when that is zero. */
void base_answer(const struct question *q, double out[]);
bool base_answer_derivative(const struct question *q, size_t parameter, double out[]);
/* The tone of effect e at the run's parameters; false: it has none. */
bool base_tone(const struct question *q, size_t e, struct beam_tone *tone);
static inline double base_omega(const struct beam_tone *tone)
{
    return 2.0 * acos(-1.0) * tone->frequency_Hz;
}

#endif
