/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * noise.h — what recordings tell of their own error, without a fitted model: how noisy each channel is, how strongly the
 * data prefer one model's residual to another's, and whether any linear system explains records of different level.
 *
 * Order of calls:
 *   inputs_clean()         before all others, for all records; then baselines_take_off() and decay_starts_cut()
 *   noise_of_channel()     for each channel of each record; the others start from it
 *   linearity_test()       once, for all records
 *   repeatability_find()   what repeated hits tell without a model
 *   whitener_from_noise()  for each channel; then misfit_measure() for each model, evidence_compare() for a poorer and a
 *                          richer model, and holm_adjust() over all p-values of one search
 */
#ifndef BEAMFIT_NOISE_H
#define BEAMFIT_NOISE_H

#include <complex.h>
#include <stdbool.h>

#include "maths/maths.h"
#include "model/model.h"
#include "record/record.h"

/*
 * NOISE — how noisy a channel is, judged from the recording alone, without any model of the beam.
 *
 * The estimate has two sources, of which it takes one:
 *   local    the local rational method (McKelvey & Guérin 2012; Geerardyn & Schoukens 2017): in a narrow band any linear
 *            system with any initial and final state obeys A(f) Y = B(f) U + I(f) with low-order polynomials; what does
 *            not is noise. Nonlinear distortion, harmonics and hum are not noise of the channel: they stand out of the
 *            smooth background, which is what is returned.
 *   quiet    samples before anything moves (at least 64, inputs and output quiet), where they are clearly quieter than
 *            what the whole record suggests. A few quiet samples tell less than a whole record does: 64 of them know the
 *            noise to 9 %, 4096 samples to 1.2 %.
 */

enum noise_method { NOISE_NONE, NOISE_QUIET, NOISE_LOCAL, NOISE_COHERENCE };

struct noise_estimate {
    enum noise_method method;
    double rms;          /* of the noise, unit of the channel; 0 when there is none to be seen */
    double rms_sd;       /* one standard error of rms */
    size_t n_used;       /* samples (quiet) or spectral cells (local) that carry the estimate */
    double used_share;   /* of the cells that could have been used; small: much of the record is not linear */
    double quantisation; /* step of the recorder found in the samples, 0 when none is visible */
    size_t n_bins;       /* psd at 0, df, 2 df … Nyquist */
    double df_Hz;
    double *psd; /* [n_bins] one-sided, smooth, unit²/Hz; Σ psd df = rms² */
    double *
        crowding; /* [n_bins] ≥ 1: mean square over squared mean of the density over the record's own bins in each of these; NULL: even */
};

/* "pre-trigger samples", "local rational method", "coherence", "none" */
const char *noise_method_text(enum noise_method method);

/*
 * The noise of an output of the model in a record. The inputs that move the beam and the start of a free decay come from
 * the model's inputs and the record's metadata. A channel of fewer than 64 samples or of one value gives method NOISE_NONE
 * with rms 0. BF_BAD_FILE: the record has no such column; BF_NUMERIC: it holds numbers that are not finite. Free with
 * noise_free(). About 10 ms for 4096 samples, and what the free linear model of the record costs (attainable_find(), from this model's poles) where an input has noise;
 * nothing where the same samples were asked for not long ago, of whatever model.
 */
enum bf_status noise_of_channel(const struct model *model, const struct record *record, const char *channel,
                                struct noise_estimate *out, struct bf_error *err);
void noise_free(struct noise_estimate *estimate);
/*
 * Rms of the noise of a measured input u[n], taken as white: where its drive is not, or while it rests; of one that rests exactly, of the recorder's steps while it
 * moves. 0: none that can be told (a drive that is random itself). O(n log n).
 */
double noise_of_input(const double *u, size_t n);
/*
 * Rms of the noise of a measured input of a record, in its own unit, before it was cleaned if it was (inputs_clean()); 0: none. *cells: where it still is; NULL:
 * everywhere.
 */
double noise_of_record_input(const struct record *record, const char *input, const struct column_noise **cells);
struct noise_estimate noise_copy(const struct noise_estimate *estimate);
/* One standard error of the noise's power, as a part of it: two of its rms. 1 where the noise is not known. */
double noise_doubt(const struct noise_estimate *estimate);
/*
 * Two standard errors of a root mean square over n channels of residual over noise, by those of the noise's levels. What the noise of an input makes of the
 * channels of one record is one thing: within a record the errors add up, over records their squares. record[n]: which record the channel is of.
 */
