/* SPDX-License-Identifier: GPL-3.0-or-later */
/* estimate_score.h — what could act on a model, and what each would explain; part of estimate.h */
#ifndef BEAMFIT_ESTIMATE_SCORE_H
#define BEAMFIT_ESTIMATE_SCORE_H

#include <stdbool.h>
#include <stddef.h>

#include "ground/ground.h"
#include "model/model.h"
#include "noise/noise.h"
#include "record/record.h"
#include "response/response.h"

/*
 * CANDIDATES — which effects of the catalogue could act on a model and its records, and where a scan of each would look. Told by the
 * roles and flags of an effect's parameters and by whether the model has the channels, the patch or the clamp that it needs.
 */

enum {
    CANDIDATE_GRID = 12, /* values of one parameter, at most */
    CANDIDATE_REASON = 160
};

/* What a scan does with a parameter. */
enum candidate_role {
    CANDIDATE_STRENGTH, /* the effect is absent at 0 and its response begins linearly there */
    CANDIDATE_INVERSE,  /* absent at infinity; the grid holds finite trials */
    CANDIDATE_INNER,    /* no influence while the strengths are neutral: scanned */
    CANDIDATE_PHASE,    /* angle of a sinusoid, one for each record: sine and cosine instead */
    CANDIDATE_KEPT      /* stays at the catalogue's start */
};

struct candidate {
    const struct beam_effect *effect;
    char channel[MODEL_NAME]; /* "" for the effect's default channels */
    bool nonlinear;           /* has a law or a drive: a prediction steps through time */
    int strength;             /* index of the first parameter that is a strength or inverse strength */
    enum candidate_role role[BEAM_EFFECT_PARAMETERS];
    size_t n_grid[BEAM_EFFECT_PARAMETERS]; /* of INNER and INVERSE parameters; 0 for the others */
    double grid[BEAM_EFFECT_PARAMETERS][CANDIDATE_GRID];
    double start[BEAM_EFFECT_PARAMETERS]; /* catalogue's start values, SI (places in metres) */
    double lower[BEAM_EFFECT_PARAMETERS], upper[BEAM_EFFECT_PARAMETERS]; /* physical range, SI */
};

struct candidate_options {
    const char *const *without; /* [n_without] ids that are not considered */
    size_t n_without;
    bool each_channel; /* also one candidate for each single channel of a measurement-chain effect */
    /*
     * [n_lines] frequencies at which the residual has lines (Hz): a sinusoid is looked for there and near 50 and 60 Hz.
     * 0 lines: at the mains' frequencies and the catalogue's start only.
     */
    const double *line_Hz;
    size_t n_lines;
};

/* A catalogue entry that was left out, and why in words. */
struct candidate_refusal {
    const struct beam_effect *effect;
    char reason[CANDIDATE_REASON];
};

struct candidate_list {
    size_t n;
    struct candidate *candidates; /* in alphabetical order of id, default channels first */
    size_t n_refused;
    struct candidate_refusal *refused;
};

/*
 * Grids, by enum beam_role: places at twelfths of the length within the effect's range; times from dt to the longest
 * record; frequencies as in the options; levels of a channel relative to its largest value; anything else on a
 * logarithmic scale about the catalogue's start. BF_USAGE: an id of `without` is unknown. options may be NULL.
 */
enum bf_status candidate_list_new(const struct model *model, const struct record records[], size_t n_records,
                                  const struct candidate_options *options, struct candidate_list *out,
                                  struct bf_error *err);
void candidate_list_free(struct candidate_list *list);

/*
 * The model with the effect appended: its parameters at p[] (catalogue order, SI), all of them free but KEPT ones, places
 * included. Free *out with model_free(). BF_USAGE: the model refuses these values.
 */
enum bf_status candidate_model(const struct model *base, const struct candidate *candidate, const double p[],
                               struct model *out, struct bf_error *err);

