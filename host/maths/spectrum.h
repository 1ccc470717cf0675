/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * spectrum.h — Fourier transforms and the spectral estimates that every stage shares. Only spectrum.c sees FFTW.
 *
 * Convention: X[k] = Σ_m x[m] e^(−2πi k m/n), k = 0 … n/2; the inverse is normalised, so inverse(forward(x)) = x.
 * All functions are safe to call from several threads; transforms of one plan may run at the same time.
 */
#ifndef BEAMFIT_SPECTRUM_H
#define BEAMFIT_SPECTRUM_H

#include <complex.h>
#include <stdbool.h>
#include "ground/error.h"

/* ---- Transforms ---- */

/* Plans are made once per length, kept until the program ends, and shared: fft_get() is cheap after the first call. */
struct fft;

/* The smallest even number ≥ at_least whose prime factors are 2, 3 and 5 (2 for at_least ≤ 2). */
size_t fft_good_size(size_t at_least);
/* n ≥ 1, any; good sizes are fast. The plan belongs to the cache: do not free it. BF_NUMERIC when FFTW has no plan. */
enum bf_status fft_get(size_t n, const struct fft **out, struct bf_error *err);
size_t fft_size(const struct fft *plan);
/* x: [n], X: [n/2 + 1]. x and X must not overlap; the input is kept. */
void fft_forward(const struct fft *plan, const double *x, double complex *X);
void fft_inverse(const struct fft *plan, const double complex *X, double *x);

/* ---- Spectra of records (dt_s is the sample interval; bin k lies at k·df_Hz) ---- */

enum window { WINDOW_NONE, WINDOW_HANN, WINDOW_BLACKMAN_HARRIS };

/* w: [n], periodic form, largest value 1. */
void window_fill(enum window kind, size_t n, double *w);

/*
 * Single-sided amplitude spectrum in the unit of x: a sinusoid of amplitude A on a bin shows A. amplitude: [n/2 + 1].
 * The window's coherent gain is divided out. n ≥ 2.
 */
enum bf_status spectrum_amplitude(const double *x, size_t n, enum window kind, double *amplitude, struct bf_error *err);

/* Averages over half-overlapping Hann segments (Welch 1967), means removed. Free with cross_spectrum_free(). */
struct cross_spectrum {
    size_t n_bins; /* segment/2 + 1 */
    double df_Hz;
    size_t n_segments;
    double steadiness; /* of x: (Σ P)²/(K Σ P²) over the K segments, averaged with P over bins: 1/K a single pulse or a
                          sweep, 1/2 random noise, 1 a steady tone. Coherence means something well above 1/K only. */
    double averages;     /* equivalent number of independent segments, ≥ 1 (overlap accounted for) */
    double *pxx, *pyy;   /* one-sided power spectral densities, unit²/Hz */
    double complex *pxy; /* one-sided cross-spectral density, conj(X)·Y */
};

/*
 * y may be NULL: then only pxx is filled (pyy and pxy stay NULL). 4 ≤ segment ≤ n. A segment of 0 chooses one: about
 * eight averages.
 */
enum bf_status spectrum_cross(const double *x, const double *y, size_t n, double dt_s, size_t segment,
                              struct cross_spectrum *out, struct bf_error *err);
void cross_spectrum_free(struct cross_spectrum *spectrum);
/* Magnitude-squared coherence |pxy|²/(pxx pyy) of bin k, in [0, 1]; 0 where there is no power. */
double coherence(const struct cross_spectrum *spectrum, size_t bin);
/* Coherence that unrelated signals exceed with probability alpha in one bin: 1 − alpha^(1/(averages − 1)); 1 for ≤ 1 average. */
double coherence_bound(const struct cross_spectrum *spectrum, double alpha);

/* ---- Time domain, by transforms ---- */

/*
 * Band-limited interpolation to factor·n samples: out[factor·k] = x[k]. The ends are continued by point reflection so
 * that a record cut in the middle of a motion does not ring. out: [factor·n]; the samples after the last x extrapolate.
 */
enum bf_status resample_band_limited(const double *x, size_t n, size_t factor, double *out, struct bf_error *err);

/*
 * Correlation sums c[lag] = Σ_t x[t] y[t + lag], lag = 0 … n_lags − 1, without wrap-around. n_lags ≤ n.
 */
enum bf_status correlate(const double *x, const double *y, size_t n, size_t n_lags, double *c, struct bf_error *err);

#endif
