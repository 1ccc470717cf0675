/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "motion_modes.h"

void motion_resonances(const struct transfer_modes *modes, const struct response_grid *grid, double complex G[])
{
    for (size_t k = 0; k < modes->n; k++) {
        double w2 = modes->omega_rad[k] * modes->omega_rad[k];
        for (size_t i = 0; i < grid->m; i++)
            G[k * grid->m + i] = 1.0 / ((grid->s[i] + modes->damping[k]) * grid->s[i] + w2);
    }
}

double motion_shape(const struct transfer_modes *modes, size_t mode, const double g[])
{
    const double *shape = modes->shape + mode * modes->dimension;
    double sum = 0.0;
    for (size_t i = 0; i < modes->dimension; i++)
        sum += shape[i] * g[i];
    return sum;
}
