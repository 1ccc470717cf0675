/* SPDX-License-Identifier: GPL-3.0-or-later */
/* trial.h — private to estimate/: what its files share of trial. */
#ifndef BEAMFIT_TRIAL_PRIVATE_H
#define BEAMFIT_TRIAL_PRIVATE_H

#include "estimate.h"

/* true when the effect has a law and its trial is defined. */
bool trial_possible(const struct beam_effect *effect);

#endif
