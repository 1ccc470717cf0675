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

/* A mode's amplitude falls by a tenth and more within the longest record; a tone that does not is driven by something. */
bool diagnose_decays(const struct diagnosis *d, double frequency_Hz, double damping_ratio);

/*
 * One of its effects is, at its fitted values, a spring at a point that attracts (a magnet, or, nearly always, a stand-in for something else), a mass
 * that holds the beam, or a drive's hysteresis without a loop.
 */
bool is_stand_in(const struct hypothesis *h);
/* Why it is one, for a person; NULL: it is none. */
const char *stand_in_reason(const struct hypothesis *h);

#endif