double noise_ratio_doubt(const double doubt[], const size_t record[], size_t n);
/* The mean power of `sum` and of one more stretch of the same channel, by the cells of each; an empty sum ({0}) becomes a copy. NOISE_NONE adds nothing. */
void noise_join(struct noise_estimate *sum, const struct noise_estimate *more);
/* Power of the noise between two frequencies, unit of the channel squared. */
double noise_power(const struct noise_estimate *estimate, double from_Hz, double to_Hz);
/*
 * How many bins of a record of that length are there between two frequencies, as far as the noise is concerned: (∫S df)²/∫S² df of them where the noise of an input is crowded behind
 * resonances, all of them else. At least 1.
 */
double noise_bins(const struct noise_estimate *estimate, double from_Hz, double to_Hz, double length_s);

/*
 * INITIAL STATE — a record with an input that was cut out of a motion: in their first periods an input and every
 * output move as they do at large (0.9 of their rms, an output six times its noise). *found: the record now has the metadata
 * "initial_state: free". Nothing is looked for where the record states it. Errors are those of noise_of_channel(), and so is the cost.
 */
enum bf_status initial_state_find(const struct model *model, struct record *record, bool *found, struct bf_error *err);

/*
 * INPUTS — the noise of a force's sensor drives the model as the force does, most of all where the beam rings, and between two blows, beside a sweep and above a
 * drive's band it is all that there is. Where nothing stands out of the noise of noise_of_input() in a cell of time and frequency, no more is known of the
 * force than that it is small, and it is taken as zero. What stands out stays as it was, with its noise. A drive that is random itself, rests exactly or fills nine tenths of the cells stays
 * as it is, and so do a steady state and a record with the metadata "input_noise: keep".
 */
struct clean_input {
    const struct record *record;
    const char *channel;
    double noise; /* rms of the noise over the input's peak */
    double kept;  /* part of the cells, and so of the noise's power */
};
struct clean_input_list {
    size_t n;
    struct clean_input *all; /* [n] */
};
/* records: [n_records], columns changed in place and marked (record_column_noise()). Free also after a failure. BF_NUMERIC: no transform. O(n log² n) an input. */
enum bf_status inputs_clean(const struct model *model, struct record *const records[], size_t n_records,
                            struct clean_input_list *out, struct bf_error *err);
void inputs_clean_free(struct clean_input_list *list);
/* y[n] (may be x) of noise x[n] of the input: what would be left of it. The map is its own transpose. */
enum bf_status input_noise_keep(const struct column_noise *noise, const double x[], size_t n, double y[],
                                struct bf_error *err);
/* Part of the record's time in which cells at that share of the Nyquist frequency are kept. */
double input_noise_kept(const struct column_noise *noise, double of_nyquist);

/*
 * MAINS — mean square of the steady lines between 45 and 65 Hz that a residual[n] of the record's first n samples has and none of its inputs, in the unit of the
 * residual; 0: there are none. O(n log n).
 */
double mains_power(const struct model *model, const struct record *record, const double residual[], size_t n);

/*
 * BASELINES — an accelerometer that a blow has thrown off its zero and that creeps back: slow, another in each record, and no motion of a held
 * beam. Taken off the samples of records that begin at rest, from the first instant of an input on, by a cosine series below a tenth
 * of the model's first frequency; in records cut out of steady vibration by one below a quarter of the drive's frequency, too, that is fitted beside the motion,
 * where it is more than the drive has so slow. An offset that all records share stays: a model may have it (sensor_offset); so does what a single record has,
 * which has nothing to differ from. "baseline: keep" in a record's metadata forbids it.
 */
struct baseline {
    const struct record *record;
    const char *channel;
    double first, last; /* unit of the channel, at the onset and at the end */
    double share;       /* of the channel's rms */
};
struct baseline_list {
    size_t n;
    struct baseline *all; /* [n] */
};
/* records: [n_records], changed in place; all that are fitted or held out together. Errors are those of noise_of_channel(), and so is the cost. */
enum bf_status baselines_take_off(const struct model *model, struct record *const records[], size_t n_records,
                                  struct baseline_list *out, struct bf_error *err);
void baselines_free(struct baseline_list *list);

/*
 * DECAY STARTS — first samples of a free decay that are not the beam's alone, because the blow, or the answer of the recorder's filter to the release, is not over.
 * What swings freely follows backward from what it does later; these do not. The record then says "free_from_s", from the first sample on that does; one that says
 * so already is left as it is ("free_from_s: 0": all of it is free).
 */
