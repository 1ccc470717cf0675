/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Is it the computation that is wrong, not the physics? The baseline is predicted once more at its optimum, in a finer space
 * and, where it steps through time, with a finer step; linear unknowns (states of free decays, unknown levels) are solved again.
 */
#include "diagnose_state.h"

#include <math.h>
#include <stdlib.h>

#include "estimate/estimate.h"
#include "ground/ground.h"

/*
 * Of the noise, rms on one channel. An error of this size raises a misfit of 1.00 times the noise to 1.04, just below
 * where a model stops being complete: anything smaller cannot be mistaken for physics.
 */
static const double fine_change = 0.3;
/*
 * A misfit this many times the error of the computation is still physics: a ninth of its power is the computation's. Far off, where the
 * baseline's values are absurd and hard to compute with, what explains the records is computed at values of its own.
 */
static const double far_above = 3.0;
/* rms over the rows in use of the change of one channel, in units of its noise. */
static double change_of(const struct misfit_channel *channel, const double fitted[], double sigma)
{
    double square = 0.0;
    for (size_t k = 0; k < channel->n; k++) {
        const double change = fitted[k] - (channel->measured[k] - channel->residual[k]);
        square += change * change;
    }
    return channel->n > 0 ? sqrt(square / (double)channel->n) / sigma : 0.0;
}

static void compare(const struct diagnose_state *w, const struct finer_prediction *finer, struct numerics *numerics)
{
    struct misfit_channel *channels = hypothesis_channels(w->d, &w->d->baseline);
    numerics->change = 0.0;
    for (size_t c = 0; c < finer->n_channels; c++) {
        const double change = change_of(&channels[c], finer->fitted + finer->channels[c].row, w->sigma[c]);
        if (change > numerics->change) {
            numerics->change = change;
            numerics->channel = c;
        }
    }
    numerics->fine = numerics->change <= fine_change;
    free(channels);
}

enum bf_status diagnose_numerics(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    const struct model *model = &d->baseline.model;
    struct fit_options options = {.quiet = true, .sigma = w->sigma, .predict = w->options->predict};
    struct finer_prediction finer;
    options.predict.threads = w->threads;
    d->numerics = (struct numerics){.change = NAN, .steps = model_has_law(model)};
    enum bf_status status = fit_finer(model, d->records, d->n_records, &options, d->baseline.fit.value, &finer, err);
    if (!status)
        compare(w, &finer, &d->numerics);
    d->evaluations += finer.runs;
    finer_prediction_free(&finer);
    return status == BF_NUMERIC ? BF_OK : status; /* no value in the finer space: it remains unknown, and not fine */
}

bool diagnose_computed(const struct diagnosis *d)
{
    const double misfit = sqrt(fmax(d->baseline.fitted.noise_ratio * d->baseline.fitted.noise_ratio - 1.0, 0.0));
    return d->numerics.fine || misfit > far_above * d->numerics.change;
}

enum bf_status diagnose_resolve(struct diagnose_state *w, struct bf_error *err)
{
    enum { MOST_TIMES = 2 };
    struct diagnosis *d = w->d;
    const bool told = w->predict->fine_splines > 0 || w->predict->modes > 0 || w->predict->oversample > 0;
    enum bf_status status = diagnose_numerics(w, err);
    for (int k = told ? MOST_TIMES : 0; k < MOST_TIMES && !status && !diagnose_computed(d) && !progress_interrupted();
         k++) {
        status = predict_finer(&d->baseline.model, d->records, d->n_records, w->predict, err);
        hypothesis_free(&d->baseline);
        d->n_modes = 0;
        if (!status)
            status = diagnose_baseline(w, err);
        if (!status)
            status = diagnose_numerics(w, err);
    }
    return status;
}
