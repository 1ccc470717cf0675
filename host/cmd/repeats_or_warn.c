/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "repeats_or_warn.h"

#include <string.h>

#include "ground/ground.h"

void repeats_noise(const struct model *model, size_t record, const char *output, double noise_rms, double rms[])
{
    for (size_t o = 0; o < model->n_outputs; o++)
        if (strcmp(model->outputs[o].name, output) == 0)
            rms[record * model->n_outputs + o] = noise_rms;
}

struct repeatability repeats_or_warn(const struct model *model, const struct record records[], size_t n_records,
                                     const double noise_rms[])
{
    struct repeatability out;
    struct bf_error err;
    if (repeatability_find(model, records, n_records, noise_rms, &out, &err) == BF_OK)
        return out;
    bf_warn("how well repeated records agree is not known: %s", err.text);
    repeatability_free(&out);
    return out;
}
