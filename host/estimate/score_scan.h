/* SPDX-License-Identifier: GPL-3.0-or-later */
/* score_scan.h — the scan of one candidate: the best combination of its columns; private to estimate/. */
#ifndef BEAMFIT_SCORE_SCAN_H
#define BEAMFIT_SCORE_SCAN_H

#include "score_probe.h"

/* The best combination of the columns at one point. */
struct answer {
    double LM;
    double p[BEAM_EFFECT_PARAMETERS];
    size_t n; /* columns */
    struct probe_column *what;
    double *S;     /* [n][n_all] */
    double *delta; /* [n] their coefficients */
    bool *held;    /* [n] δ stays at a bound */
    size_t rank;
    double *Q;     /* [rank][n_all] basis of the free columns */
    double *along; /* [rank] Qᵀ r */
};

void answer_new(const struct probe *probe, struct answer *a);
void answer_free(struct answer *a);
/* Range of δ of a column at p[]; 0 is in it. */
void answer_range(const struct probe *probe, const struct probe_column *what, const double p[], double *low,
                  double *high);
/* best: the best point of the grid and about it; now: scratch. Both as answer_new() leaves them. */
enum bf_status probe_scan(struct probe *probe, struct answer *now, struct answer *best, struct bf_error *err);

#endif
