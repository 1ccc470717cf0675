/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_relatives.h — what hypotheses have in common; private to explain/ */
#ifndef BEAMFIT_DIAGNOSE_RELATIVES_H
#define BEAMFIT_DIAGNOSE_RELATIVES_H

#include "diagnose_state.h"

/* This effect is one of those that it adds to the baseline. */
bool hypothesis_has(const struct hypothesis *h, const struct beam_effect *effect);
/* The first parameter of this role; -1: the effect has none. */
int effect_slot(const struct beam_effect *effect, enum beam_role role);
/* Its own frequency is free, so that it is one mode more (a support that rocks; something on the beam that swings). */
bool effect_swings(const struct model_effect *own);
/* The effect is among those that the hypothesis adds, and swings there. */
bool hypothesis_swings(const struct hypothesis *h, const struct beam_effect *effect);
/* The terms of `small` are those of `large` with some parameters neutral or a place at the free end. */
bool diagnose_special_case(const struct beam_effect *small, const struct beam_effect *large, const struct model *model);
/* The same effect, or one a special case of the other (a tip mass is a point mass): neither speaks against the other. */
bool diagnose_is_kin(const struct beam_effect *one, const struct beam_effect *other, const struct model *model);
/*
 * A mass or a spring at one point whose place is free: with place and strength it follows much of what an uneven beam, or another linear cause,
 * does to a few modes.
 */
bool diagnose_follows_much(const struct beam_effect *effect, const struct model *model);
/* Of these, a mass. */
bool diagnose_is_mass(const struct beam_effect *effect, const struct model *model);
/* Of an effect with one parameter: a mass as heavy as the beam, a tension as large as its buckling load between pins; 0: it is neither. */
double diagnose_large_strength(const struct beam_effect *effect, const struct model *model);
/* A spring that holds the beam as a rigid support does, N/m: its place is all that the records tell. */
double diagnose_rigid_Npm(const struct model *model);
/* The effect is among those that the hypothesis adds, and a spring as stiff there. */
bool hypothesis_has_support(const struct hypothesis *h, const struct beam_effect *effect);
/* It has such a spring, whose stiffness no fit changes. */
bool hypothesis_support_is_held(const struct hypothesis *h);
/* It acts at a point, at the clamp, or along the axis: what somebody screws on, moves or tightens between two records. */
bool diagnose_can_be_changed(const struct beam_effect *effect, const struct model *model);

/* It has no more effects than the decision allows, and all that are taken to be there. */
bool decision_looks_at(const struct hypothesis *h, const struct decision *one);
/*
 * A stand-in (a spring that attracts, a hysteresis without a loop: is_stand_in()) is no explanation, and speaks against another one only where it is
 * better than that. What the damper, its special case, explains is asked for without it.
 */
bool decision_asks_for(const struct hypothesis *h, const struct decision *one);

#endif
