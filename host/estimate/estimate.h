/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * estimate.h — records + model -> parameters with standard errors; what an effect more would explain.
 *
 * fit_run() poses a weighted least-squares problem in the model's free parameters, finds starts for it, searches from them through
 * windows that grow to whole records, and returns values with standard errors and with what the records cannot determine
 * (docs/estimation.md). fit_errors() judges a model on records that were not fitted, own_values_find() estimates what belongs to
 * such a record alone, fit_finer() tells the error of the computation. The rest is for a caller that compares many models (host/explain):
 * candidate_list_new() lists the effects that could act, score_run() and trial_all() tell cheaply what each would explain of a fitted
 * baseline's residual and where a fit of it should start, refit_run() fits one of them, and reconstruct_run() describes the missing force
 * when none fits. Units are SI. What a call fills is freed with the function named at it.
 */
#ifndef BEAMFIT_ESTIMATE_H
#define BEAMFIT_ESTIMATE_H

#include <stdbool.h>
#include <stdio.h>

#include "ground/ground.h"
#include "maths/maths.h"
#include "model/model.h"
#include "noise/noise.h"
#include "record/record.h"
#include "response/response.h"

/* FIT — model + records -> parameter values with standard errors, and whether the search ended at an optimum. */

enum fit_start {
    FIT_GIVEN, /* from the model's values through windows that grow; a global search when that misses the noise floor */
    FIT_NEAR,  /* the model's values are near the optimum: whole records at once */
    FIT_SEARCH /* windows and global search in any case */
};

struct fit_shares;

struct fit_options {
    enum fit_start start;
    bool never_search; /* no global search, even when the noise floor is missed */
    bool quiet;        /* no progress bar */
    size_t most_runs;  /* evaluations of the prediction, after which the best so far is told; 0: as many as it takes */
    const double *sigma; /* noise rms per channel in the order of predictor_channels(); NULL: estimated */
    struct predict_options predict;
    const struct fit_shares *shares; /* who has the samples, see SHARES; NULL: the records do */
};

/* One output of one record. */
struct fit_channel_error {
    size_t record;
    char name[MODEL_NAME];
    size_t n;           /* rows compared */
    bool cut;           /* the rest of the record cannot be predicted */
    double noise;       /* rms of the noise, unit of the channel; 0: unknown */
    double nrmse;       /* ‖z − ŷ‖/‖z‖ */
    double noise_ratio; /* rms(z − ŷ)/noise; NaN when the noise is unknown */
    double hum_ratio;   /* the same of what mains_power() finds in z − ŷ; 0: nothing, or it was not looked for */
};

struct fit_parameter {
    char label[MODEL_NAME + 64];
    char unit[24];
    double start, value;
    double sd;      /* one standard error, physical unit; NaN when held or not identifiable */
    double ci95[2]; /* NaN likewise */
    bool estimated; /* false: held */
    bool identifiable;
    bool logarithmic;
    bool at_bound;
    bool remainder; /* of the modes above the model's: what the rest leaves, no parameter of the beam */
};

/* A minimum that the search found and did not choose. */
struct fit_minimum {
    double noise_ratio;
    double *value; /* [n_parameters] */
};

/*
 * Which combinations of parameters the records determine, from the singular values of the weighted Jacobian J (rows in units of the
 * noise, columns by ln θ or θ/scale): a direction v with ‖J v‖ < 1 can move by 100 % without leaving the noise. Computed from the data
 * alone, and again with the priors.
 */
struct null_direction {
    double ratio;   /* singular value over the largest one; below 1e-9 it is zero to rounding */
    double *weight; /* [n] unit 2-norm, largest element positive; d ln θ (or dθ/scale) along the direction */
    bool pinned;    /* a prior determines it to better than 100 % */
};

struct identifiability {
    size_t n;
    double *singular;  /* [n] descending, of the data rows */
    double *posterior; /* [n] descending, of data and prior rows */
    double *V;         /* [n × n] right singular vectors of data and prior rows, columns */
    size_t kept;       /* leading columns of V that are above rounding: the space in which covariances exist */
    bool *determined;  /* [n] by data and priors, to better than 100 % */
    size_t n_null;
    struct null_direction *null;
};

