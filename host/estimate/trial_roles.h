/* SPDX-License-Identifier: GPL-3.0-or-later */
/* trial_roles.h — what the parameters of an effect are to its trial, told from the catalogue; private to estimate/. */
#ifndef BEAMFIT_TRIAL_ROLES_H
#define BEAMFIT_TRIAL_ROLES_H

#include "trial_force.h"

/* true when the effect has a law and its trial is defined. */
bool trial_possible(const struct beam_effect *effect);

/* What each parameter is to the trial. */
struct trial_roles {
    int strength;                                  /* the force is linear in it */
    bool with_strength[BEAM_EFFECT_PARAMETERS];    /* the strength and levels of force: scaled together */
    int position;                                  /* −1: none */
    int n_inner, inner[BEAM_EFFECT_PARAMETERS];    /* scanned, the position left out */
    enum beam_level scale[BEAM_EFFECT_PARAMETERS]; /* what an inner parameter is compared with */
};
enum bf_status trial_roles(const struct trial_force *force, struct trial_roles *out, struct bf_error *err);
/* The quantity that inner parameter `slot` is compared with, at the place in use; its start for BEAM_LEVEL_OWN. */
double trial_unit(const struct trial_force *force, const struct trial_roles *roles, int slot);

#endif
