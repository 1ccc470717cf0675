/* SPDX-License-Identifier: GPL-3.0-or-later */
/* system.h — private to beam/: what its files share of system. */
#ifndef BEAMFIT_SYSTEM_PRIVATE_H
#define BEAMFIT_SYSTEM_PRIVATE_H

#include "beam.h"

/* A(at) assembled, [n × n], for checks and direct solves. */
void system_dynamic_stiffness(const struct system *s, double complex at, double complex A[]);

#endif
