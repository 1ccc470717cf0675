/* SPDX-License-Identifier: GPL-3.0-or-later */
/* system.h — the assembled system as one matrix, for checks of its poles. Private to beam/. */
#ifndef BEAMFIT_SYSTEM_H
#define BEAMFIT_SYSTEM_H

#include "beam.h"

/* A(at) of the last evaluation, [n × n]. */
void system_dynamic_stiffness(const struct system *s, double complex at, double complex A[]);

#endif
