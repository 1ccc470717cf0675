/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * compare.h — measured against predicted with a model as it is: how large the misfit is, where it is, how frequency and damping
 * change with amplitude; and the models of one history, by the errors that their files state.
 *
 * Order of calls:
 *   long_record_sum()    before it, of a record too long for memory; compare_take_long() after it
 *   compare_run()        errors, bands, tests of every channel; then compare_worst_band() and compare_is_noise() of a channel
 *   compare_suspect(), disagreements_find()  ordinary causes in words
 *   amplitude_measure()  (compare_modes.h) from a comparison: frequency and damping against amplitude, in stretches that nothing drives
 *   stabilisation_find() (the same) from a comparison: poles of free linear models of rising order
 *   channel_factors_find()  (compare_factors.h) before all that: a sign, unit or decade of a channel that is wrong
 *   localise_misfit()    from residuals and their noise alone: shares of the misfit above the noise, over all records
 *   history_read(), or history_of() for one model and its ancestors; neither needs a record
 */
#ifndef BEAMFIT_COMPARE_H
#define BEAMFIT_COMPARE_H

#include <stdbool.h>
#include <stdio.h>

#include "compare/compare_factors.h"
#include "compare/compare_modes.h"
#include "estimate/estimate.h"
#include "ground/ground.h"
#include "maths/maths.h"
#include "model/model.h"
#include "noise/noise.h"
#include "response/response.h"

/*
 * COMPARE — measured against predicted, record by record and channel by channel. Nothing is fitted but what no model can
 * know: the initial state of a free decay and an unknown level of excitation (linear unknowns, least squares), and per-record
 * parameters of records that have no value of their own (own_values_find() of estimate.h). docs/compare.md says how to read
 * the answer.
 */

enum { COMPARE_INPUTS = 4 }; /* of one channel, at most */

struct comparison_band {
    double from_Hz, to_Hz;
    double share;       /* of Σ r² of the channel, 0 … 1 */
    double noise_ratio; /* rms of the residual in the band over the noise's there; NAN when the noise is unknown */
    size_t mode;        /* the mode inside, 1 = lowest; 0: none known */
};

struct comparison_input {
    const char *name;
    struct input_correlation correlation;
    double coherence; /* with the measured output, 0 … 1, mean weighted by its spectrum; NAN for a single pulse */
    double coherence_bound; /* exceeded by chance in 5 % of bins */
};

struct comparison_channel {
    size_t record;
    const char *name; /* of the model's output */
    bool held_out;    /* a --check record */
    size_t n;
    double t0_s, dt_s;
    const double *measured; /* [n], in the record; unit of the channel, as the next three */
    double *predicted;      /* [n] */
    double *residual;       /* [n] measured − predicted */
    double rms, residual_rms;
    struct noise_estimate noise;
    double nrmse;       /* residual_rms/rms */
    double noise_ratio; /* residual_rms over the rms of the noise; NAN when the noise is unknown */
    double scale;       /* c of the least-squares fit measured ≈ c · predicted */
    double alignment;   /* correlation of measured and predicted, −1 … 1 */
    size_t n_bands;
    struct comparison_band *bands; /* [n_bands] ascending: one mode in each, or octaves of a model without modes */
    double time_share[3];          /* of Σ r², in the thirds of the record */
    struct amplitude_shares amplitude;
    struct whiteness whiteness;
    size_t n_autocorrelation;
    double *autocorrelation; /* [n_autocorrelation] of the residual, lag 0 first */
    size_t n_inputs;         /* that move the beam in this record */
    struct comparison_input inputs[COMPARE_INPUTS];
    char warning[400]; /* of units or sign; "" none */
};

