/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * score.h — how much of a fitted baseline's misfit would each candidate explain, without refitting?
 *
 *     LM = (S̃ᵀP r̃)ᵀ (S̃ᵀP S̃)⁻¹ (S̃ᵀP r̃),   P = I − J̃ (J̃ᵀJ̃)⁻¹ J̃ᵀ
 *
 * r = z − ŷ(θ̂) and S = ∂ŷ/∂c weighted by the noise (and whitened by the channel's colour), J the baseline's Jacobian
 * with the rows of its priors, the free initial states of decays and unknown levels: P takes out what the baseline could
 * absorb (Rao's score test; Newey 1985 for the projection). Strengths that cannot be negative are held at 0 when the data
 * ask for less. Inner parameters (places, time constants, frequencies) are scanned and refined; effects whose response does
 * not begin linearly (a clamp that turns, saturation) get finite trials instead of the derivative.
 *
 * A score only short-lists: it is a linearisation at the baseline's optimum and misleads for strong effects. score_refine() takes
 * a few Gauss–Newton steps with everything free.
 */
#ifndef BEAMFIT_SCORE_H
#define BEAMFIT_SCORE_H

#include "candidate.h"
#include "response/predict.h"
#include "maths/residual.h"

struct score_options {
    const double *sigma;           /* [n_channels] noise rms in the order of predictor_channels(), > 0 */
    const struct ar_model *colour; /* [n_channels] of the noise in units of sigma; NULL: white */
    int threads;                   /* 0: one a processor */
    bool race; /* one refinement that comes down to the noise leaves the others their first walk only */
    bool laws; /* also candidates with a law (each stepped through time: slow); else they are skipped */
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
/* Σ (r/σ)² + Σ priors of the baseline, not whitened: what score.chi_square is to be compared with. */
double score_base_chi_square(const struct score_base *base);

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
    /* after score_refine() */
    bool refined;
    double chi_square; /* Σ (r/σ)² + Σ priors after the steps; NaN before */
    double *theta;     /* [n_theta] parameters of the refined candidate model */
    size_t n_theta;
    /* projected response, for cosines */
    size_t n_rows, rank;
    float *basis;  /* [rank][n_rows] orthonormal basis of P S̃ */
    double *along; /* [rank] the part that explains the residual, in that basis */
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
 * at most `steps` trust-region steps (0: 8) in each of two short windows e^(−s t), then twice as many over whole records; once
 * with small and once with large steps, and when both end above the baseline's misfit, over whole records from near the
 * baseline. The lowest end counts. Fills the refined part and replaces p. About 50 evaluations of the prediction each.
 * What cannot come within ten times the lowest χ² so far is not walked to its end; options.race: nor does anything walk again once one
 * candidate leaves no more than the noise. What failed, was interrupted or has no score is not `refined`.
 */
void score_refine_all(const struct score_base *base, const struct candidate candidates[], struct score scores[],
                      const size_t order[], size_t n, int steps);

/* The candidate's model at the score's start values (refined ones when there are), ready for a refit. */
enum bf_status score_model(const struct score_base *base, const struct candidate *candidate, const struct score *score,
                           struct model *out, struct bf_error *err);

/*
 * cosine[j + n·k] = how well candidate j could stand for the response of candidate k once the baseline has taken its part:
 * ‖basis_jᵀ d_k‖/‖d_k‖, 0 … 1; |cos| of the two projected directions when both have one strength. 1 on the diagonal of
 * possible ones, 0 where one is not possible. [n × n].
 */
void score_cosines(const struct score scores[], size_t n, double cosine[]);

#endif
