/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_presence.h — which effects are there, and how sure that is; private to explain/ */
#ifndef BEAMFIT_DIAGNOSE_PRESENCE_H
#define BEAMFIT_DIAGNOSE_PRESENCE_H

#include "diagnose_state.h"

/*
 * d->decisions: for each effect of the best explanation, and of the best single effect, the probability that it is there, that it or its
 * strongest rival is, and so on; and the probability of each hypothesis: that all its effects are there. After diagnose_rank().
 */
void diagnose_weigh_presence(struct diagnosis *d);
/* The best explanation without these effects is as good as the best with one of them: the records do not tell. */
bool diagnose_is_open(const struct diagnosis *d, const struct decision *one);

#endif
