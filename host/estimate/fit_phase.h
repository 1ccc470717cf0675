/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fit_phase.h — starts of sinusoidal effects (hum, base motion); private to estimate/.
 *
 * Effects that are a sinusoid of unknown amplitude and phase (hum, base motion) have a minimum in every wrong phase, and
 * nothing to say in a short window. phases_hold() takes them out (amplitude 0, not moved); phases_find() puts them back
 * where the residual of the whole records says: a linear fit of sine and cosine per record, at the best of the start and
 * six lines of the residual's spectrum, the most prominent and the largest, when the frequency is free.
 */
#ifndef BEAMFIT_FIT_PHASE_H
#define BEAMFIT_FIT_PHASE_H

#include "fit_problem.h"

/* Some effect from this one on is such a sinusoid, with amplitude and phases free. */
bool phases_any(const struct fit_problem *p, size_t first_effect);
void phases_hold(struct fit_problem *p, double x[]);
enum bf_status phases_find(struct fit_problem *p, double x[], struct bf_error *err);
/* Free phases into −π … π; the prediction stays. */
void phases_wrap(const struct fit_problem *p, double x[]);

#endif
