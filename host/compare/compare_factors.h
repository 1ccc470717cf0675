/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_factors.h — a sign, a unit or a decade that is wrong; part of compare.h */
#ifndef BEAMFIT_COMPARE_FACTORS_H
#define BEAMFIT_COMPARE_FACTORS_H

#include <stdbool.h>
#include <stddef.h>

#include "estimate/estimate.h"
#include "ground/ground.h"
#include "model/model.h"
#include "noise/noise.h"
#include "record/record.h"

/*
 * FACTORS — a sign, a unit or a decade of a channel that is wrong, told from the records before anything else is asked of them.
 *
 * Each output is fitted alone to each input's records, with the factor between them open and the mass per length held. A factor is named
 * only where the error falls strongly with it and where it holds for all bands of the signal: a mass, a spring or a wrong place turns or
 * shrinks some modes, not all. What only a product tells (one input, one output) is said so. Where no factor explains an output, the exchange of each
 * two columns is tried and, if it is asked for, another place of each channel.
 */

enum factor_kind {
    FACTOR_CHANNEL,
    FACTOR_TIME,
    FACTOR_NO_TIME,  /* no unit of time makes a motion of the beam of the records: frequencies? */
    FACTOR_PLACE,    /* the channel was at another place */
    FACTOR_EXCHANGE, /* two columns stand under each other's names */
};

struct channel_factor {
    enum factor_kind kind;
    bool is_input; /* the channel is an input of the model, else an output; not read of times */
    size_t channel;
    bool either;         /* the records cannot tell it from the same in channel `other`, which is an input */
    bool other_is_input; /* FACTOR_EXCHANGE */
    size_t other;
    double other_found; /* FACTOR_PLACE: of `other` */
    bool relative;      /* its size is told against output `against` alone: the input's own gain is open */
    size_t against;
    double factor; /* measured = factor × predicted, one of the hypotheses; FACTOR_TIME: seconds = factor × time_s */
    double found;  /* as estimated; FACTOR_PLACE: the place, m from the clamp */
    double before, after; /* error (nrmse) of a fit without and with it */
    char text[900];       /* sentences for a person */
    const char *block;    /* of the model file: "inputs", "outputs", "parameters"; NULL: nothing to write there */
    char line[200];       /* in it, as it should be; "" likewise */
};

struct channel_factors {
    size_t n;
    struct channel_factor *all;
    struct attainable
        free_model; /* of model and records as they were, if it was asked for on the way; else it has no modes */
};

/*
 * Nothing is looked for in free decays and records of unknown level, and nothing where the model as given is within half of the
 * signal, or `fitted` is: a fit of it to these records (NULL: none) that has kept the size of the response. model and records are not changed. Free with
 * channel_factors_free(), also after a failure.
 * Cost: a prediction of the records; where that is far off, one to four short fits for each output and input; where no factor explains them one more for each
 * two channels and, with `places`, up to five for each.
 */
enum bf_status channel_factors_find(const struct model *model, const struct record records[], size_t n_records,
                                    const struct predict_options *options, const struct fit_result *fitted, bool places,
                                    struct channel_factors *out, struct bf_error *err);
void channel_factors_free(struct channel_factors *factors);

/* The model with the factors in its gains and the places found, as the lines say; what is wrong with the records changes nothing. */
void channel_factors_apply(const struct channel_factors *factors, struct model *model);
/* The records with their times in seconds and exchanged columns back under their names. */
void channel_factors_apply_to_records(const struct channel_factors *factors, const struct model *model,
                                      struct record records[], size_t n_records);

#endif
