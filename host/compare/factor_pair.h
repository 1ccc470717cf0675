/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * factor_pair.h — one output as one input drives it: the factor between measured and predicted, found with the sign and the size of
 * that factor left open. Private to compare/.
 *
 * The check has a model of its own: stiffness open within a factor, damping as the model frees it, mass per length (of what is no patch), places and
 * gains held, laws left out. Each record's level is a linear unknown of any sign, so one fit tells them all.
 */
#ifndef BEAMFIT_FACTOR_PAIR_H
#define BEAMFIT_FACTOR_PAIR_H

#include "compare.h"

enum { FACTOR_RECORDS = 2 }; /* of one pair, at most: the strongest tell enough */

struct factor_pair {
    size_t output, input; /* of the model; input SIZE_MAX: several drive at once */
    size_t n_records, record[FACTOR_RECORDS];
    double time_factor; /* of the records' time axes; 1: as they are */
    double reference;   /* factor that another output has under the same input, whose gain is open; 0: none */
    size_t against;     /* that output */
    bool told;          /* the rest is known */
    double found;       /* measured = found × predicted, the median over the records */
    double factor; /* of the hypotheses: its sign, times 1, 9.80665, 10, 1000 or their inverse; 1: nothing to say */
    double before, after; /* error of a fit without and with the factor */
};

/* Fills `told` and what follows it. BF_OK also where nothing can be told. Cost: one to four short fits. */
enum bf_status factor_pair_judge(const struct model *model, const struct record records[],
                                 const struct predict_options *options, struct factor_pair *pair, struct bf_error *err);

/* A patch's gain that the model leaves open has no size to be wrong by. */
bool factor_size_is_stated(const struct model *model, const struct factor_pair *pair);

/* ---- factor_errors.c ---- */

/*
 * nrmse[n_records · n_outputs], infinite where it is not known: of the fit (NULL: none) where that has kept the size and the sign of the response as the
 * model gives them, else of the model as it is. fitted: of this model to these records and, behind them, lists.
 */
enum bf_status factor_errors(const struct model *model, const struct record records[], size_t n_records,
                             const struct predict_options *options, const struct fit_result *fitted, double nrmse[],
                             struct bf_error *err);

/* ---- factor_modes.c ---- */

/*
 * A free linear model has found the modes of the records, and this model, fitted to those, answers each input at each output with their sign and within a factor of two
 * of their size: no channel has a wrong sign, unit or name. False where that is not settled. Cost: attainable_find(), which *attainable is from; to be freed.
 */
bool factor_modes_agree(const struct model *model, const struct record records[], size_t n_records,
                        const struct predict_options *options, struct attainable *attainable);

/* ---- factor_check.c ---- */

/* The model of the check, for one output (SIZE_MAX: all of them). *out is to be freed also after a failure. */
enum bf_status factor_check_model(const struct model *given, size_t output, struct model *out, struct bf_error *err);

/* Samples of a record that are enough for it. */
size_t factor_enough(const struct model *model, const struct record *record);

/* ---- factor_time.c ---- */

/* Hz; 0: the model has none. */
enum bf_status factor_lowest_mode(const struct model *model, double *frequency_Hz, struct bf_error *err);
/* z: a column of the record. */
enum bf_status factor_strongest_line(const struct record *record, const double z[], double *line_Hz,
                                     struct bf_error *err);

/* ---- factor_place.c ---- */

/*
 * Where neither a sign nor a size explains an output: is one channel at another place, or do two columns stand under each other's names? out->after is infinite
 * when neither, and for drives of one line. places: another place is asked for, too. record: [n] indices of records, the strongest; known: what a fit is known to leave of them, which a place must beat (infinite: nothing is). Cost: some ten short fits of those records, all outputs at once.
 */
enum bf_status factor_place_find(const struct model *model, const struct record records[], const size_t record[],
                                 size_t n, double known, bool places, const struct predict_options *options,
                                 struct channel_factor *out, struct bf_error *err);

/* ---- factor_bands.c: does one factor hold for the whole spectrum? ---- */

struct factor_bands {
    bool turned; /* some band with a part in the signal has the other sign */
    bool early;  /* the bands that agree are so narrow and high that a delay of a few samples could turn them */
    bool even;   /* bands an octave apart have the same factor */
};

/* measured, fitted: [n]. */
enum bf_status factor_bands_judge(const double measured[], const double fitted[], size_t n, struct factor_bands *out,
                                  struct bf_error *err);

/*
 * Does an input of the record (SIZE_MAX: any of the model's) drive more than an octave? A steady sine answers with either sign, as its
 * frequency is below or above a mode.
 */
enum bf_status factor_drive_wide(const struct model *model, const struct record *record, size_t input, bool *wide,
                                 struct bf_error *err);

/* ---- factor_words.c ---- */

/* What a column may hold whose factor is of this size. */
const char *factor_unit_words(const struct model *model, const struct channel_factor *f);

/* The size of the hypothesis that `found` > 0 is near, else 1; even: one factor holds for all bands. */
double factor_size_of(double found, bool even);

/* Fills text and line of a finding whose other members are there. */
void factor_words(const struct model *model, struct channel_factor *finding);

/* ---- factor_scale.c ---- */

/*
 * The factor between measured and predicted of a model that knows the beam explains most of the misfit: a sentence, or false. named: only where it is one of the
 * hypotheses, a sign or a unit.
 */
bool factor_scale_words(const struct model *model, const struct comparison_channel *c, bool named,
                        char text[SUSPECT_TEXT]);

#endif
