/* SPDX-License-Identifier: GPL-3.0-or-later */
/* score.h — private to estimate/: what its files share of score. */
#ifndef BEAMFIT_SCORE_PRIVATE_H
#define BEAMFIT_SCORE_PRIVATE_H

#include "estimate.h"

/* Σ (r/σ)² + Σ priors of the baseline, not whitened: what score.chi_square is to be compared with. */
double score_base_chi_square(const struct score_base *base);

/*
 * cosine[j + n·k] = how well candidate j could stand for the response of candidate k once the baseline has taken its part:
 * ‖basis_jᵀ d_k‖/‖d_k‖, 0 … 1; |cos| of the two projected directions when both have one strength. 1 on the diagonal of
 * possible ones, 0 where one is not possible. [n × n].
 */
void score_cosines(const struct score scores[], size_t n, double cosine[]);

#endif
