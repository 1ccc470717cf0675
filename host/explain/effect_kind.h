/* SPDX-License-Identifier: GPL-3.0-or-later */
/* effect_kind.h — kinds of effects by the price of judging one; private to explain/. */
#ifndef BEAMFIT_EFFECT_KIND_H
#define BEAMFIT_EFFECT_KIND_H

#include "beam.h"

/* In the order of their price. */
enum effect_kind {
    KIND_LINEAR,          /* terms, filters, signals, places */
    KIND_NONLINEAR_CHAIN, /* drives and sensors that are not linear: still no step through time */
    KIND_LAW              /* forces that are not linear */
};
enum effect_kind effect_kind(const struct beam_effect *effect);

#endif