struct fit_result {
    size_t n_parameters; /* order of model_parameters() */
    struct fit_parameter *parameters;
    size_t n_records;
    char **names;  /* [n_records] as the model names them (per-record values) */
    double *level; /* [n_records] factor of the excitation; 1 where it is known */
    size_t n_channels;
    struct fit_channel_error *channels;
    double nrmse, noise_ratio;              /* root mean square over channels */
    double noise_doubt;                     /* two standard errors of noise_ratio by those of the noise's levels */
    struct attainable attainable;           /* filled by the caller that wants it, else no modes */
    struct identifiability identifiability; /* in the unknowns, see unknown[] */
    size_t *unknown;                        /* [identifiability.n] index into parameters */
    double *covariance; /* [identifiability.n²] of the unknowns: of ln θ where logarithmic, else of θ */
    bool converged;
    double distance;    /* from the optimum, in standard errors, as the gradient tells it */
    double polish_gain; /* what NLopt's polish still found, in ½χ² */
    bool interrupted, searched;
    size_t n_minima;
    struct fit_minimum *minima;
    size_t evaluations; /* of the prediction */
    double seconds;
    enum intersample intersample;
    int steps_per_sample; /* that the laws needed, for the model; 0: as the model says */
    size_t n_warnings;
    char **warnings; /* one sentence each */
};

/*
 * Fits the model's free parameters to the records. The model is not changed. Ctrl-C (progress_catch_interrupts()) ends
 * the search early with the best so far, interrupted = true and converged = false. Free with fit_free().
 * BF_BAD_FILE: no usable channel; BF_NUMERIC: no value at the start.
 */
enum bf_status fit_run(const struct model *model, const struct record records[], size_t n_records,
                       const struct fit_options *options, struct fit_result *out, struct bf_error *err);
void fit_free(struct fit_result *result);

/*
 * False when parameters were free and the records say nothing of any combination of them (priors set aside), or all of the beam's
 * ended at bounds.
 */
bool fit_learned(const struct fit_result *result);

/*
 * One direction in words for a person: which parameters move together or against each other, and what would fix it.
 * labels: [n]. Returns a string to free().
 */
char *identifiability_text(size_t n, const char *const labels[], const struct null_direction *direction);

/*
 * SHARES — one fit of more records than one memory or one processor is for.
 *
 * The records are dealt out in shares of some each. A share answers questions about its records: the window is this; the reduced space is to be made at this θ;
 * what is ½‖r‖², what are R of [J r] and the coloured square there, what are the channels' errors. The stages of a fit, its optimiser, identifiability and
 * intervals are those of fit_run() with options.shares, which combines answers in the order of shares: the numbers do not depend on where a share is.
 * Questions and answers are bytes, for programs of one build. Of linear models that are the same in all records.
 */

struct fit_message {
    size_t n;
    unsigned char *bytes;
};

struct fit_share;

/* The model and the records are borrowed; options: sigma is NULL. To be freed also after a failure. */
enum bf_status fit_share_new(const struct model *model, const struct record records[], size_t n_records,
                             const struct fit_options *options, struct fit_share **out, struct bf_error *err);
void fit_share_free(struct fit_share *share);
/* answer->bytes to be freed; a failure is an answer. Shares may answer at once, each one question at a time. */
void fit_share_answer(struct fit_share *share, const struct fit_message *question, struct fit_message *answer);

struct fit_shares {
    size_t n;
    /* Asks every share; answers[n] in their order, to be freed also after a failure (NULL where there is none). */
    enum bf_status (*ask)(void *context, const struct fit_message *question, struct fit_message answers[],
                          struct bf_error *err);
    void *context;
    /* what fit_shares_open() was told */
    size_t n_records;
    struct record
        *records; /* [n_records] path, checksum and times, no columns: those that fit_run() and fit_into_model() take */
    struct fit_drive *drives;
    double *scale; /* [n_parameters] that the data tell */
};

/* Fills the rest of *shares; fit_shares_close() also after a failure. */
enum bf_status fit_shares_open(struct fit_shares *shares, const struct model *model, struct bf_error *err);
void fit_shares_close(struct fit_shares *shares);

/* ERRORS — a model on records that it was not fitted to, and the fitted model. */

/*
 * Errors per channel; states of free decays and unknown levels are still solved for. With a nonlinear effect the rows that no model can
 * predict (see refit_result.horizon_s) are left out: n of a channel is then less than the record's. Caller frees *channels.
 */
enum bf_status fit_errors(const struct model *model, const struct record records[], size_t n_records,
                          const struct fit_options *options, struct fit_channel_error **channels, size_t *n_channels,
                          struct bf_error *err);

/* Root mean square over channels of nrmse and noise_ratio. */
void fit_totals(const struct fit_channel_error channels[], size_t n, double *nrmse, double *noise_ratio);

