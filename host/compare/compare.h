/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * compare.h — measured against predicted, record by record and channel by channel, with a model as it is: nothing is
 * fitted but what no model can know: the initial state of a free decay, an unknown level of excitation (linear
 * unknowns, least squares), and per-record parameters of records that have no value of their own (fit_own.h). docs/compare.md says how to read the answer.
 */
#ifndef BEAMFIT_COMPARE_H
#define BEAMFIT_COMPARE_H

#include <stdio.h>
#include "ground/json.h"
#include "noise/noise.h"
#include "response/predict.h"
#include "maths/residual.h"

enum { COMPARE_INPUTS = 4 };

struct comparison_band {
    double from_Hz, to_Hz;
    double share;       /* of Σ r² */
    double noise_ratio; /* rms of the residual in the band over the noise's there; NAN when the noise is unknown */
    size_t mode;        /* the mode inside, 1 = lowest; 0: none known */
};

struct comparison_input {
    const char *name;
    struct input_correlation correlation;
    double coherence; /* with the measured output, mean weighted by its spectrum; NAN: not possible (a single pulse) */
    double coherence_bound; /* exceeded by chance in 5 % of bins */
};

struct comparison_channel {
    size_t record;
    const char *name; /* of the model's output */
    bool held_out;    /* a --check record */
    size_t n;
    double t0_s, dt_s;
    const double *measured; /* [n], in the record */
    double *predicted;      /* [n] */
    double *residual;       /* [n] measured − predicted */
    struct noise_estimate noise;
    double rms, residual_rms, nrmse, noise_ratio; /* noise_ratio NAN when the noise is unknown */
    double scale;                                 /* c of the least-squares fit measured ≈ c · predicted */
    double alignment;                             /* correlation of measured and predicted, −1 … 1 */
    size_t n_bands;
    struct comparison_band *bands;
    double time_share[3];
    struct amplitude_shares amplitude;
    struct whiteness whiteness;
    size_t n_autocorrelation;
    double *autocorrelation;
    size_t n_inputs;
    struct comparison_input inputs[COMPARE_INPUTS];
    char warning[240]; /* of units or sign; "" none */
};

struct comparison {
    const struct model *model;
    const struct record *records;
    size_t n_records, n_held_out; /* the held-out records are the last ones */
    size_t n_notes;
    char **notes;  /* per-record values that were estimated from the records themselves (fit_own.h) */
    double *level; /* [n_records] factor of the excitation; 1 where it is known */
    size_t n_modes;
    double *frequency_Hz; /* of the model, up to the highest Nyquist frequency */
    size_t n_channels;
    struct comparison_channel *channels;
    double nrmse, noise_ratio;             /* root mean square over channels of the records that are not held out */
    double check_nrmse, check_noise_ratio; /* of the held-out ones; NAN: none */
};

/* model and records must outlive the comparison. Free with compare_free(), also after a failure. */
enum bf_status compare_run(const struct model *model, const struct record records[], size_t n_records,
                           size_t n_held_out, const struct predict_options *options, struct comparison *out,
                           struct bf_error *err);
void compare_free(struct comparison *comparison);

/* Residuals within this factor of the noise hold nothing that could be told from it; NAN (not known) is not within. */
bool compare_is_noise(double noise_ratio);
/* The band with the largest share of the misfit; NULL when there is none. */
const struct comparison_band *compare_worst_band(const struct comparison_channel *channel);

/* For a person. */
void compare_print(FILE *out, const struct comparison *comparison);
/* How large the misfit is and where, in sentences of numbers (at most `size` bytes), without what may be behind it. */
void compare_finding(const struct comparison *comparison, const struct comparison_channel *channel, char *text,
                     size_t size);
/* The same and what it means. */
void compare_summary(const struct comparison *comparison, const struct comparison_channel *channel, char *text,
                     size_t size);
/* The answer for programs; its keys stand in `beamfit compare --help`. */
struct json *compare_json(const struct comparison *comparison);
/* One channel's: DIR/STEM.png and DIR/STEM-residual.png (and PDF). BF_NUMERIC when it has fewer than COMPARE_PLOT samples. */
enum { COMPARE_PLOT = 16 };
enum bf_status compare_plot_channel(const struct comparison *comparison, size_t channel, const char *directory,
                                    const char *stem, struct bf_error *err);
/* Four panels and a residual page per channel: DIR/RECORD-CHANNEL.png and DIR/RECORD-CHANNEL-residual.png (and PDF). */
enum bf_status compare_plot(const struct comparison *comparison, const char *directory, struct bf_error *err);

#endif
