/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linearity_plane.h — spectrograms and convolutions of whole records. Private to noise/. */
#ifndef BEAMFIT_LINEARITY_PLANE_H
#define BEAMFIT_LINEARITY_PLANE_H

#include <complex.h>

#include "maths/maths.h"

/* Hann segments, a sixteenth of a record long, three quarters overlapping; the first ones begin before the record. */
struct linearity_plane {
    size_t segment, hop, n_times, n_bins; /* n_bins: 0 … Nyquist */
    const struct fft *plan;
    double *window; /* [segment] Hann */
};

enum bf_status linearity_plane_new(size_t n, struct linearity_plane *out, struct bf_error *err); /* free(window) */
/* A[n_bins]: transform of segment t of x[n] under the window, through a[segment]. */
void linearity_segment(const struct linearity_plane *p, const double *x, size_t n, size_t t, double *a,
                       double complex *A);
/* power[n_times][n_bins] of x[n], zero outside; segment t ends before sample (t + 1)·hop. */
void linearity_spectrogram(const struct linearity_plane *p, const double *x, size_t n, double *power);

/* Linear convolution of whole records of n samples, cut to the record. */
struct linearity_convolution {
    size_t n, m;
    const struct fft *plan;
    double *x;
    double complex *X;
};

enum bf_status linearity_convolution_new(size_t n, struct linearity_convolution *out, struct bf_error *err);
void linearity_convolution_free(struct linearity_convolution *c);
/* Zero-padded transform of x[n]; caller frees. */
double complex *linearity_transform(struct linearity_convolution *c, const double *x);
/* e[n] = b * x − a * y */
void linearity_commute(struct linearity_convolution *c, const double complex *B, const double complex *X,
                       const double complex *A, const double complex *Y, double *e);

#endif
