/* SPDX-License-Identifier: GPL-3.0-or-later */
/* effect_kind.h — kinds of effects by the price of judging one; private to explain/. */
#ifndef BEAMFIT_EFFECT_KIND_H
#define BEAMFIT_EFFECT_KIND_H

#include <stdbool.h>

#include "beam.h"

/* In the order of their price. */
enum effect_kind {
    KIND_LINEAR,          /* terms, filters, signals, places */
    KIND_NONLINEAR_CHAIN, /* drives and sensors that are not linear: still no step through time */
    KIND_LAW              /* forces that are not linear */
};
enum effect_kind effect_kind(const struct beam_effect *effect);

/* Of an effect with a law: f(2w, 2v) = 2 f(w, v). Records of two levels do not show it (a breathing crack, a stiffness that drifts). */
bool effect_law_is_of_degree_one(const struct beam_effect *effect);

#endif