/*
 * SCORE — how much of a fitted baseline's misfit would each candidate explain, without refitting? Rao's score test, with everything that
 * the baseline could absorb projected out (score_base.h); inner parameters (places, time constants, frequencies) are scanned. A score is a
 * linearisation at the baseline's optimum and misleads for strong effects, so it only short-lists: score_refine_all() takes a few
 * Gauss–Newton steps with everything free.
 */

struct score_options {
    const double *sigma;           /* [n_channels] noise rms in the order of predictor_channels(), > 0 */
    const struct ar_model *colour; /* [n_channels] of the noise in units of sigma; NULL: white */
    int threads;                   /* 0: one a processor */
    bool stop_at_noise; /* once one refinement comes down to the noise, the others stop after their first descent */
    bool laws;          /* also candidates with a law (each stepped through time: slow); else they are skipped */
    bool (*interrupted)(void *context); /* asked between candidates; NULL: Ctrl-C only */
    void *context;
    struct predict_options predict; /* its threads are ignored */
};

/* The baseline at its optimum: residual, Jacobian, projection. Shared by all threads, read only. */
struct score_base;

/* Model, records and the option's arrays must outlive the base. Cost: two evaluations of the prediction. */
enum bf_status score_base_new(const struct model *model, const struct record records[], size_t n_records,
                              const struct score_options *options, struct score_base **out, struct bf_error *err);
void score_base_free(struct score_base *base);

/* ‖P r̃‖² and the number of rows less the rank of the projection: what it would be without anything missing. */
double score_base_misfit(const struct score_base *base, double *degrees_of_freedom);

struct score {
    bool possible;                    /* false: see reason; nothing else is filled */
    char reason[CANDIDATE_REASON];    /* one sentence without a full stop; "" when possible */
    double p[BEAM_EFFECT_PARAMETERS]; /* start values for a refit, catalogue order, SI, inside the physical range */
    double *per_record; /* [n_records] values of the PHASE or per-record strength, NULL when there is none */
    double estimate;    /* of the strength by one step, also when outside its range; 1/p for an inverse one */
    double estimate_sd; /* its standard error, baseline free; NaN for sinusoids */
    double LM;          /* ≥ 0; in units of the noise */
    int dof;            /* strengths that are not held at 0 */
    size_t n_tried;     /* points of the scan */
    double p_value;     /* of LM over the remaining misfit's variance, χ² with one-sided strengths, times n_tried */
    double explained;   /* LM over the misfit in excess of the noise, 0 … 1 (0 where there is no excess) */
    /* after score_refine_all() */
    bool refined;
    double chi_square; /* Σ (r/σ)² + Σ priors after the steps; NaN before */
    double *theta;     /* [n_theta] parameters of the refined candidate model */
    size_t n_theta;
};

/*
 * scores: [n], free each with score_free(). A candidate that cannot be predicted is not an error: possible is false. Ctrl-C leaves
 * the rest not possible with reason "interrupted". Cost of a linear candidate: one evaluation of the prediction for each
 * point of its grid, about 3 ms for 4 records of 4096 samples.
 */
void score_run(const struct score_base *base, const struct candidate candidates[], size_t n, struct score scores[]);
void score_free(struct score *score);

/* Indices of the possible ones, best LM first (of equal ones the effect with fewer parameters); returns how many. */
size_t score_rank(const struct candidate candidates[], const struct score scores[], size_t n, size_t order[]);

/*
 * Refines scores[order[0 … n − 1]], best first, on the threads of the options: baseline and effect together from the score's start,
 * at most `steps` trust-region steps (0: 8) in each window (score_refine.h). Fills the refined part and replaces p. What failed, was
 * interrupted or has no score is not `refined`. Cost: about 50 evaluations of the prediction each.
 */
void score_refine_all(const struct score_base *base, const struct candidate candidates[], struct score scores[],
                      const size_t order[], size_t n, int steps);

/* The candidate's model at the score's start values (refined ones when there are), ready for a refit. */
enum bf_status score_model(const struct score_base *base, const struct candidate *candidate, const struct score *score,
                           struct model *out, struct bf_error *err);

#endif