/* Records held out: what they are and the model's errors on them (n 0: none). */
struct fit_check {
    const struct record *records;
    size_t n;
    const struct fit_channel_error *channels;
    size_t n_channels;
    size_t n_notes; /* what was estimated from the records themselves (own_values_find()) */
    char *const *notes;
};

/* One response of a spectrum without phase, measured and of a model. */
struct line_spectrum {
    char name[MODEL_NAME], input[MODEL_NAME]; /* output over input */
    size_t n;
    double *frequency_Hz, *measured, *predicted; /* [n] |H| */
    double *sd;                                  /* [n] standard error of `measured` */
    bool stated;                                 /* by coherence and averages; false: told from neighbouring lines */
};

/* record: of RECORD_MAGNITUDES. (*out)[*n]: outputs that the model has. BF_BAD_FILE: none. Free with line_spectra_free(). */
enum bf_status fit_line_spectra(const struct model *model, const struct record *record,
                                const struct predict_options *options, struct line_spectrum **out, size_t *n,
                                struct bf_error *err);
void line_spectra_free(struct line_spectrum spectra[], size_t n);

/* Writes values, standard errors and the `fit:` block into the model; records are those of fit_run(). */
void fit_into_model(const struct fit_result *result, const struct record records[], const struct fit_check *check,
                    struct model *model);

/*
 * OWN VALUES — values that belong to one record alone (BEAM_PARAMETER_PER_RECORD: a hum's phase, where the hammer
 * struck) for records that were not fitted: without them a held-out record cannot be judged.
 */

struct own_values {
    const struct model *model; /* the model given, or the copy that holds the estimates too */
    struct model *copy;        /* NULL: nothing was missing */
    size_t n_notes;
    char **notes; /* one sentence per estimate, without its full stop */
};

/*
 * Estimates, by least squares on each record alone with every other parameter held, the per-record parameters of which
 * the model has no value for that record. Parameters held in the model, and those that the record does not determine,
 * stay. The model is not changed and must outlive *out. Free with own_values_free(), also after a failure.
 * Cost: three short fits in few unknowns per record; nothing when no value is missing.
 */
enum bf_status own_values_find(const struct model *model, const struct record records[], size_t n_records,
                               const struct fit_options *options, struct own_values *out, struct bf_error *err);
void own_values_free(struct own_values *own);

/* FINER — a fitted model predicted once more, twice as finely: how large is the error of the computation? */

struct finer_prediction {
    size_t n_channels;                /* order of predictor_channels() */
    struct predict_channel *channels; /* [n_channels] */
    double *fitted;                   /* stacked rows, linear unknowns solved again */
    size_t runs;                      /* evaluations of the prediction */
};

/* The records as the model predicts them with these options; the rest as fit_finer(). */
enum bf_status fit_predict(const struct model *model, const struct record records[], size_t n_records,
                           const struct fit_options *options, const double theta[], struct finer_prediction *out,
                           struct bf_error *err);

/* options become those of fit_finer(). */
enum bf_status predict_finer(const struct model *model, const struct record records[], size_t n_records,
                             struct predict_options *options, struct bf_error *err);

/*
 * Twice the modes and fine splines and, where a law steps through time, half the step. theta: in the order of
 * model_parameters(); options: sigma must be given. BF_NUMERIC: no value in the finer space. Free with
 * finer_prediction_free(), also after a failure. Cost: two predictors and one prediction.
 */
enum bf_status fit_finer(const struct model *model, const struct record records[], size_t n_records,
                         const struct fit_options *options, const double theta[], struct finer_prediction *out,
                         struct bf_error *err);
void finer_prediction_free(struct finer_prediction *finer);

/*
 * Steps a sample that the model's laws need at theta, at most MODEL_STEPS_MOST: doubled until the prediction changes, before horizon_s
 * (seconds from the first row of each record; NULL: everywhere), by less than a tenth of what it leaves and of the noise. Kinks of friction
 * and contact are resolved slowly: half the step may change 1 % where the change is 0.1 % at the step before. Does nothing (*steps 0)
 * without a law or where options.predict.oversample is given. Cost: one prediction for each number of steps.
 */
enum bf_status fit_steps(const struct model *model, const struct record records[], size_t n_records,
                         const struct fit_options *options, const double theta[], const double horizon_s[], int *steps,
                         struct bf_error *err);

