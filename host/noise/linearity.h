/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * linearity.h — is there a linear time-invariant system at all that explains records of different level? Without a model.
 *
 * Two records of one path with inputs u₁, u₂ that begin at rest, of a linear system h:
 *     (u₂ * y₁)(t) − (u₁ * y₂)(t) = (u₂ * h * u₁ − u₁ * h * u₂)(t) = 0     for every t of the record, ringing at its end or not.
 * What is left is compared with what noise of the known level leaves after the same operation, in every cell of the
 * spectrogram: ratio = √(mean of cell/expected) is 1 for a linear system. Where u₂ = k u₁ this is y₂ − k y₁ itself.
 * A signal that does not scale with the input (hum, offset) shows too; steady lines are found, taken out, and told apart.
 * Systems that are homogeneous of degree 1 pass (bilinear stiffness), and so does whatever is the same in both records.
 */
#ifndef BEAMFIT_LINEARITY_H
#define BEAMFIT_LINEARITY_H

#include <stdbool.h>
#include "model/model.h"
#include "noise.h"
#include "record/record.h"

enum linearity_verdict {
    LINEARITY_CANNOT_TELL, /* no two records repeat a path from rest */
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
    bool nonlinear; /* see linearity_threshold */
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

/* Above this a pair is not linear; see docs/diagnose.md, 'Linearity', for the simulation that set it. */
extern const double linearity_threshold;

/*
 * noise: [n_records · model->n_outputs] as of noise_of_channel(), index record · n_outputs + output; method NOISE_NONE
 * leaves a channel out. NULL: estimated here (10 ms a channel). Free with linearity_free(), also after a failure.
 * Cost: about 6 ms for a pair of 4096 samples.
 */
enum bf_status linearity_test(const struct model *model, const struct record records[], size_t n_records,
                              const struct noise_estimate noise[], struct linearity *out, struct bf_error *err);
void linearity_free(struct linearity *linearity);

/*
 * Steady lines, offset and drift of a series: the channel itself where it is quiet, or better a residual. u: inputs of the
 * record, [n_inputs] of [n]; a line that an input has too is not reported. found: room for `room`; returns how many.
 */
size_t linearity_find_added(const double x[], size_t n, double dt_s, const double *const u[], size_t n_inputs,
                            struct linearity_added found[], size_t room);

#endif
