/* SPDX-License-Identifier: GPL-3.0-or-later */
/* score_probe.h — one candidate's predictor, and the columns S of a point of its scan; private to estimate/. */
#ifndef BEAMFIT_SCORE_PROBE_H
#define BEAMFIT_SCORE_PROBE_H

#include "score_base.h"

/* One candidate's predictor, and the columns S of a point of its scan. */
struct probe {
    const struct score_base *base;
    const struct candidate *candidate;
    struct model model;
    struct predictor *predictor;
    size_t n_refs;
    struct parameter_ref *refs;
    double *theta;   /* [n_refs] */
    bool *want;      /* [n_refs] the strengths */
    size_t n_points; /* tried so far */
    size_t n_most;   /* columns, at most */
    double *work;    /* [n_rows] */
    bool at_states;  /* the last prediction was at the initial states that the baseline has */
};

/* What a column of S multiplies. */
struct probe_column {
    int slot;    /* parameter of the effect; −1: a limited parameter of the baseline */
    int record;  /* −1: all records; of a limited parameter: which */
    bool turned; /* of a sinusoid: cosine instead of sine */
};

enum bf_status probe_new(const struct score_base *base, const struct candidate *candidate, struct probe *out,
                         struct bf_error *err);
void probe_free(struct probe *probe);

/* The scan's value of a strength is a trial of finite size: δ = 1 is the trial itself. */
bool candidate_is_finite(const struct candidate *candidate, int slot);
bool candidate_is_sinusoid(const struct candidate *candidate);

/*
 * Columns at p[] (catalogue order): S[n][n_all] projected, what[n]; both hold up to probe->n_most. A column that the baseline absorbs
 * to within rounding is zero.
 */
enum bf_status probe_columns(struct probe *probe, const double p[], double S[], struct probe_column what[], size_t *n,
                             struct bf_error *err);

#endif
