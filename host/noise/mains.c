/* SPDX-License-Identifier: GPL-3.0-or-later */
/* mains.c — hum in what a model leaves. */
#include "linearity_added.h"
#include "noise.h"

#include <math.h>
#include <stdlib.h>

#include "ground/ground.h"

/* Where a mains has its frequency, and a recorder's clock puts it. */
static const double lowest_Hz = 45.0, highest_Hz = 65.0;
enum { LINES = 16 };

double mains_power(const struct model *model, const struct record *record, const double residual[], size_t n)
{
    struct linearity_added found[LINES];
    const double **u = bf_alloc(model->n_inputs + 1, sizeof *u);
    double power = 0.0;
    size_t n_inputs = 0;
    for (size_t i = 0; i < model->n_inputs; i++) {
        u[n_inputs] = record_column(record, model->inputs[i].name);
        n_inputs += u[n_inputs] != NULL;
    }
    const size_t lines = linearity_find_added(residual, n, record->dt_s, u, n_inputs, found, LINES);
    for (size_t k = 0; k < lines; k++)
        if (found[k].frequency_Hz > lowest_Hz && found[k].frequency_Hz < highest_Hz)
            power += 0.5 * found[k].amplitude * found[k].amplitude;
    free(u);
    return power;
}
