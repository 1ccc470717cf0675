/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fit.h — the estimator: model + records -> fitted parameter values with standard errors, what cannot be identified, and
 * whether the search really ended at an optimum. See docs/estimation.md for the method and its measurements.
 */
#ifndef BEAMFIT_FIT_H
#define BEAMFIT_FIT_H

#include "identifiability.h"
#include "ground/json.h"
#include "response/predict.h"

enum fit_start {
    FIT_GIVEN, /* the model's values, through the staircase of windows; a search when that misses the noise floor */
    FIT_NEAR,  /* the model's values are nearly right (a refit): whole records at once */
    FIT_SEARCH /* staircase and search, whatever the staircase found */
};

struct fit_options {
    enum fit_start start;
    bool never_search;   /* report what the staircase found, even when it misses the noise floor */
    bool quiet;          /* no progress bar */
    const double *sigma; /* noise rms per channel in the order of predictor_channels(); NULL: estimated */
    struct predict_options predict;
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
};

/* A minimum that the search found and did not choose. */
struct fit_minimum {
    double noise_ratio;
    double *value; /* [n_parameters] */
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
    struct identifiability identifiability; /* in the unknowns, see unknown[] */
    size_t *unknown;                        /* [identifiability.n] index into parameters */
    bool converged;
    double distance;    /* from the optimum, in standard errors, as the gradient tells it */
    double polish_gain; /* what NLopt's polish still found, in ½χ² */
    bool interrupted, searched;
    size_t n_minima;
    struct fit_minimum *minima;
    size_t evaluations; /* of the prediction */
    double seconds;
    enum intersample intersample;
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
 * Errors of a model on records it is not fitted to (free-decay states and unknown levels are still solved for). With a nonlinear
 * effect rows that cannot be predicted (refit_horizon.h) are left out: then n of a channel is less than the record's.
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
    size_t n_notes; /* what was estimated from the records themselves (fit_own.h) */
    char *const *notes;
};

/* Writes values, standard errors and the `fit:` block into the model; records are those of fit_run(). */
void fit_into_model(const struct fit_result *result, const struct record records[], const struct fit_check *check,
                    struct model *model);
/* The answer for programs; its keys stand in `beamfit fit --help`. */
struct json *fit_json(const struct fit_result *result, const struct record records[], const struct fit_check *check);
/* The answer for a person. */
void fit_print(FILE *out, const struct fit_result *result, const struct record records[],
               const struct fit_check *check);

#endif