struct comparison {
    const struct model *model;
    const struct record *records;
    size_t n_records, n_held_out; /* the held-out records are the last ones */
    size_t n_notes;
    char **notes;  /* [n_notes] sentences: per-record values that were estimated from the records themselves */
    double *level; /* [n_records] factor of the excitation; 1 where it is known */
    size_t n_modes;
    double *frequency_Hz; /* [n_modes] of the model, ascending, up to the highest Nyquist frequency */
    size_t n_channels;
    struct comparison_channel *channels;   /* [n_channels] in the order of the records */
    double nrmse, noise_ratio;             /* root mean square over channels of the records that are not held out */
    double check_nrmse, check_noise_ratio; /* of the held-out ones; NAN: none */
    struct attainable attainable; /* of the ones not held out; filled by the caller that wants it, else no modes */
};

/*
 * records: [n_records], the last n_held_out of which were held out of the fit. options may be NULL. model and records must
 * outlive the comparison. BF_NUMERIC: the model cannot be evaluated. Free with compare_free(), also after a failure. Cost: one
 * prediction of all records, about 10 ms a channel of 4096 samples for its noise, and a fit where a record has no per-record
 * values of its own.
 */
enum bf_status compare_run(const struct model *model, const struct record records[], size_t n_records,
                           size_t n_held_out, const struct predict_options *options, struct comparison *out,
                           struct bf_error *err);
void compare_free(struct comparison *comparison);

/*
 * LONG RECORDS — a record whose samples are read piece by piece, so that memory does not grow with it. Its first COMPARE_HEAD samples are a record like any other, of which
 * compare_run() makes its channels; compare_take_long() then replaces what is said of them by what all samples say. Measured, predicted and residual samples stay
 * those of the head.
 */
enum { COMPARE_HEAD = 262144 };

struct long_record; /* the sums over all samples */

/* x[n]: a column's samples from `first` on. */
struct long_reader {
    void (*read)(void *context, const char *column, size_t first, size_t n, double x[]);
    void *context;
};

/*
 * head: the first samples of a record of n. *out NULL, and BF_OK: its answer cannot be predicted in pieces (predict_streamed()), or something has to be solved for first
 * (an excitation of unknown level, values of its own), and it must be in memory. The model must outlive *out. BF_NUMERIC as compare_run(). Cost: one prediction, and the
 * noise of every 131072 samples. Free with long_record_free(), also after a failure.
 */
enum bf_status long_record_sum(const struct model *model, const struct record *head, size_t n,
                               const struct predict_options *options, const struct long_reader *reader,
                               struct long_record **out, struct bf_error *err);
/* record: the head's index in the comparison. */
void compare_take_long(struct comparison *comparison, size_t record, const struct long_record *sums);
void long_record_free(struct long_record *record);

/* The band with the largest share of the misfit; NULL when there is none. */
const struct comparison_band *compare_worst_band(const struct comparison_channel *channel);

/* Residuals within this factor of the noise hold nothing that could be told from it; NAN (not known) is not within. */
bool compare_is_noise(double noise_ratio);
/* The same of a channel, two standard errors of its noise's level allowed for. */
bool compare_channel_is_noise(const struct comparison_channel *channel);

/*
 * SUSPECT — what is ordinary, before a misfit is taken for physics.
 *
 * compare_suspect(): one sentence about one channel, or "": every input is zero; a factor between measured and predicted explains most of the
 * misfit (gain, sign, unit, level); a mode's peak is at another frequency; of a held-out record also another place. Cost: two transforms of the channel.
 */
enum { SUSPECT_TEXT = 400 };
void compare_suspect(const struct comparison *comparison, const struct comparison_channel *channel,
                     char text[SUSPECT_TEXT]);

/*
 * Held-out records that the model predicts far worse than those it was fitted to, where an ordinary cause explains most of that: the causes above,
 * or another place of the hit, the drive or the sensor (a factor for each mode). One sentence a channel, without its full stop.
 */
struct disagreements {
    size_t n;
    char **notes;
};

/*
 * fitted_nrmse: what the model leaves on the records that were fitted. Errors as compare_run(). Free with disagreements_free(), also after a
 * failure. Cost: compare_run() of the held-out records.
 */
