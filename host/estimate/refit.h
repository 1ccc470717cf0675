/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * refit.h — one candidate model fitted to records, silently, from a baseline that is already fitted: for a caller that
 * compares many candidates (diagnose) and for `fit`'s own starts of nonlinear effects. Noise is given, not estimated.
 *
 * New effects (those from options.first_new on) have starts of their own: a grid of thresholds, time constants and places,
 * the amount by the linearised problem, ranked by a few steps in a short window; the best go through the staircase of
 * fit_stages.h. Places are estimated, although a fit would hold them; a place or threshold of an effect that is not
 * there has no standard error. Nonlinear effects begin with an equation-error trial (trial.h), then refit_law.h; rows
 * that nobody can predict are left out (refit_horizon.h).
 *
 * Thread-safe: two refits may run at once (records, model and sigma are only read; they must outlive the call).
 */
#ifndef BEAMFIT_REFIT_H
#define BEAMFIT_REFIT_H

#include "response/predict.h"

/*
 * A value whose standard error grows k times when n rows are left out adds (k² − 1)/n to the power of the noise where those rows are
 * predicted: with 5 and 4096 rows 0.3 % of the rms. Far above, the rows left out are missed by what nobody can know of them.
 */
#define REFIT_WEAK 5.0

struct refit_options {
    const double *sigma;  /* noise rms per channel in the order of predictor_channels(), > 0; unit of the channel */
    int threads;          /* for records of nonlinear models; 0: 1 */
    double abandon_above; /* χ²/n: stop when ten more steps like the next would not get below it; 0: never */
    bool quick;           /* best start, few steps: good enough to rank, not for values; sd is NaN */
    bool near; /* the values are a fit to more of such records: whole records at once, from there alone; sd is NaN */
    /*
     * [n_parameters] with near: standard errors of those values. What these records tell more than REFIT_WEAK times worse keeps
     * its value; NULL: all are estimated.
     */
    const double *known_sd;
    size_t first_new; /* effects of the model before this index hold fitted values and have no starts of their own */
    size_t n_starts;  /* further starts, from elsewhere */
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
    double *horizon_s; /* [n_records] since the first row: rows from here on cannot be predicted (refit_horizon.h); ∞ */
    size_t n_used;     /* rows before the horizons */
    size_t n_unknowns; /* estimated parameters; linear unknowns of free decays not counted */
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
 * The model's values and options.starts are starts too, unless a trial explains the records; the model is not changed. Free *out with refit_free(), also after a failure.
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
 * Errors on records that were not fitted: values that belong to one record alone (phases) are estimated from it, see fit_own.h.
 * sigma as above for these records; *chi2_per_row and *noise_ratio as above.
 */
enum bf_status refit_check(const struct model *model, const struct record records[], size_t n_records,
                           const double sigma[], const struct predict_options *predict, double *chi2_per_row,
                           double *noise_ratio, struct bf_error *err);

#endif
