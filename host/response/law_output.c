/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_run.h"

#include <stdlib.h>

enum bf_status law_add_output(const struct law_run *l, const struct predict_channel *channel, double scale,
                              const double complex filter[], const double complex Y[], double row[],
                              struct bf_error *err)
{
    size_t m = l->grid->m;
    double complex *Z = bf_alloc(m, sizeof *Z);
    double *y = bf_alloc(channel->n, sizeof *y);
    for (size_t k = 0; k < m; k++)
        Z[k] = scale * (filter[k] * Y[k]);
    recorder_apply(l->plan, m, Z);
    enum bf_status status = response_back(l->grid, Z, y, err);
    for (size_t k = 0; k < channel->n; k++)
        row[k] += y[k];
    free(Z);
    free(y);
    return status;
}

/* y_o −= Ks F_o Σ_c H_oc f_c; and what depends on Ks and the filters alone. */
static enum bf_status add_channel(const struct law_run *l, const struct predict_channel *channel,
                                  const double complex F[], struct bf_error *err)
{
    const struct predictor *p = l->run->p;
    size_t m = l->grid->m, gain_parameter;
    double gain = output_gain(l->run, channel->output, &gain_parameter);
    double complex *filter = bf_alloc(3 * m, sizeof *filter), *Y = filter + m, *dF = Y + m;
    bool filtered;
    for (size_t c = 0; c < l->D; c++) {
        const double complex *H = law_to_output(l->transfers, l->plan->grid, channel->output, c)->H;
        for (size_t k = 0; k < m; k++)
            Y[k] -= H[k] * F[c * m + k];
    }
    enum bf_status status = channel_filter(l->run, l->record, channel->output, l->grid->s, m, filter, &filtered, err);
    if (status == BF_OK)
        status = law_add_output(l, channel, gain, filter, Y, l->run->out->y + channel->row, err);
    for (size_t j = 0; status == BF_OK && l->run->want != NULL && j < p->map.n; j++) {
        if (!run_wants(l->run, j))
            continue;
        if (j == gain_parameter)
            status = law_add_output(l, channel, 1.0, filter, Y, run_column(l->run, j, channel), err);
        else if (channel_filter_derivative(l->run, l->record, channel->output, j, l->grid->s, m, dF))
            status = law_add_output(l, channel, gain, dF, Y, run_column(l->run, j, channel), err);
    }
    free(filter);
    return status;
}

enum bf_status law_run_outputs(const struct law_run *l, struct bf_error *err)
{
    const struct predictor *p = l->run->p;
    size_t m = l->grid->m;
    double complex *F = bf_alloc(l->D * m, sizeof *F);
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < l->D; c++)
        status = law_transform(l, l->f + c, l->D, F + c * m, err);
    for (size_t i = 0; status == BF_OK && i < l->plan->n_channels; i++)
        status = add_channel(l, &p->channels[l->plan->first_channel + i], F, err);
    if (status == BF_OK && l->run->want != NULL)
        status = law_derivatives(l, F, err);
    free(F);
    return status;
}
