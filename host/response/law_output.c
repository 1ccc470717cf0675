/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_run.h"

#include <stdlib.h>

#include "recorder.h"

enum bf_status law_add_output(const struct law_run *l, double scale, const double complex filter[],
                              const double complex Y[], double row[], struct bf_error *err)
{
    size_t m = l->grid->m, n = l->grid->n;
    double complex *Z = bf_alloc(m, sizeof *Z);
    double *y = bf_alloc(n, sizeof *y);
    for (size_t k = 0; k < m; k++)
        Z[k] = scale * (filter[k] * Y[k]);
    recorder_apply(l->system->recorder, m, Z);
    enum bf_status status = response_back(l->grid, Z, y, err);
    for (size_t k = 0; k < n; k++)
        row[k] += y[k];
    free(Z);
    free(y);
    return status;
}

/* y_o −= Ks F_o Σ_c H_oc f_c; and what depends on Ks and the filters alone. */
static enum bf_status add_output(const struct law_run *l, const struct modal_output *output, struct bf_error *err)
{
    size_t m = l->grid->m;
    double complex *Y = bf_alloc(m, sizeof *Y);
    for (size_t c = 0; c < l->D; c++) {
        const double complex *H = output->paths[c].H;
        for (size_t k = 0; k < m; k++)
            Y[k] -= H[k] * l->F[c * m + k];
    }
    enum bf_status status = law_add_output(l, output->gain, output->filter, Y, output->y, err);
    for (size_t i = 0; status == BF_OK && i < output->n_changes; i++) {
        const struct modal_change *change = &output->changes[i];
        status =
            law_add_output(l, change->scale, change->d, Y, modal_column(l->system, output, change->parameter), err);
    }
    free(Y);
    return status;
}

enum bf_status law_run_outputs(struct law_run *l, struct bf_error *err)
{
    size_t m = l->grid->m;
    l->F = bf_alloc(l->D * m, sizeof *l->F);
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < l->D; c++)
        status = law_transform(l, l->f + c, l->D, l->F + c * m, err);
    for (size_t i = 0; status == BF_OK && i < l->system->n_outputs; i++)
        status = add_output(l, &l->system->outputs[i], err);
    return status;
}
