/* SPDX-License-Identifier: GPL-3.0-or-later */
/* noise_input.h — the noise of a measured input, as it comes through the beam; private to noise/ */
#ifndef BEAMFIT_NOISE_INPUT_H
#define BEAMFIT_NOISE_INPUT_H

#include "noise.h"

/*
 * A force that a sensor has measured has noise of its own, and the prediction answers it: the output's residual then holds
 * |H|² S_u beside the output's own noise (errors in variables; Pintelon & Schoukens 2012). No model is needed for H: where the output is the
 * answer to the input, |H|² = P_y/P_u, so that of the output's power the part S_u/P_u is noise.
 * S_u is taken as white, from the cells of the input's spectrogram that its drive does not reach, or from the median of |u| of a short record that rests most of
 * the time. A drive that is random itself, or rests exactly, adds nothing. Where the beam rings longer than the record, up to √2 too much (rms). Adds to estimate->psd and ->rms. O(n log n).
 */
enum bf_status noise_add_inputs(const double *z, const double *const u[], size_t n_inputs, size_t n, double dt_s,
                                struct noise_estimate *estimate, struct bf_error *err);

#endif
