/* SPDX-License-Identifier: GPL-3.0-or-later */
/* noise_input.h — the noise of a measured input, as it comes through the beam; private to noise/ */
#ifndef BEAMFIT_NOISE_INPUT_H
#define BEAMFIT_NOISE_INPUT_H

#include "noise.h"

/* An input that moves the beam, as it is recorded. */
struct noise_channel_input {
    const double *u;                  /* [n] */
    const struct column_noise *cells; /* of one that was cleaned; else NULL */
};

/*
 * A force that a sensor has measured has noise of its own, and the prediction answers it: the output's residual then holds
 * |H|² S_u beside the output's own noise (errors in variables; Pintelon & Schoukens 2012). No model is needed for H: where the output is the
 * answer to the input, |H|² = P_y/P_u, so that of the output's power the part S_u/P_u is noise.
 * S_u is what was kept of the noise of a cleaned input, the noise of noise_of_input() of another. Where the beam rings longer than the record, up to √2 too much (rms);
 * where a drive that was not cleaned leaves a resonance between its lines, too little. Adds to estimate->psd and ->rms. O(n log n).
 */
enum bf_status noise_add_inputs(const double *z, const struct noise_channel_input inputs[], size_t n_inputs, size_t n,
                                double dt_s, struct noise_estimate *estimate, struct bf_error *err);

#endif