/*
 * REFIT — one candidate model fitted to records, silently, from a baseline that is already fitted; the noise is given.
 *
 * New effects (those from options.first_new on) have starts of their own (refit_search.h). Their places are estimated, although a fit
 * would hold them; a place or threshold of an effect whose strength is not significant has no standard error. Thread-safe: two refits
 * may run at once (records, model and sigma are only read; they must outlive the call).
 */

/*
 * With options.known_sd a value keeps what it has when its standard error here is more than this many times the known one. One that
 * grows k times when n rows are left out adds (k² − 1)/n to the power of the noise where those rows are predicted: 0.3 % of the rms with
 * 5 and 4096 rows.
 */
#define REFIT_WEAK 5.0

struct refit_options {
    const double *sigma;  /* noise rms per channel in the order of predictor_channels(), > 0; unit of the channel */
    int threads;          /* for records of nonlinear models; 0: 1 */
    double abandon_above; /* χ²/n: stop when ten more steps like the next would not get below it; 0: never */
    double raise_below;   /* χ²/n: what leaves less is fitted again with vanished dampings restored; 0: nothing is */
    size_t most_runs; /* evaluations of the prediction, after which it ends as interrupted; 0: as many as it takes */
    bool quick;       /* best start, few steps: good enough to rank, not for values; sd is NaN */
    bool near;        /* the model's values are near the optimum: whole records at once, no other start; sd is NaN */
    bool errors;      /* with near: standard errors too */
    const double *
        known_sd; /* [n_parameters] with near: standard errors of the values, see REFIT_WEAK; NULL: all are estimated */
    size_t first_new; /* effects of the model before this index hold fitted values and have no starts of their own */
    size_t n_starts;  /* further starts, on whole records at once where one is below what the search has come to */
    const double *starts;               /* [n_starts][n_parameters], order of model_parameters() */
    bool (*interrupted)(void *context); /* asked before every evaluation; NULL: Ctrl-C only */
    void *context;
    struct predict_options predict; /* its threads are ignored */
};

struct refit_result {
    size_t n_parameters; /* order of model_parameters(model, base names of the records) */
    double *value;       /* [n_parameters] */
    double *sd;      /* [n_parameters] one standard error, physical unit; NaN when held, not identifiable, or quick */
    bool *estimated; /* [n_parameters] false: held */
    bool *at_bound;  /* [n_parameters] */
    size_t n_records;
    double *level;       /* [n_records] factor of the excitation; 1 where it is known */
    double half_square;  /* ½ Σ (r/σ)² + ½ Σ priors */
    double chi2_per_row; /* Σ (r/σ)² / n_used */
    double noise_ratio;  /* root mean square over channels of rms(r)/σ, rows in use */
    double *horizon_s;   /* [n_records] since the first row: rows from here on cannot be predicted ; ∞ */
    size_t n_used;       /* rows before the horizons */
    size_t n_unknowns;   /* estimated parameters; linear unknowns of free decays not counted */
    size_t n_rows;
    double
        *residual; /* [n_rows] z − ŷ, stacked channel by channel, unit of the channel; all rows, also those left out */
    size_t n_channels;
    struct predict_channel *channels; /* [n_channels] where each stands in residual */
    /*
     * Nonlinear models: the time constant of the longest window e^(−t/τ) from the onset in which 2 % of the signal is all that
     * is missing; 0: none. An impact or a jump between branches makes a long record unpredictable for the right model too.
     */
    double explained_s;
    bool converged; /* within a tenth of a standard error of a stationary point */
    bool abandoned, interrupted;
    double distance; /* from the stationary point in standard errors, as the gradient tells it */
    size_t n_starts; /* that were tried */
    size_t evaluations;
    double seconds;
};

/*
 * The model's values are a start too, unless a trial explains the records; the model is not changed. Free *out with refit_free(), also after a failure.
 * BF_BAD_FILE: no usable channel; BF_NUMERIC: no start has a value; BF_USAGE: an effect that cannot be predicted.
 * Cost: about 30 evaluations of the prediction for a linear effect without inner parameters.
 */
enum bf_status refit_run(const struct model *model, const struct record records[], size_t n_records,
                         const struct refit_options *options, struct refit_result *out, struct bf_error *err);
void refit_free(struct refit_result *result);

/* Values and standard errors (sd may be NULL) in the order of a refit of this model to these records, into the model. */
void refit_into_model(const struct record records[], size_t n_records, const double value[], const double sd[],
                      struct model *model);

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

