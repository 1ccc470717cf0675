/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * law_hold.h — the exact step of one pole under a force that is a polynomial through its last samples.
 *
 * q' = p q + f gives q(h) = e q(0) + Σ_i g_i f(h − i h): two samples (the straight line) or four (the cubic). The line
 * does not overshoot at a kink of f; the cubic's error is of fourth order in h, for forces that are smooth in time.
 */
#ifndef BEAMFIT_LAW_HOLD_H
#define BEAMFIT_LAW_HOLD_H

#include <complex.h>
#include <stddef.h>

enum { HOLD_LINE = 2, HOLD_CUBIC = 4 };

struct law_hold {
    double complex e, g[HOLD_CUBIC], d_e, d_g[HOLD_CUBIC]; /* d_: derivative by p */
};

/* samples: HOLD_LINE or HOLD_CUBIC; |p h| ≤ 4. Other g are 0. */
struct law_hold law_hold(double complex p, double h_s, size_t samples);

#endif
