/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_noise.c — the noise of all channels of the records, where the caller of attainable_find() has none. */
#include "attainable_problem.h"

enum bf_status attainable_noise(const struct model *model, const struct record records[], size_t n_records,
                                double **rms, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *rms = bf_alloc(n_records * model->n_outputs + 1, sizeof **rms);
    for (size_t r = 0; r < n_records; r++)
        for (size_t o = 0; o < model->n_outputs && status == BF_OK; o++) {
            struct noise_estimate noise;
            if (record_column(&records[r], model->outputs[o].name) == NULL)
                continue;
            status = noise_of_channel(model, &records[r], model->outputs[o].name, &noise, err);
            if (status != BF_OK)
                return status;
            (*rms)[r * model->n_outputs + o] = noise.rms;
            noise_free(&noise);
        }
    return status;
}