struct decay_start {
    const struct record *record;
    const char *channel; /* in which it lasts longest */
    size_t n;            /* samples that do not follow, 1 … 16 */
    double times;        /* what the others are off by, as rms, the worst of them is off */
};
struct decay_start_list {
    size_t n;
    struct decay_start *all; /* [n] */
};
/* records: [n_records], changed in place; those that are no free decays are not looked at. NUMERIC. O(4096 · 40²) a channel. */
enum bf_status decay_starts_cut(const struct model *model, struct record *const records[], size_t n_records,
                                struct decay_start_list *out, struct bf_error *err);
void decay_starts_free(struct decay_start_list *list);

/*
 * EVIDENCE — how strongly data prefer one residual to another, with noise that is not white.
 *
 * A whitener is made of a channel's noise spectrum: a linear map after which the noise is independent and of variance 1.
 * Then χ² = Σ w², the log-likelihood ratio of two nested models is half the difference of their χ², and information criteria
 * count samples by n_eff instead of n. docs/diagnose.md says how the false alarms of this were measured. No function keeps
 * state: all may run in several threads.
 */

/* One channel of one record and what a model leaves of it: views, nothing is owned. */
struct misfit_channel {
    const char *file;    /* as the user gave it */
    const char *channel; /* name of the output */
    size_t record;       /* index into the caller's records */
    size_t n;
    double dt_s;
    const double *measured, *residual; /* [n] z and r = z − ŷ */
    /* Never NULL. Where noise is needed, a channel of method NOISE_NONE is left out. */
    const struct noise_estimate *noise;
};

/* ---- Whitening ---- */

/* The noise of a channel as an autoregressive model: exact and causal, so that whitened rows have no wrap-around. */
struct whitener {
    struct ar_model ar;
    double n_eff_share; /* independent samples a sample, 0 … 1: (∫S df)²/(f_N ∫S² df); 1 for white noise */
};

/*
 * From the smooth spectrum of a recording's noise: autocovariance of the spectrum, Levinson's recursion, the lowest order
 * that reproduces the spectrum to 1 %, at most 40. BF_NUMERIC when the estimate holds no noise.
 */
enum bf_status whitener_from_noise(const struct noise_estimate *noise, struct whitener *out, struct bf_error *err);

/* w[n]: x[n] whitened; w may be x. Residuals and Jacobian columns are whitened alike. O(n order). */
void whitener_apply(const struct whitener *whitener, const double *x, size_t n, double *w);

/* ---- χ² of residuals ---- */

struct misfit {
    double chi_square; /* Σ over channels of the whitened Σ w² */
    size_t n;          /* rows */
    double n_eff;      /* effective number of independent rows */
};

/* whiteners: one a channel; residual as in channels[]. Channels whose whitener has sigma 0 are left out. O(n order). */
void misfit_measure(const struct misfit_channel channels[], const struct whitener whiteners[], size_t n_channels,
                    struct misfit *out);

/* ---- One model against a richer one that contains it ---- */

struct evidence {
    /* (χ²_poor − χ²_rich)/max(1, χ²_rich/n_rich): what the richer model leaves is not counted as noise. */
    double two_delta_log_likelihood;
    double scale;      /* that maximum; far above 1: neither model is right, p-values mean little */
    double p_value;    /* of the likelihood ratio, before any correction for search */
    double bic_gain;   /* 2ΔlogL − g ln n_eff − 2 g ln(tried); > 0 favours the richer model */
    double fall_share; /* 1 − χ²_rich/χ²_poor: significance without size is no reason to add an effect */
};

/*
 * poor and rich: of the same rows and whiteners. added: g ≥ 1 parameters the richer one has more, one_sided of them
 * (≤ g, at most 1 counted) are held at a bound by the poorer. tried: candidates that were looked at, ≥ 1.
 */
void evidence_compare(const struct misfit *poor, const struct misfit *rich, size_t added, size_t one_sided,
                      size_t tried, struct evidence *out);

/* A fall_share below this is no evidence, whatever its significance: the noise itself is known to about 1.2 %. */
extern const double evidence_least_fall;

/* Holm's step-down: adjusted[i] ≤ α exactly when hypothesis i falls at family-wise error α. p, adjusted: [n], may be the same. */
void holm_adjust(const double p[], size_t n, double adjusted[]);

