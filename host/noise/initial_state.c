/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Does a record with an input begin in motion? */
#include "noise.h"
#include "steady_drive.h"

#include <math.h>

#include "maths/maths.h"

/* Clearly in motion: in the first period its rms is above this many times the noise and this share of its rms at large. */
static const double noises = 6.0, steady_share = 0.9;
enum { FIRST = 3, FEWEST = 6 }; /* samples of a period; periods of a record */

static double mean_of(const double x[], size_t n)
{
    double sum = 0.0;
    for (size_t k = 0; k < n; k++)
        sum += x[k];
    return sum / (double)n;
}

/* Root mean square about `mean`. */
static double rms_about(double mean, const double x[], size_t n)
{
    double square = 0.0;
    for (size_t k = 0; k < n; k++)
        square += (x[k] - mean) * (x[k] - mean);
    return sqrt(square / (double)n);
}

size_t mean_crossings(const double x[], size_t n)
{
    const double mean = mean_of(x, n);
    size_t crossings = 0;
    for (size_t k = 1; k < n; k++)
        crossings += (x[k] > mean) != (x[k - 1] > mean);
    return crossings;
}

/* Samples of a mean period. */
static size_t period_of(const double z[], size_t n)
{
    const size_t crossings = mean_crossings(z, n), period = crossings > 0 ? 2 * n / crossings : n;
    return period < FIRST ? FIRST : period;
}

/* It is there in its first period already. From rest the response to a force builds up over many. */
static bool begins_before(const double z[], size_t n, double noise)
{
    const double mean = mean_of(z, n);
    const size_t period = period_of(z, n);
    const double first = rms_about(mean, z, period < n ? period : n);
    return FEWEST * period <= n && first > fmax(noises * noise, steady_share * rms_about(mean, z, n));
}

bool drive_goes_on(const struct model *model, const struct record *record)
{
    bool any = false;
    for (size_t i = 0; i < model->n_inputs; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        any = any || (u != NULL && begins_before(u, record->n, 0.0));
    }
    return any;
}

enum bf_status initial_state_find(const struct model *model, struct record *record, bool *found, struct bf_error *err)
{
    *found = false;
    if (record_meta(record, "initial_state") != NULL || record_state_is_free(record) || record_is_periodic(record) ||
        !drive_goes_on(model, record))
        return BF_OK;
    bool rest = false;
    for (size_t o = 0; o < model->n_outputs && !rest; o++) {
        const double *z = record_column(record, model->outputs[o].name);
        struct noise_estimate noise;
        if (z == NULL)
            continue;
        const enum bf_status status = noise_of_channel(model, record, model->outputs[o].name, &noise, err);
        if (status != BF_OK)
            return status;
        *found = begins_before(z, record->n, noise.rms);
        rest = !*found;
        noise_free(&noise);
    }
    if (*found)
        record_add_meta(record, "initial_state", "free");
    return BF_OK;
}
