/* SPDX-License-Identifier: GPL-3.0-or-later */
/* score_refine.h — a few Gauss–Newton steps of baseline and effect together; private to estimate/. */
#ifndef BEAMFIT_SCORE_REFINE_H
#define BEAMFIT_SCORE_REFINE_H

#include <pthread.h>

#include "score_base.h"

/* The lowest χ² of all refinements so far, shared by all threads: a refinement far above it is given up. */
struct lowest_misfit {
    pthread_mutex_t lock;
    double lowest;
};
void lowest_begin(struct lowest_misfit *lowest);
void lowest_end(struct lowest_misfit *lowest);

/*
 * Refines one candidate: steps in two short windows e^(−s t), then twice as many over whole records; once with small and once with large
 * steps. When both end above the baseline's misfit, over whole records from a tenth of the strength, and on a weak misfit from the
 * catalogue's start. The lowest end counts; what cannot come within ten times the lowest χ² so far is given up. BF_USAGE: the candidate
 * has no score, BF_NUMERIC: no start has a value.
 */
enum bf_status score_descend(const struct score_base *base, const struct candidate *candidate, int steps,
                             struct lowest_misfit *lowest, struct score *score, struct bf_error *err);

#endif