/*
 * LINEARITY — is there a linear time-invariant system at all that explains records of different level? Without a model.
 *
 * Two records of one path with inputs u₁, u₂ that begin at rest, of a linear system h:
 *     (u₂ * y₁)(t) − (u₁ * y₂)(t) = (u₂ * h * u₁ − u₁ * h * u₂)(t) = 0     for every t of the record, ringing at its end or not.
 * What is left is compared with what noise of the known level leaves after the same operation, in every cell of the
 * spectrogram: ratio = √(mean of cell/expected) is 1 for a linear system. Where u₂ = k u₁ this is y₂ − k y₁ itself.
 * A signal that does not scale with the input (hum, offset) shows too; steady lines are found, taken out, and told apart.
 * Systems that are homogeneous of degree 1 pass (bilinear stiffness), and so does whatever is the same in both records.
 */

enum linearity_verdict {
    LINEARITY_CANNOT_TELL, /* no two records of different level drive one input and begin at rest */
    LINEARITY_LINEAR,      /* linear, or homogeneous of degree 1 */
    LINEARITY_NONLINEAR,
    LINEARITY_ADDITIVE /* linear but for lines or offsets that do not scale with the input */
};

/* "cannot be told", "linear", "nonlinear", "linear, with added signals" */
const char *linearity_verdict_text(enum linearity_verdict verdict);

/* One channel seen in two records that excite the same input. */
struct linearity_pair {
    size_t record[2];   /* weak, strong */
    size_t output;      /* of the model */
    size_t input;       /* of the model */
    double level[2];    /* rms of the channel, without what was found added: how large the motion is */
    bool same_shape;    /* u₂ = k u₁ to 1e-3 (then ratio is that of y₂ − k y₁) */
    bool opposite;      /* k < 0: what is left holds the even part */
    double ratio;       /* rms of what is left over the noise's, all cells: 1 ± ratio_sd for a linear system */
    double ratio_sd;    /* from the number of cells and the standard errors of both noise levels */
    double ratio_broad; /* the same after what was found added is taken out, without the cells of its lines */
    size_t n_added;     /* of one shape: lines or offsets that y₂ − k y₁ has and ratio_broad lacks, 0 … 3 */
    double added_Hz;    /* the strongest of them; 0: an offset */
    double worst_from_Hz, worst_to_Hz; /* third of an octave with the largest excess */
    double worst_ratio;
    bool nonlinear; /* ratio_broad, or the ratio of one band, is above what noise and its doubt explain */
};

/* A sinusoid of constant amplitude, or an offset, in one channel that no input of the record has. */
struct linearity_added {
    size_t record, output;
    double frequency_Hz; /* 0: offset or drift */
    double amplitude;    /* unit of the channel; of a drift: change over the record */
    double phase_rad;    /* amplitude · sin(2πft + phase), t = 0 at the record's first sample */
    double sd;           /* one standard error of the amplitude */
    bool drift;          /* frequency 0 only: slope instead of mean */
};

struct linearity {
    enum linearity_verdict verdict;
    size_t n_pairs;
    struct linearity_pair *pairs; /* largest ratio first */
    size_t n_added;
    struct linearity_added *added; /* most significant first */
    char text[400];                /* one or two sentences */
};

/*
 * noise: [n_records · model->n_outputs] as of noise_of_channel(), index record · n_outputs + output; method NOISE_NONE
 * leaves a channel out. NULL: estimated here (10 ms a channel). Free with linearity_free(), also after a failure.
 * Cost: about 6 ms for a pair of 4096 samples.
 */
enum bf_status linearity_test(const struct model *model, const struct record records[], size_t n_records,
                              const struct noise_estimate noise[], struct linearity *out, struct bf_error *err);
void linearity_free(struct linearity *linearity);

/*
 * ATTAINABLE — the smallest error that a linear time-invariant model with so many modes can leave on records.
 *
 * Every channel is Σ_k residue · input/(s − p_k) for each input, plus what lies above the band (input, and its first two
 * derivatives), plus the free motion of the poles where a record does not begin at rest. Poles are shared by all records and
 * channels; residues belong to an output and an input (and to the record where its level of excitation is unknown), initial
 * states to a channel of a record. Residues are eliminated (variable projection); poles are first relocated by vector
 * fitting (Gustavsen & Semlyen 1999), which needs no good start, then refined by Gauss–Newton steps (Kaufman 1975).
 *
 * A model of the beam whose error is at this floor misses nothing linear in its modes; a floor above the noise is what no
 * such model explains: a nonlinearity, a signal that no input caused, a mode or a filter that the model has not.
 */

struct attainable_channel {
    size_t record, output;     /* indices into the records and model->outputs */
    double nrmse, noise_ratio; /* noise_ratio NAN when the noise is unknown */
};

struct attainable_pole {
    double frequency_Hz, damping_ratio; /* |p|/2π, −Re p/|p| */
    double
        without_noise_ratio; /* what is left without this pair, the others' residues anew; NaN: not known (long records) */
};

