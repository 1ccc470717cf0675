/* SPDX-License-Identifier: GPL-3.0-or-later */
/* noise_estimate.h — the noise of one channel, from plain arrays. Private to noise/; see NOISE in noise.h. */
#ifndef BEAMFIT_NOISE_ESTIMATE_H
#define BEAMFIT_NOISE_ESTIMATE_H

#include "noise.h"
#include "noise_input.h"

enum { NOISE_MOST_INPUTS = 4 }; /* of one record */

/*
 * z: [n] the channel. inputs: [n_inputs], those that move the beam; n_inputs 0: a free decay, whose samples
 * before from_sample are left out. A channel of fewer than 64 samples or of one value gives method NOISE_NONE with rms 0;
 * numbers that are not finite are BF_NUMERIC. Free with noise_free(). About 10 ms for 4096 samples.
 */
enum bf_status noise_estimate(const double *z, size_t n, double dt_s, const struct noise_channel_input inputs[],
                              size_t n_inputs, size_t from_sample, struct noise_estimate *out, struct bf_error *err);

/* The same without what the noise of the inputs makes of it, which noise_add_inputs() adds. */
enum bf_status noise_estimate_own(const double *z, size_t n, double dt_s, const struct noise_channel_input inputs[],
                                  size_t n_inputs, size_t from_sample, struct noise_estimate *out,
                                  struct bf_error *err);

/* The smallest step between values, when every value is a whole number of steps from the first; else 0. O(n log n). */
double recorder_step(const double *z, size_t n);

#endif
