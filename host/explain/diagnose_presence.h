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
/* diagnose_features.c: one->feature and one->probability of one->with against one->without. */
void diagnose_fill_features(const struct diagnosis *d, struct decision *one);
/* diagnose_features.c: of the misfit's power, the share that an explanation takes, of the fitted or the held-out records, whichever is less: 0 ... 1. */
double diagnose_share_taken(const struct hypothesis *h);
/* The best explanation without these effects is as good as the best with one of them: the records do not tell. */
bool diagnose_is_open(const struct diagnosis *d, const struct decision *one);

/*
 * diagnose_simplest.c: the explanation to name for one of index `named`: itself, or the same with a special case of one of its effects (a damper is a spring
 * without stiffness), where what the general form takes more is less than what an effect that is not there takes of the whole misfit:
 * evidence counts ratios, so a stand-in would gain as much of what the special case leaves.
 */
size_t diagnose_simplest(const struct diagnosis *d, size_t named);

#endif
