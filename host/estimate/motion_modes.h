/* SPDX-License-Identifier: GPL-3.0-or-later */
/* motion_modes.h — the deviation's modes, one at a time: what motion.c, motion_jacobian.c and motion_paths.c share. */
#ifndef BEAMFIT_MOTION_MODES_H
#define BEAMFIT_MOTION_MODES_H

#include "response/response.h"

/* G[modes->n][m]: 1/(s² + C_kk s + ω_k²). */
void motion_resonances(const struct transfer_modes *modes, const struct response_grid *grid, double complex G[]);
/* ψ_k(g) of a functional. */
double motion_shape(const struct transfer_modes *modes, size_t mode, const double g[]);

#endif