/*
 * MOTION — what the beam really did, as the recordings tell it, without knowing why.
 *
 * A linear baseline at θ leaves the residual r = z − ŷ(θ). The smallest modal forces F that explain it in all channels of
 * a record are the Wiener estimate on the Laplace line of the predictor,
 *     F̂ = Φ Hᴴ (Φ H Hᴴ + Σ)⁻¹ R,   H_ok = ψ_k(o) s^ν/(s² + C_kk s + ω_k²),
 * Σ the channels' noise, Φ(s) the power of the forces, estimated from R in bands around s. Then the motion of any
 * functional w = gᵀx is the linear response to the inputs plus Σ ψ_k(g) F̂_k/(s² + C_kk s + ω_k²). It follows the
 * sensors, so it holds where the baseline is far off, and needs no place of the missing force.
 *
 * Also here: the linear model as equation error. With the measured motion x̂ in place of the predicted one,
 *     r = −H (ΔA x̂ + f(x̂)) + noise
 * holds for changes ΔA of mass, damping and stiffness of any size, not only small ones; column j of the Jacobian is
 * −H (∂A/∂θ_j) x̂.
 *
 * In the last two periods of the first mode the motion is less certain: what the sensors would have said next is not known.
 * A record that did not begin at rest (a free decay) moves from the state that is nearest to it; in regressions that state is unknown.
 */

struct motion_record {
    size_t n, m;       /* samples; points of the Laplace line */
    double complex *q; /* [modes.n][m] deviation of the modal coordinates from the linear response */
};

struct motion {
    struct predictor *predictor; /* borrowed; its last run is at theta */
    size_t n_parameters, n_rows, n_channels, n_records;
    const struct predict_channel *channels; /* borrowed from the predictor */
    double *theta;                          /* [n_parameters] */
    double *sigma;                          /* [n_channels] noise rms, unit of the channel */
    double floor;
    double *weight;         /* [n_channels] 1/√(σ² + (floor·rms r)²) */
    double *residual;       /* [n_rows] z − ŷ */
    double complex **chain; /* [n_channels][m] gain and filters of the channel */
    struct transfer_modes modes;
    struct motion_record *records; /* [n_records] */
    bool *free;                    /* [n_parameters] estimated by the regressions */
    size_t n_states;
    const double *states;    /* [n_states][n_rows] columns of the initial states, of the same run; the predictor's */
    const double *predicted; /* [n_parameters][n_rows] Jacobian of the predictor's last run; the predictor's */
    double *jacobian;        /* [n_parameters][n_rows] along the measured motion; columns of held ones are zero */
};

/* A good `floor`: equation error is wrong in proportion to what it explains. */
#define MOTION_FLOOR 0.2

/*
 * The linear model of `predictor` at theta; sigma: [n_channels] in the order of predictor_channels(). floor: relative
 * error of the motion that the weights allow for, of each channel's residual (0: the noise alone). The predictor must not
 * run elsewhere while the motion is in use. BF_USAGE when the model has a law or no record with an input.
 */
enum bf_status motion_new(struct predictor *predictor, const double theta[], const double sigma[], double floor,
                          struct motion *out, struct bf_error *err);

/* The same without the Jacobian, for a motion that is to be renewed first; motion_update_jacobian() fills it. */
enum bf_status motion_prepare(struct predictor *predictor, const double theta[], const double sigma[], double floor,
                              struct motion *out, struct bf_error *err);
void motion_free(struct motion *motion);

/*
 * TRIAL — would this nonlinear effect explain the residual? The force that the effect would exert along the measured motion is computed
 * once, and its response is regressed on the residual together with the baseline's parameters (equation error, trial_search.h). Nothing
 * is simulated, so there are no local minima and no stability limits; the result is a start for a refit.
 */

struct trial_options {
    int rounds;          /* renewals of θ and the motion after the scan, at most; 0: none (a score), 3: start values */
    bool keep_positions; /* positions stay where the search begins: at the catalogue's start, if the beam moves there */
};

struct trial {
    const struct beam_effect *effect;
    bool possible;                    /* false: no valid force along this motion, or its sign is against the range */
    double p[BEAM_EFFECT_PARAMETERS]; /* start values, catalogue order, SI (places in metres) */
    double *theta;                    /* [n_parameters] baseline parameters to start from with the effect */
    double strength, strength_sd;     /* the parameter in which the force is linear, and one standard error */
    double chi_square_baseline;       /* weighted, rows and priors, after the best Δθ without the effect */
    double chi_square;                /* with it */
    double share;                     /* 1 − chi_square/chi_square_baseline, 0 … 1; the score that ranks */
    double p_value;                   /* of the strength, F test with the effective number of samples */
    double unexplained;               /* √(chi_square/rows): 1 is the noise when the weights have no floor */
    size_t forces;                    /* evaluations of the force over all records */
};