enum bf_status disagreements_find(const struct model *model, const struct record held_out[], size_t n,
                                  const struct predict_options *options, double fitted_nrmse, struct disagreements *out,
                                  struct bf_error *err);
void disagreements_free(struct disagreements *disagreements);
/* Do errors that are known already (fit_errors() of the held-out records) leave anything for disagreements_find() to say? */
bool disagreements_possible(const struct fit_channel_error channels[], size_t n, double fitted_nrmse);

/*
 * LOCALISE — where the misfit above the noise is: record, channel, band of one mode, time, amplitude.
 *
 * Shares are of Σ (|R|² − noise)/noise_rms² over all channels: channels of different units weigh by their noise, and what is
 * noise counts nothing.
 */

enum localise_amplitude { AMPLITUDE_ALL, AMPLITUDE_LARGE, AMPLITUDE_SMALL };

/* One band of one channel of one record. */
struct localised {
    size_t channel; /* index into the caller's channels */
    double from_Hz, to_Hz;
    size_t mode;        /* the one inside, 1 = lowest; 0: none */
    double share;       /* of the whole misfit above the noise, 0 … 1 */
    double noise_ratio; /* rms in the band over the noise's there */
    double relative;    /* rms of the misfit above the noise over rms of the measured signal in the band */
    double late_share;  /* of the band's misfit, in the second half of the motion (by energy: 0.5 is even) */
    /* LARGE, SMALL: the relative misfit is clearly larger where, or in the records in which, the motion is large, small. */
    enum localise_amplitude amplitude;
};

struct localisation {
    double excess; /* Σ (r² − noise²)/noise² over all rows, over the rows: 0 nothing is left, 3: noise_ratio 2 */
    size_t n;      /* parts that have more than 2 % of the misfit, largest first */
    struct localised *parts;
    char text[600]; /* sentences for a person */
};

/*
 * frequency_Hz: [n_modes] ascending; 0 modes: octaves. Channels without a noise level are left out. Free with
 * localise_free(), also after a failure. Cost: about 2 ms a channel of 4096 samples.
 */
enum bf_status localise_misfit(const struct misfit_channel channels[], size_t n_channels, const double frequency_Hz[],
                               size_t n_modes, struct localisation *out, struct bf_error *err);
void localise_free(struct localisation *localisation);

/* [{file, channel, from_Hz, to_Hz, share, amplitude}, …]: the `where` of `diagnose --json`. */
struct json *localise_json(const struct localisation *localisation, const struct misfit_channel channels[]);

/*
 * HISTORY — models in the order in which they were made from each other, and what each step brought. Each file knows
 * the SHA-256 of the file it was made from; nothing is computed again.
 */

struct history_entry {
    struct model model;
    char *file;  /* as given, or as found */
    int parent;  /* index of the nearest ancestor among the entries; −1: none is there */
    int depth;   /* steps from its root */
    bool placed; /* it has its place in the order */
};

struct history {
    struct history_entry *entries;
    int n;
    int *order; /* [n] indices, every model after its parent */
};

/*
 * Reads the model files paths[n] and orders them. BF_BAD_FILE: one cannot be read. Free with history_free(), also after a
 * failure.
 */
enum bf_status history_read(const char *const paths[], size_t n, struct history *out, struct bf_error *err);

/*
 * A model with those of its ancestors that stand in its file's directory (*.yaml, *.yml, known by their SHA-256 under
 * whatever name) or among `others`, which may lie anywhere. A copy of one that is there counts once. BF_USAGE when one of
 * the others is no ancestor; BF_BAD_FILE when it cannot be read.
 * Cost: reads every model file of the directory, at most 1000.
 */
enum bf_status history_of(const char *path, const char *const others[], size_t n_others, struct history *out,
                          struct bf_error *err);
void history_free(struct history *history);

/* The parent of entry i among the entries; NULL: none is there. */
const struct model *history_parent(const struct history *history, int i);

