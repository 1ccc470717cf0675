/* SPDX-License-Identifier: GPL-3.0-or-later */
/* score_work.h — what the score_*.c files share; for nobody else. See score.h. */
#ifndef BEAMFIT_SCORE_WORK_H
#define BEAMFIT_SCORE_WORK_H

#include <pthread.h>

#include "estimate.h"
#include "score.h"

struct score_base {
    const struct model *model;
    const struct record *records;
    size_t n_records;
    struct score_options options;
    const char **names; /* [n_records] base names */
    size_t n_refs;
    struct parameter_ref *refs;
    double *theta; /* [n_refs] */
    size_t n_channels;
    struct predict_channel *channels;
    bool has_decay;
    double *levels;       /* [n_records] factor of the excitation */
    size_t n_rows, n_all; /* rows of data; with the rows of priors */
    double *weight;       /* [n_rows] 1/σ */
    double *fitted;       /* [n_rows] ŷ, unit of the channel */
    double *residual;     /* [n_all] P r̃ */
    size_t rank;          /* of what the baseline can absorb */
    double *absorbed;     /* [rank][n_all] orthonormal basis of it */
    double misfit;        /* ‖P r̃‖² */
    /*
     * Positive parameters that the misfit has driven to 0 (a damping): with a candidate they may come back. Not absorbed;
     * columns of their own, δ ≥ 0.
     */
    size_t n_limited;
    double *limited;     /* [n_limited][n_all] projected */
    double *start_theta; /* [n_refs] theta with these where they can be seen again: for starts of refits */
    double white_misfit; /* Σ (r/σ)² + Σ priors */
};

/* column[n_rows] in units of the channels -> out[n_all], weighted, whitened, projected; returns ‖out‖/‖before projection‖. */
double score_project(const struct score_base *base, const double column[], double out[]);

/* One candidate's predictor, and the columns S of a point of its scan. */
struct probe {
    const struct score_base *base;
    const struct candidate *candidate;
    struct model model;
    struct predictor *predictor;
    size_t n_refs;
    struct parameter_ref *refs;
    double *theta;     /* [n_refs] */
    bool *want;        /* [n_refs] the strengths */
    size_t n_points;   /* tried so far */
    size_t n_most;     /* columns, at most */
    double *work;      /* [n_rows] */
    double *amplitude; /* [n_nuisance] of free decays; NULL until they are solved */
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

/* ---- score_scan.c ---- */

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

/* ---- score_refine.c ---- */

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