struct attainable {
    size_t modes;                /* pairs of poles; 0: nothing to fit, nothing else is known then */
    double nrmse, noise_ratio;   /* root mean square over channels, as everywhere */
    double start_nrmse;          /* with the model's own poles */
    double held_out_noise_ratio; /* of other records, attainable_check(); NaN: not known */
    double each_nrmse,
        each_noise_ratio;          /* of free linear models of each record alone, attainable_each(); NaN: not known */
    size_t n_moving;               /* records that do not begin at rest */
    struct attainable_pole *poles; /* [modes] ascending */
    size_t n_outputs, n_inputs;    /* of the model */
    double complex *
        residue; /* [modes][n_outputs][n_inputs] of the pole with Im > 0, unit of the output over those of the input and s; NaN: no record tells */
    size_t n_channels;
    struct attainable_channel *channels; /* record by record */
};

/*
 * noise_rms: [n_records · model->n_outputs], index record · n_outputs + output, 0 unknown; NULL: estimated here (10 ms a
 * channel). The modes are those of the model up to the highest Nyquist frequency and the next, 4 to 20. The error is never
 * above that of the model's own poles. Free with attainable_free(), also after a failure. Cost: about 0.3 s for 4 records × 4096 and 7
 * modes, twice that where it ends above the noise.
 */
enum bf_status attainable_find(const struct model *model, const struct record records[], size_t n_records,
                               const double noise_rms[], struct attainable *out, struct bf_error *err);
void attainable_free(struct attainable *attainable);
/* An own copy of all of it; to be freed, too. */
struct attainable attainable_copy(const struct attainable *attainable);

/*
 * held_out_noise_ratio: what the free linear model of the records leaves of others, its poles, the residues that are best for the records,
 * states of the checks' own. NaN where no check has the outputs and inputs of a record (with the level of excitation known), no
 * noise is known, or the computation fails. noise_rms as above, of the records. Cost: as one step of attainable_find().
 */
enum bf_status attainable_check(const struct model *model, const struct record records[], size_t n_records,
                                const double noise_rms[], const struct record checks[], size_t n_checks,
                                struct attainable *attainable, struct bf_error *err);

/*
 * each_nrmse, each_noise_ratio: what free linear models of each record alone leave, with poles and residues of their own. NaN where there is one record,
 * where the model of all leaves little more than the noise, so that nothing is to be told, and where no noise is known. noise_rms as above.
 * Cost: nothing, or another attainable_find().
 */
enum bf_status attainable_each(const struct model *model, const struct record records[], size_t n_records,
                               const double noise_rms[], struct attainable *attainable, struct bf_error *err);
/* Each record alone leaves less than half of it: a mass, a place or a gain was changed between them, or the beam is nonlinear and their levels differ. False until attainable_each() was asked. */
bool attainable_differs(const struct attainable *attainable);
/* Both in units of the noise: no one linear beam leaves `noise_ratio` where it leaves `of_noise_ratio`. */
bool attainable_is_apart(double noise_ratio, double of_noise_ratio);

/*
 * REPEATABILITY — what repeated excitation from rest leaves unexplained by any linear system, and which repetition stands out.
 *
 * The records that one input drives alone, with the same places, are held against the one response that is best for all of them (REPEATS in record.h), under a window of 9.2 time
 * constants. The scatter about it is the noise and whatever did not repeat; no linear model of one beam does better in that part of the records.
 */
struct repeatability_channel {
    size_t input, output;      /* of the model */
    size_t n_records;          /* ≥ 2 */
    struct repeats repeats;    /* odd: index of the record */
    double scatter_rms;        /* white noise of this rms would scatter as much, unit of the output */
    double noise_ratio;        /* that over the noise of the channels; NAN: unknown */
    double weakest, strongest; /* largest absolute value of the input in a record */
};

struct repeatability {
    size_t n;
    struct repeatability_channel *all;
};

/*
 * noise_rms: [n_records · model->n_outputs], index record · n_outputs + output, 0 unknown; NULL: all unknown. Nothing is found among records of one kind each, free decays,
 * frequency responses and models whose parameters differ from record to record. BF_NUMERIC: a transform failed. Free with repeatability_free(), also after a failure. O(n log n) a channel.
 */
enum bf_status repeatability_find(const struct model *model, const struct record records[], size_t n_records,
                                  const double noise_rms[], struct repeatability *out, struct bf_error *err);
void repeatability_free(struct repeatability *repeatability);

#endif
