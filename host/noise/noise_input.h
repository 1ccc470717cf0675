/* SPDX-License-Identifier: GPL-3.0-or-later */
/* noise_input.h — the noise of a measured input, as it comes through the beam; private to noise/ */
#ifndef BEAMFIT_NOISE_INPUT_H
#define BEAMFIT_NOISE_INPUT_H

#include "noise.h"

/* An input that moves the beam, as it is recorded. */
struct noise_channel_input {
    const double *u;                  /* [n] */
    const struct column_noise *cells; /* of one that was cleaned; else NULL */
    double *gain; /* [n/2 + 1] |H|² times what is kept, of attainable_gains(); NULL: P_y/P_u stands for |H|² */
};

/* Rms of the noise that it has, or had before it was cleaned; 0: none. */
double noise_rms_of(const struct noise_channel_input *input, size_t n);

/*
 * gain of inputs[n_outputs][n_inputs] (the same inputs for each output), from the free linear model of the record alone (attainable_find()); own_rms[n_outputs]: the
 * noise of the outputs without what is carried. Those stay NULL that it does not have: of an output that the record lacks, of a long record. To be freed one by one.
 * Cost: that of attainable_find() for one record, 0.05 to 0.2 s.
 */
enum bf_status attainable_gains(const struct model *model, const struct record *record, const double own_rms[],
                                struct noise_channel_input inputs[], size_t n_inputs, struct bf_error *err);

/*
 * A force that a sensor has measured has noise of its own, and the prediction answers it: the output's residual then holds
 * |H|² S_u beside the output's own noise (errors in variables; Pintelon & Schoukens 2012). Where the output is the
 * answer to the input, |H|² = P_y/P_u, so that of the output's power the part S_u/P_u is noise; no model is needed for that.
 * S_u is what was kept of the noise of a cleaned input, the noise of noise_of_input() of another. Adds to estimate->psd and ->rms. O(n log n).
 */
enum bf_status noise_add_inputs(const double *z, const struct noise_channel_input inputs[], size_t n_inputs, size_t n,
                                double dt_s, struct noise_estimate *estimate, struct bf_error *err);

#endif