/* One candidate along a motion. Free with trial_free(). Cost: about 5 ms a force for 4 records of 4096 samples. */
enum bf_status trial_run(const struct motion *motion, const struct beam_effect *effect,
                         const struct trial_options *options, struct trial *out, struct bf_error *err);
void trial_free(struct trial *trial);

/* All laws of the catalogue that the model does not have, best first; *n of them, free each and the array. */
enum bf_status trial_all(const struct motion *motion, const struct trial_options *options, struct trial **out,
                         size_t *n, struct bf_error *err);

/*
 * RECONSTRUCT — the missing force, when no effect of the catalogue explains the residual: where it acts, what it was in
 * time, and what it looks like against displacement, velocity, amplitude and frequency.
 *
 * At each place two questions are asked, the baseline's parameters free in both: which part of the residual does a
 * force explain that is some function of displacement and velocity there (a regression on powers, steps and hinges of the
 * measured motion, one function for all records); and which part does any history of a force there explain (the Wiener
 * estimate from all channels of a record). The first tells places apart even with one channel, if the force is such a
 * function; the second needs records with two or more channels.
 */

enum { RECONSTRUCT_BINS = 24, RECONSTRUCT_TEXT = 600 };

enum reconstruct_place { RECONSTRUCT_POINT, RECONSTRUCT_PATCH, RECONSTRUCT_SPREAD };

struct reconstruct_site {
    enum reconstruct_place place;
    double at_m;       /* RECONSTRUCT_POINT */
    double by_law;     /* part of the weighted residual's square that no function of (w, v) there explains, 0 … 1 */
    double by_history; /* that no force there explains, in records of two or more channels; NaN when none has two */
};

/* One record's force and motion at the chosen place, [n] each, on the record's samples. */
struct reconstruct_record {
    size_t record, n;
    double dt_s;
    double *f, *w, *v; /* N, m, m/s at a point; N·m, rad, rad/s at the patch; N/m, m², m²/s spread (w = ∫ y dx).
                          f stands on the left side of the weak form: a spring has f = k w */
};

struct reconstruction {
    size_t n_sites;
    struct reconstruct_site *sites; /* best first: by_law where some place explains the main part so, else by_history */
    bool is_law;                    /* the first */
    bool located;                   /* the best place is clearly better than others away from it */
    struct reconstruct_site best;
    size_t n_records;
    struct reconstruct_record *records;
    /* What the force at the best place looks like: shares of the residual's square that go away, 0 … 1. */
    double linear;                    /* with k w + d v alone */
    double elastic_odd, elastic_even; /* with odd functions of w; with even ones beside them */
    double dissipative;               /* with odd functions of v beside all functions of w */
    double memory;                    /* what stays: hysteresis, a force from outside, noise, or the wrong place */
    bool hardening, drag;             /* the odd part grows faster than w; the part of v faster than v */
    double dissipated;                /* mean f v/(rms f · rms v), −1 … 1: > 0 takes energy out */
    double amplitude_power;           /* rms f grows as rms w to this power between records; NaN: one level only */
    double frequency_Hz;              /* of the largest line of |F| with at least four periods in the record */
    double band_share;                /* part of its square within 5 % of that, least of all records */
    bool resonant;                    /* every record has its force there, and no mode of the baseline does */
    bool sensor_like;                 /* one output carries the misfit in every record and no other shows any */
    char channel[MODEL_NAME];
    /* Binned curves for plotting, of the record with the largest force: its mean at w, and what is left of it at v. */
    size_t strongest; /* index into records */
    double w_bin[RECONSTRUCT_BINS], f_of_w[RECONSTRUCT_BINS];
    double v_bin[RECONSTRUCT_BINS], f_of_v[RECONSTRUCT_BINS];
    size_t n_lines; /* |F| of the same record: one-sided amplitude spectrum */
    double df_Hz;
    double *spectrum;
    char text[RECONSTRUCT_TEXT]; /* one or two plain sentences */
};

/* motion: of the baseline fitted to all records or to the weak ones. About 1 s for 4 records of 4096 samples. */
enum bf_status reconstruct_run(const struct motion *motion, struct reconstruction *out, struct bf_error *err);
void reconstruct_free(struct reconstruction *reconstruction);

#endif
