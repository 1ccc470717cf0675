/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * candidate.h — which effects of the catalogue could act on a model and its records, and where a scan of each would look.
 *
 * Every effect of the build is considered (no list of names): what matters is which slots it uses, the roles and flags of
 * its parameters, and whether the model has the channels, the patch or the clamp that it needs.
 */
#ifndef BEAMFIT_CANDIDATE_H
#define BEAMFIT_CANDIDATE_H

#include "model.h"
#include "record.h"

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

#endif
