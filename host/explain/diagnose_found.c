/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The model that a diagnosis has found, as a file that goes on from there. */
#include "explain.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The errors of the fitted channels in the form that a fit gives; free(). */
static struct fit_channel_error *channels_of(const struct diagnosis *d, const struct hypothesis *h)
{
    struct misfit_channel *channels = hypothesis_channels(d, h);
    struct fit_channel_error *out = bf_alloc(h->fit.n_channels, sizeof *out);
    for (size_t c = 0; c < h->fit.n_channels; c++) {
        const double size = root_mean_square(channels[c].measured, channels[c].n);
        out[c] = (struct fit_channel_error){.record = channels[c].record,
                                            .n = channels[c].n,
                                            .noise = d->noise[c].rms,
                                            .noise_ratio = h->fitted.ratio[c],
                                            .nrmse = nan("")};
        (void)snprintf(out[c].name, sizeof out[c].name, "%s", channels[c].channel);
        if (size > 0.0)
            out[c].nrmse = root_mean_square(channels[c].residual, channels[c].n) / size;
    }
    free(channels);
    return out;
}

static void take_values(const struct hypothesis *h, struct fit_result *fit)
{
    fit->n_parameters = h->fit.n_parameters;
    fit->parameters = bf_alloc(h->fit.n_parameters + 1, sizeof *fit->parameters);
    for (size_t i = 0; i < h->fit.n_parameters; i++) {
        fit->parameters[i].value = h->fit.value[i];
        fit->parameters[i].sd = h->fit.sd[i];
        fit->parameters[i].identifiable = h->fit.estimated[i] && isfinite(h->fit.sd[i]);
    }
}

enum bf_status diagnose_found(const struct diagnosis *d, struct model *out, struct bf_error *err)
{
    static const struct fit_check nothing_held_out;
    const struct hypothesis *h = d->n_named > 0 ? &d->hypotheses[0] : &d->baseline;
    const enum bf_status status = model_copy(&h->model, out, err);
    if (status)
        return status;
    const char **names = record_base_names(d->records, d->n_records);
    struct fit_result fit = {.n_records = d->n_records,
                             .converged = h->fit.converged,
                             .nrmse = h->fitted.nrmse,
                             .noise_ratio = h->fitted.noise_ratio};
    take_values(h, &fit);
    fit.names = (char **)names;
    fit.n_channels = h->fit.n_channels;
    fit.channels = channels_of(d, h);
    fit_into_model(&fit, d->records, &nothing_held_out, out);
    free(fit.parameters), free(fit.channels), free(names);
    return BF_OK;
}
