/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The modes of a model in the band of the records, held against the poles that a free linear model has found there. */
#include "diagnose_state.h"
#include "plausible.h"

#include <math.h>

#include "beam/beam.h"

/* All that is set by hand. */
static const struct mode_limits {
    double
        as_well; /* times what it leaves: a free linear model that leaves no more has found the modes that there are */
    double near; /* of a frequency: so near it a pole of the free linear model is that mode */
    double
        counts; /* of the power that an explanation leaves above the free linear model: what a mode that it lacks does of it at least */
} limits = {.as_well = 1.1, .near = 0.1, .counts = 0.25};

double diagnose_band_Hz(const struct diagnosis *d)
{
    double nyquist_Hz = 0.0;
    for (size_t r = 0; r < d->n_records; r++)
        nyquist_Hz = fmax(nyquist_Hz, 0.5 / d->records[r].dt_s);
    return nyquist_Hz;
}

enum bf_status diagnose_modes_in_band(const struct diagnosis *d, const struct model *model,
                                      double mode_Hz[DIAGNOSE_MODES], size_t *n_modes, struct bf_error *err)
{
    enum { SPLINES = 100 };
    const double band_Hz = diagnose_band_Hz(d);
    const enum bf_status status = modes_frequencies(model, SPLINES, false, DIAGNOSE_MODES, mode_Hz, err);
    *n_modes = 0;
    while (!status && *n_modes < DIAGNOSE_MODES && mode_Hz[*n_modes] < band_Hz)
        ++*n_modes;
    return status;
}

/* The free linear model has found the modes that there are: it leaves no more than h, nor more than the noise of records that agree with one linear beam. */
static bool knows_modes(const struct diagnosis *d, const struct hypothesis *h)
{
    const double floor = d->attainable.noise_ratio;
    const bool lacks_some = d->linearity.verdict == LINEARITY_LINEAR && floor > limits.as_well;
    return d->attainable.poles != NULL && !lacks_some && !(floor > limits.as_well * h->fitted.noise_ratio);
}

static bool is_seen(const struct attainable *a, double mode_Hz)
{
    for (size_t k = 0; k < a->modes; k++)
        if (fabs(a->poles[k].frequency_Hz - mode_Hz) <= limits.near * mode_Hz)
            return true;
    return false;
}

bool diagnose_modes_are_seen(const struct diagnosis *d, const struct hypothesis *h, double above_Hz)
{
    double mode_Hz[DIAGNOSE_MODES];
    size_t n_modes, hidden = 0;
    struct bf_error ignored;
    if (!knows_modes(d, h) || diagnose_modes_in_band(d, &h->model, mode_Hz, &n_modes, &ignored) != BF_OK)
        return true;
    for (size_t m = 0; m < n_modes; m++)
        hidden += mode_Hz[m] > above_Hz && mode_Hz[m] < beam_mode_limits.in_band * diagnose_band_Hz(d) &&
                  !is_seen(&d->attainable, mode_Hz[m]);
    return hidden <= 1;
}

/* The nearest mode to a pole that no other pole has taken becomes taken. */
static bool take_mode(double pole_Hz, const double mode_Hz[], size_t n_modes, bool taken[])
{
    size_t nearest = n_modes;
    for (size_t m = 0; m < n_modes; m++)
        if (!taken[m] && fabs(pole_Hz - mode_Hz[m]) <= limits.near * mode_Hz[m] &&
            (nearest == n_modes || fabs(pole_Hz - mode_Hz[m]) < fabs(pole_Hz - mode_Hz[nearest])))
            nearest = m;
    if (nearest < n_modes)
        taken[nearest] = true;
    return nearest < n_modes;
}

bool diagnose_is_mode(const struct diagnosis *d, double frequency_Hz, double damping_ratio)
{
    return damping_ratio < beam_mode_limits.damping && diagnose_decays(d, frequency_Hz, damping_ratio);
}

/*
 * Without the pole the free linear model leaves so much more that the lack of a mode there may be what h leaves: spare poles do next to nothing. A model that is
 * itself above the noise may have put a pole where it does nothing instead of where the mode is.
 */
static bool may_be_what_is_left(const struct diagnosis *d, const struct attainable_pole *pole,
                                const struct hypothesis *h)
{
    const double floor = d->attainable.noise_ratio, left = h->fitted.noise_ratio, without = pole->without_noise_ratio;
    return !(floor <= limits.as_well) ||
           !(without * without - floor * floor < limits.counts * (left * left - floor * floor));
}

bool diagnose_may_lack_mode(const struct diagnosis *d, const struct hypothesis *h)
{
    double mode_Hz[DIAGNOSE_MODES];
    bool taken[DIAGNOSE_MODES] = {false};
    size_t n_modes;
    struct bf_error ignored;
    if (!knows_modes(d, h) || diagnose_modes_in_band(d, &h->model, mode_Hz, &n_modes, &ignored) != BF_OK)
        return true;
    for (size_t k = 0; k < d->attainable.modes; k++) {
        const struct attainable_pole *pole = &d->attainable.poles[k];
        if (pole->frequency_Hz < beam_mode_limits.in_band * diagnose_band_Hz(d) &&
            diagnose_is_mode(d, pole->frequency_Hz, pole->damping_ratio) && may_be_what_is_left(d, pole, h) &&
            !take_mode(pole->frequency_Hz, mode_Hz, n_modes, taken))
            return true;
    }
    return false;
}
