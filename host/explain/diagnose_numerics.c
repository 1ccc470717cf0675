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
 * baseline's values are absurd and hard to compute with, what explains the records is computed at values of its own: then the error at the
 * values as given counts.
 */
static const double far_above = 3.0;
/* rms of the difference of two predictions of n rows, in units of the noise. */
static double change_of(const double one[], const double other[], size_t n, double sigma)
{
    double square = 0.0;
    for (size_t k = 0; k < n; k++)
        square += (one[k] - other[k]) * (one[k] - other[k]);
    return n > 0 ? sqrt(square / (double)n) / sigma : 0.0;
}

/* The largest change of a channel, over the rows that the baseline has in use. */
static double worst_change(const struct diagnose_state *w, const struct finer_prediction *usual,
                           const struct finer_prediction *finer, size_t *channel)
{
    struct misfit_channel *channels = hypothesis_channels(w->d, &w->d->baseline);
    double worst = 0.0;
    for (size_t c = 0; c < finer->n_channels; c++) {
        const double change = change_of(usual->fitted + usual->channels[c].row, finer->fitted + finer->channels[c].row,
                                        channels[c].n, w->sigma[c]);
        if (change > worst)
            worst = change, *channel = c;
    }
    free(channels);
    return worst;
}

static enum bf_status change_at(struct diagnose_state *w, const struct model *model, const double theta[],
                                double *change, size_t *channel, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct fit_options options = {.quiet = true, .sigma = w->sigma, .predict = w->options->predict};
    struct finer_prediction usual, finer = {0};
    options.predict.threads = w->threads;
    enum bf_status status = fit_predict(model, d->records, d->n_records, &options, theta, &usual, err);
    if (!status)
        status = fit_finer(model, d->records, d->n_records, &options, theta, &finer, err);
    if (!status)
        *change = worst_change(w, &usual, &finer, channel);
    d->evaluations += usual.runs + finer.runs;
    finer_prediction_free(&usual), finer_prediction_free(&finer);
    return status;
}

/* What was believed before the fit is a beam, whatever a baseline that lacks something was driven to. */
static enum bf_status change_as_given(struct diagnose_state *w, double *change, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct model given;
    struct parameter_ref *refs;
    size_t channel;
    enum bf_status status = diagnose_as_given(d->model, &given, err);
    if (status)
        return status;
    const char **names = record_base_names(d->records, d->n_records);
    const size_t n = model_parameters(&given, names, d->n_records, &refs);
    double *theta = bf_alloc(n + 1, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    status = change_at(w, &given, theta, change, &channel, err);
    model_free(&given);
    free(theta), free(refs), free(names);
    return status;
}

enum bf_status diagnose_numerics(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct numerics *numerics = &d->numerics;
    *numerics = (struct numerics){.change = NAN, .steps = model_has_law(&d->baseline.model)};
    enum bf_status status =
        change_at(w, &d->baseline.model, d->baseline.fit.value, &numerics->change, &numerics->channel, err);
    numerics->fine = !status && numerics->change <= fine_change;
    if (!numerics->fine && (!status || status == BF_NUMERIC) && diagnose_is_far(&d->baseline))
        status = change_as_given(w, &numerics->as_given, err);
    return status == BF_NUMERIC ? BF_OK : status; /* no value in the finer space: it remains unknown, and not fine */
}

bool diagnose_computed(const struct diagnosis *d)
{
    const double misfit = sqrt(fmax(d->baseline.fitted.noise_ratio * d->baseline.fitted.noise_ratio - 1.0, 0.0));
    const double change =
        d->numerics.as_given > 0.0 ? fmin(d->numerics.change, d->numerics.as_given) : d->numerics.change;
    return d->numerics.fine || misfit > far_above * change;
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
