/* SPDX-License-Identifier: GPL-3.0-or-later */
/* spectrogram.h — power of a record in cells of time and frequency. Private to noise/. */
#ifndef BEAMFIT_SPECTROGRAM_H
#define BEAMFIT_SPECTROGRAM_H

#include <complex.h>

#include "maths/maths.h"

/* Hann segments, a sixteenth of a record long, three quarters overlapping; the first ones begin before the record. */
struct spectrogram {
    size_t segment, hop, n_times, n_bins; /* n_bins: 0 … Nyquist */
    const struct fft *plan;
    double *window; /* [segment] Hann */
};

enum bf_status spectrogram_new(size_t n, struct spectrogram *out, struct bf_error *err); /* free(window) */
/* A[n_bins]: transform of segment t of x[n] under the window, through a[segment]. */
void spectrogram_segment(const struct spectrogram *p, const double *x, size_t n, size_t t, double *a,
                         double complex *A);
/* power[n_times][n_bins] of x[n], zero outside; segment t ends before sample (t + 1)·hop. */
void spectrogram_power(const struct spectrogram *p, const double *x, size_t n, double *power);

#endif