/* Calls call(context, effect's id, gained) once for each effect that `model` has and `than` (NULL: no effects) has not. */
void history_surplus(const struct model *model, const struct model *than, void (*call)(void *, const char *, bool),
                     void *context, bool gained);

/* What entry i has and its parent has not, as the table says it: "+tip_mass −hum; fitted". text: [size], cut when longer. */
void history_step(const struct history *history, int i, char *text, size_t size);

/* An error or noise ratio of a struct fit_info, in which 0 stands for none; NAN then. */
double history_error(double x);

/* How many of the models were fitted. */
int history_fits(const struct history *history);

/*
 * POLE TABLE — measured frequencies beside the undamped ones of a model, each with the mode that it belongs to, and what their ratios say together: one factor on
 * all is a scale; a frequency that is 10 % from every mode, once the common factor is off, is no mode of the model.
 */
struct pole_pair {
    struct measured_frequency measured;
    size_t mode;            /* 1: the lowest; 0: no mode of the model */
    double model_Hz, ratio; /* measured/model; NAN where there is no mode */
    double model_damping;   /* pole_table_damping(); NAN likewise */
    double mac;             /* pole_table_shapes(); NAN: no shape was measured */
};
struct pole_table {
    size_t n, n_pairs;
    struct pole_pair *pairs; /* [n] as measured */
    size_t places;           /* pairs of places that the records tell shapes by, pole_table_of_records(); else 0 */
    double factor, spread;   /* mean of the ratios, and their standard deviation as a share of it */
    char text[1600];         /* sentences; "" with fewer than three pairs */
};

/* model_Hz[n_model] ascending. O(measured · modes). Free with pole_table_free(). */
void pole_table_make(const struct frequency_list *measured, const double model_Hz[], size_t n_model,
                     struct pole_table *out);
void pole_table_free(struct pole_table *table);
/* Modal assurance criterion (φᵀψ)²/(φᵀφ ψᵀψ) of the list's shapes, measured in two places or more, and those of the modes. */
void pole_table_shapes(struct pole_table *table, const struct frequency_list *measured, const struct modes *modes);
/*
 * The poles of the fitted records themselves, with standard errors, beside the modes of the model. Shapes are compared where outputs or inputs at several places, in one record or in
 * many, tell them: residue over residue, of all pairs of an output's and an input's place; for free decays of all outputs of one record. n 0: no pole was stable. Free with
 * pole_table_free(), also after a failure. Cost: some 0.1 s a channel of 4096 samples.
 */
enum bf_status pole_table_of_records(const struct comparison *all, const struct stabilisation *stable,
                                     struct pole_table *out, struct bf_error *err);
/* The damping ratios of the modes that the table was made with. */
void pole_table_damping(struct pole_table *table, const struct modes *modes);

/*
 * LINES — records that are no samples, beside a model as it is: errors; of a list of frequencies the table, of a spectrum without phase both curves.
 */
struct line_comparison {
    const struct record *records;
    size_t n, n_held_out; /* the held-out ones are the last */
    size_t n_channels;
    struct fit_channel_error
        *channels; /* frequencies and damping ratios of a list: nrmse is the rms of relative differences */
    struct modes modes;
    struct pole_table *tables; /* [n] of lists */
    struct {
        size_t n;
        struct line_spectrum *all; /* [n] */
    } * spectra;                   /* [n] of spectra without phase */
};

/* records: none over time. Errors as compare_run(). Free with compare_lines_free(), also after a failure. Cost: one evaluation and the modes. */
enum bf_status compare_lines(const struct model *model, const struct record records[], size_t n, size_t n_held_out,
                             const struct predict_options *options, struct line_comparison *out, struct bf_error *err);
void compare_lines_free(struct line_comparison *lines);
/* Into the totals of a comparison of the records over time. */
void compare_add_lines(const struct line_comparison *lines, struct comparison *all);

#endif
