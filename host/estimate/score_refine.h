/* SPDX-License-Identifier: GPL-3.0-or-later */
/* score_refine.h — a few Gauss–Newton steps of baseline and effect together; private to estimate/. */
#ifndef BEAMFIT_SCORE_REFINE_H
#define BEAMFIT_SCORE_REFINE_H

#include <pthread.h>

#include "score_base.h"

/* The lowest χ² of all refinements so far: what is far above it is given up. */
struct race {
    pthread_mutex_t lock;
    double lowest;
};
void race_begin(struct race *race);
void race_end(struct race *race);

/* The walks of one candidate; BF_USAGE: it has no score, BF_NUMERIC: no walk has a value at its start. */
enum bf_status refine_walks(const struct score_base *base, const struct candidate *candidate, int steps,
                            struct race *race, struct score *score, struct bf_error *err);

#endif
