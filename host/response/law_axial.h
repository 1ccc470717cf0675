/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * law_axial.h — the inertia of a beam that large rotation shortens; called by law_force.c and nobody else.
 *
 * An inextensible beam moves along itself by u = −½ ∫₀ˣ y'² ds. Of the kinetic energy ½ κ ∫ ρ u_t² dx the coordinates w of
 * a law over the span feel, with G_ij(x) = ∫₀ˣ φ_i' φ_j' ds (law->shortening),
 *     f = κ ∫ ρ (v·G v + a·G w) G w dx,   v = w', a = w″.
 */
#ifndef BEAMFIT_LAW_AXIAL_H
#define BEAMFIT_LAW_AXIAL_H

#include "response.h"
#include "law.h"

/* Adds the force and its tangents, as law_force(). 0, or −1 out of range. About 5 d² multiply-adds a point; tangents 4 d². */
int law_axial_add(const struct law_prepared *prepared, const struct law_motion *motion, bool tangents, bool derivatives,
                  struct law_force *out);

#endif
