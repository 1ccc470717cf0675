/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linearity_work.h — what linearity.c (which pairs, verdict) and linearity_pair.c (one pair) share; for nobody else. */
#ifndef BEAMFIT_LINEARITY_WORK_H
#define BEAMFIT_LINEARITY_WORK_H

#include "noise.h"
#include "linearity.h"
#include "maths/maths.h"

/* One channel of one record and the only input that moves in it. Views. */
struct linearity_signal {
    size_t record, output, input;
    size_t n;
    double dt_s;
    const double *u, *y; /* [n] */
    double *cleaned;     /* [n] y without what was found added to it */
    double u_noise_rms;  /* of the input's recording before it moves; 0: none seen */
    double level;        /* rms of y */
    const struct noise_estimate *noise;
};

/* What was found added, at sample i of n. */
double linearity_added_at(const struct linearity_added *added, size_t i, size_t n, double dt_s);

/* Frequencies that are left out of ratio_broad: each takes the cells it leaks into. */
struct linearity_lines {
    size_t n;
    double frequency_Hz[32];
};

/* Fills everything of *pair from `same_shape` on, and nonlinear. weak->dt_s == strong->dt_s. */
enum bf_status linearity_pair_measure(const struct linearity_signal *weak, const struct linearity_signal *strong,
                                      const struct linearity_lines *lines, struct linearity_pair *pair,
                                      struct bf_error *err);

/* Hann segments, a sixteenth of a record long, three quarters overlapping; the first ones begin before the record. */
struct linearity_plane {
    size_t segment, hop, n_times, n_bins; /* n_bins: 0 … Nyquist */
    const struct fft *plan;
    double *window; /* [segment] Hann */
};

enum bf_status linearity_plane_new(size_t n, struct linearity_plane *out, struct bf_error *err); /* free(window) */
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
