/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plausible.h — what is known of an effect's strength before any record. Private to explain/. */
#ifndef BEAMFIT_PLAUSIBLE_H
#define BEAMFIT_PLAUSIBLE_H

#include "explain.h"

/*
 * Nats ≥ 0 that the fitted values of a hypothesis cost, from their density before the records: a stiffness over the whole span against the beam's own
 * bending stiffness or its buckling load, a tone against the chance that it lies so near a pole of the beam. 0 for all others.
 */
double implausible_nats(const struct diagnosis *d, const struct hypothesis *h);

/* Standard deviations of its prior, which it must have, that a parameter is off by at this value. */
double sds_from_prior(const struct parameter *parameter, double value);

/* A mode's amplitude falls by a tenth and more within the longest record; a tone that does not is driven by something. */
bool diagnose_decays(const struct diagnosis *d, double frequency_Hz, double damping_ratio);

/* It has a tone, and a beam whose first bending mode is damped by more than any beam's. Cost: the modes of its beam, some milliseconds, where it has a tone. */
bool tone_replaces_mode(const struct hypothesis *h);

/*
 * One of its effects is, at its fitted values, a spring at a point that attracts (a magnet, or, nearly always, a stand-in for something else), a mass
 * that holds the beam, a drive's hysteresis without a loop, or a tone in the place of a mode.
 */
bool is_stand_in(const struct hypothesis *h);
/* Why it is one, for a person; NULL: it is none. */
const char *stand_in_reason(const struct hypothesis *h);

#endif
