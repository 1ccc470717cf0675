/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_resonator.h — what swings by itself, for those that fit it to the modes; private to explain/. */
#ifndef BEAMFIT_DIAGNOSE_RESONATOR_H
#define BEAMFIT_DIAGNOSE_RESONATOR_H

#include "diagnose_state.h"

/* A mode may be missing that no bending beam has: the records have more than the best explanation, and nothing in the model swings. */
bool resonator_may_be_there(const struct diagnosis *d);
/* The effect has a frequency of its own, the model has where it can act and none of it, and it is not left out. */
bool resonator_can_act(const struct diagnose_state *w, const struct beam_effect *effect);
/*
 * diagnose_resonator_start.c: `from` with the effect swinging at this frequency and, where it has one, this place; a clamp that gives begins to rock. part: its strength,
 * of the beam's mass, or of its flexibility. False: it does not go on this model. Free *out with model_free().
 */
bool resonator_begin(const struct model *from, const struct beam_effect *effect, double frequency_Hz, double at_m,
                     double part, struct model *out);
/* What its strength is a part of: the beam's mass, kg, or its flexibility ℓ/EI where it is the clamp that swings, rad/(N m). */
double resonator_whole(const struct beam_effect *effect, const struct model *model);
/* Of its loss, which of a clamp is a time. */
double resonator_damping_ratio(const struct beam_effect *effect, double loss, double frequency_Hz);
/* Drops explanations in which something swings that is no mode, or that does not stand out of the others. Ranks. */
void resonators_judge(struct diagnose_state *w);

#endif
