/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_relatives.h — explanations that are special cases of others; private to explain/ */
#ifndef BEAMFIT_DIAGNOSE_RELATIVES_H
#define BEAMFIT_DIAGNOSE_RELATIVES_H

#include "diagnose_state.h"

/* `large` has every effect of `small`, and more. */
bool diagnose_contains(const struct hypothesis *large, const struct hypothesis *small);
/* The terms of `small` are those of `large` with some parameters neutral or a place at the free end. */
bool diagnose_special_case(const struct beam_effect *small, const struct beam_effect *large, const struct model *model);
/* Both are the same but for effects of which one is a special case of the other: a tip mass is a point mass at the free end. */
bool diagnose_same_family(const struct diagnosis *d, const struct hypothesis *a, const struct hypothesis *b);

#endif
