/* SPDX-License-Identifier: GPL-3.0-or-later */
/* estimate_modes.h — models fitted to measured modes; part of estimate.h */
#ifndef BEAMFIT_ESTIMATE_MODES_H
#define BEAMFIT_ESTIMATE_MODES_H

#include <complex.h>
#include <stdbool.h>
#include <stddef.h>

#include "ground/ground.h"
#include "model/model.h"
#include "noise/noise.h"
#include "record/record.h"
#include "response/response.h"

/*
 * MODES — the modes that a free linear model has told, and models fitted to them instead of to samples: a start for refit_run(), and quick to judge.
 */
struct measured_modes {
    size_t n, n_outputs, n_inputs; /* of the model */
    double complex *pole;          /* [n] Im > 0, ascending in size */
    double complex *residue;       /* [n][n_outputs][n_inputs] as of struct attainable; NaN: not known */
};
/* What makes a pole of a free linear model a mode of a beam; all that is set by hand. */
extern const struct beam_mode_limits {
    double in_band; /* of the Nyquist frequency: above it a pole stands for what lies beyond the band */
    double damping; /* ratio: above it, it is a damper */
    double
        decay; /* of the amplitude's logarithm within the longest record: what decays less is a tone that something drives */
    double counts; /* times the floor: without the pole that model leaves more */
} beam_mode_limits;
bool beam_mode_decays(double frequency_Hz, double damping_ratio, double longest_s);

/* The modes of a beam that lie in the band and that count. Free with measured_modes_free(). */
struct measured_modes measured_modes_of(const struct attainable *attainable, const struct record records[],
                                        size_t n_records);
void measured_modes_free(struct measured_modes *modes);
/* |p|^(1 − ν) of a mode, ν being the order of the path's output: residues times that are of one size in all modes, as shapes are. path: output · n_inputs + input. */
double measured_modes_weight(const struct measured_modes *modes, const struct model *model, size_t mode, size_t path);

struct modal_options {
    struct predict_options predict;
    double sharpness; /* standard errors are those below over this; 0: 1 */
    bool rough;       /* a few steps: good enough to rank starts of one model */
    double complex *
        fitted; /* [n][n_outputs][n_inputs], out: the model's own residues, 0 of a mode that it lacks; NULL: not wanted */
};

/*
 * The model's free values fitted to the modes, from those it has. *left: rms over frequencies (standard error 0.1 %), damping ratios (5 %), residues (10 %) and priors,
 * whatever the sharpness. After a failure the model is as it was. For linear models without values per record. Some twenty evaluations of a system: 10 ms; rough: 4 ms.
 */
enum bf_status refit_to_modes(struct model *model, const struct measured_modes *modes,
                              const struct modal_options *options, double *left, struct bf_error *err);

#endif
