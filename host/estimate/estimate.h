/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * estimate.h — records + model -> parameters with standard errors; what an effect more would explain.
 *
 * fit_run() poses a weighted least-squares problem in the model's free parameters, finds starts for it, searches from them through
 * windows that grow to whole records, and returns values with standard errors and with what the records cannot determine
 * (docs/estimation.md). fit_errors() judges a model on records that were not fitted, own_values_find() estimates what belongs to
 * such a record alone, fit_finer() tells the error of the computation. The included parts are for a caller that compares many models (host/explain):
 * candidate_list_new() lists the effects that could act, score_run() and trial_all() tell cheaply what each would explain of a fitted
 * baseline's residual and where a fit of it should start, refit_run() fits one of them, and reconstruct_run() describes the missing force
 * when none fits. Units are SI. What a call fills is freed with the function named at it.
 */
#ifndef BEAMFIT_ESTIMATE_H
#define BEAMFIT_ESTIMATE_H

#include <stdbool.h>
#include <stdio.h>

#include "estimate/estimate_modes.h"
#include "estimate/estimate_motion.h"
#include "estimate/estimate_refit.h"
#include "estimate/estimate_score.h"
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
 * options: sigma, where it is given, is that of the channels of all these records in turn.
 * Cost: three predictions and a short fit in few unknowns per record for phases, a fit per start for what else is missing; nothing when no value is.
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

#endif
