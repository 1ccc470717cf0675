/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * time_axis.h — is a column of times uniform, and with which step? Printed times are rounded, so that each may lie up
 * to half a unit of its last printed digit away from the truth.
 */
#ifndef BEAMFIT_TIME_AXIS_H
#define BEAMFIT_TIME_AXIS_H

#include <stdbool.h>
#include <stddef.h>
#include "ground/number.h"

/* The most digits seen in a column of printed times; {0, 0}: not printed, exact. */
void time_axis_note(struct number_digits *most, struct number_digits one);

/*
 * t[n], n ≥ 2. True: uniform; *t0 and *dt by least squares over the whole span, or the roundest values that explain
 * every printed time (0.0009765625 rather than 0.00097656251). Each time may be off the line by 0.75 units of its last
 * printed digit (at most 0.3 dt, so that no missing or doubled sample passes) plus 0.01 dt.
 * False: *bad is the first offending sample and why[] says what is wrong with it. O(n).
 */
bool time_axis_fit(const double t[], size_t n, struct number_digits most, double *t0, double *dt, size_t *bad,
                   char why[256]);

/*
 * A step that was printed with `significant` digits: the roundest of it and of its rate that prints the same
 * (9.76563e-4 s with 6 digits is 1/1024 s).
 */
double time_axis_round_step(double dt, int significant);

#endif
