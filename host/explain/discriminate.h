/* SPDX-License-Identifier: GPL-3.0-or-later */
/* discriminate.h — private to explain/: what its files share of discriminate. */
#ifndef BEAMFIT_DISCRIMINATE_PRIVATE_H
#define BEAMFIT_DISCRIMINATE_PRIVATE_H

#include "explain.h"

/* Evidence (2 log of the likelihood ratio) from which one of two models is believed: 'very strong', Kass & Raftery 1995. */
extern const double discriminate_decisive;

/* An added sensor is proposed when it multiplies the evidence at least so much: another sensor costs an afternoon. */
extern const double discriminate_sensor_worth;

#endif
