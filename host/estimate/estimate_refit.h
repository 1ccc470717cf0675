/* SPDX-License-Identifier: GPL-3.0-or-later */
/* estimate_refit.h — one candidate model fitted beside others; part of estimate.h */
#ifndef BEAMFIT_ESTIMATE_REFIT_H
#define BEAMFIT_ESTIMATE_REFIT_H

#include <stdbool.h>
#include <stddef.h>

#include "ground/ground.h"
#include "model/model.h"
#include "record/record.h"
#include "response/response.h"

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

#endif
