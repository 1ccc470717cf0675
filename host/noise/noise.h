/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * noise.h — how noisy a channel is, judged from the recording alone, without any model of the beam.
 *
 * Two sources:
 *   local    the local rational method (McKelvey & Guérin 2012; Geerardyn & Schoukens 2017): in a narrow band any linear
 *            system with any initial and final state obeys A(f) Y = B(f) U + I(f) with low-order polynomials; what does
 *            not is noise. Nonlinear distortion, harmonics and hum are not noise of the channel: they stand out of the
 *            smooth background, which is what is returned.
 *   quiet    samples before anything moves (at least 64, inputs and output quiet), where they are clearly quieter than
 *            what the whole record suggests. A few quiet samples tell less than a whole record does: 64 of them know the
 *            noise to 9 %, 4096 samples to 1.2 %.
 */
#ifndef BEAMFIT_NOISE_H
#define BEAMFIT_NOISE_H

#include "model/model.h"
#include "record/record.h"

enum noise_method { NOISE_NONE, NOISE_QUIET, NOISE_LOCAL };

struct noise_estimate {
    enum noise_method method;
    double rms;          /* of the noise, unit of the channel; 0 when there is none to be seen */
    double rms_sd;       /* one standard error of rms */
    size_t n_used;       /* samples (quiet) or spectral cells (local) that carry the estimate */
    double used_share;   /* of the cells that could have been used; small: much of the record is not linear */
    double quantisation; /* step of the recorder found in the samples, 0 when none is visible */
    size_t n_bins;       /* psd at 0, df, 2 df … Nyquist */
    double df_Hz;
    double *psd; /* [n_bins] one-sided, smooth, unit²/Hz; Σ psd df = rms² */
};

/* "pre-trigger samples", "local rational method", "none" */
const char *noise_method_text(enum noise_method method);

/*
 * z: [n] the channel. u: [n_inputs] arrays of [n], the inputs that move the beam; n_inputs 0: a free decay, whose samples
 * before from_sample are left out. n ≥ 64. A channel too short or constant gives method NOISE_NONE with rms 0.
 * Free with noise_free(). About 10 ms for 4096 samples.
 */
enum bf_status noise_estimate(const double *z, size_t n, double dt_s, const double *const u[], size_t n_inputs,
                              size_t from_sample, struct noise_estimate *out, struct bf_error *err);
/* The same for an output of a model in a record: takes the inputs and the start of a free decay from them. */
enum bf_status noise_of_channel(const struct model *model, const struct record *record, const char *channel,
                                struct noise_estimate *out, struct bf_error *err);
void noise_free(struct noise_estimate *estimate);

#endif
