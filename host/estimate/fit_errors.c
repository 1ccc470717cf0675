/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a fit leaves of every channel. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit_result.h"
#include "fit_shares.h"
#include "maths/maths.h"
#include "noise/noise.h"

struct fit_channel_error *fit_channel_errors(const struct fit_problem *p, const double noise[], size_t *n_errors)
{
    if (p->shares != NULL)
        return shares_errors(p, n_errors);
    const size_t n_groups = p->lines != NULL ? p->lines->n_groups : 0;
    struct fit_channel_error *errors = bf_alloc(p->n_channels + n_groups, sizeof *errors);
    *n_errors = p->n_channels + n_groups;
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        struct fit_channel_error *e = &errors[c];
        double *left = bf_alloc(channel->n + 1, sizeof *left);
        size_t n = 0;
        for (; n < channel->n && p->weight[channel->row + n] > 0.0; n++)
            left[n] = p->fitted[channel->row + n] - channel->measured[n];
        const double rms = n ? root_mean_square(left, n) : 0.0, size = n ? root_mean_square(channel->measured, n) : 0.0;
        const double hum = sqrt(mains_power(p->model, &p->records[channel->record], left, n));
        free(left);
        e->record = channel->record;
        memcpy(e->name, p->model->outputs[channel->output].name, sizeof e->name);
        e->n = n;
        e->cut = n < channel->n;
        e->noise = noise[c];
        e->nrmse = size > 0.0 ? rms / size : rms > 0.0 ? HUGE_VAL : 0.0;
        e->noise_ratio = noise[c] > 0.0 ? rms / noise[c] : nan("");
        e->hum_ratio = noise[c] > 0.0 ? hum / noise[c] : 0.0;
    }
    if (p->lines != NULL)
        lines_errors(p->lines, errors + p->n_channels);
    return errors;
}

void fit_totals(const struct fit_channel_error channels[], size_t n, double *nrmse, double *noise_ratio)
{
    double error = 0.0, ratio = 0.0;
    for (size_t c = 0; c < n; c++) {
        error += channels[c].nrmse * channels[c].nrmse;
        ratio += channels[c].noise_ratio * channels[c].noise_ratio;
    }
    *nrmse = n ? sqrt(error / (double)n) : 0.0;
    *noise_ratio = n ? sqrt(ratio / (double)n) : 0.0;
}
