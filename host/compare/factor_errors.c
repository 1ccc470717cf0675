/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factor_errors.c — what the model leaves of each channel: as it is given, or fitted where the fit has kept its size. */
#include "factor_pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "estimate/estimate.h"

static const double size_kept = 0.35; /* |ln| of what sets the size of the response: no hypothesis is so near to 1 */
static const double stiffness_kept =
    1.0; /* |ln| of a stiffness or of a patch's mass: two standard deviations of the check's */

static bool is_stated(const struct parameter *p)
{
    return p->fixed || p->prior > 0.0;
}

/* How far this parameter may go, |ln|; infinite: any value of the same sign, negative: any value. */
static double room_of(const struct model *model, const struct parameter_ref *ref)
{
    switch (ref->role) {
    case ROLE_RHO:
        return ref->owner == model_plain_material(model) ? size_kept : stiffness_kept;
    case ROLE_EI:
        return stiffness_kept;
    case ROLE_KS:
    case ROLE_KB:
        return is_stated(ref->info) ? size_kept : HUGE_VAL; /* an open gain has no size */
    case ROLE_INPUT_GAIN:
    case ROLE_OUTPUT_GAIN:
        return size_kept;
    default:
        return -1.0;
    }
}

/*
 * Mass per length, gains and stiffnesses have not moved as far as a wrong unit would move them, and no gain has turned: then what a fit explains has no
 * sign and no decade to ask for.
 */
static bool has_kept_size(const struct model *model, const struct fit_result *fitted)
{
    struct parameter_ref *refs;
    const size_t n = model_parameters(model, (const char *const *)fitted->names, fitted->n_records, &refs);
    bool kept = n == fitted->n_parameters;
    for (size_t i = 0; i < n && kept; i++) {
        const double room = room_of(model, &refs[i]), ratio = fitted->parameters[i].value / refs[i].value;
        kept = refs[i].info->fixed || room < 0.0 || (ratio > 0.0 && fabs(log(ratio)) <= room);
    }
    free(refs);
    return kept;
}

static void take(const struct model *model, size_t n_records, const struct fit_channel_error channels[], size_t n,
                 double nrmse[])
{
    for (size_t c = 0; c < n; c++)
        for (size_t o = 0; o < model->n_outputs; o++)
            if (channels[c].record < n_records && strcmp(channels[c].name, model->outputs[o].name) == 0)
                nrmse[channels[c].record * model->n_outputs + o] = channels[c].nrmse;
}

enum bf_status factor_errors(const struct model *model, const struct record records[], size_t n_records,
                             const struct predict_options *options, const struct fit_result *fitted, double nrmse[],
                             struct bf_error *err)
{
    struct fit_options how = {.quiet = true};
    struct fit_channel_error *channels = NULL;
    size_t n = 0;
    if (options)
        how.predict = *options;
    how.predict.quiet = true;
    for (size_t i = 0; i < n_records * model->n_outputs; i++)
        nrmse[i] = HUGE_VAL;
    if (fitted != NULL && has_kept_size(model, fitted)) {
        take(model, n_records, fitted->channels, fitted->n_channels, nrmse);
        return BF_OK;
    }
    const enum bf_status status = fit_errors(model, records, n_records, &how, &channels, &n, err);
    if (!status)
        take(model, n_records, channels, n, nrmse);
    free(channels);
    return status == BF_NUMERIC || status == BF_BAD_FILE ? BF_OK : status; /* said by the command itself */
}
