/* SPDX-License-Identifier: GPL-3.0-or-later */
/* maths_spectrum.h — Fourier transforms, spectra, what no linear system can have done; part of maths.h */
#ifndef BEAMFIT_MATHS_SPECTRUM_H
#define BEAMFIT_MATHS_SPECTRUM_H

#include <complex.h>
#include <stdbool.h>
#include <stddef.h>

#include "ground/ground.h"

/*
 * SPECTRUM — Fourier transforms and the spectral estimates that every stage shares. Only spectrum.c sees FFTW.
 *
 * Convention: X[k] = Σ_m x[m] e^(−2πi k m/n), k = 0 … n/2; the inverse is normalised, so inverse(forward(x)) = x.
 * All functions are safe to call from several threads; transforms of one plan may run at the same time.
 */

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

/* ---- Other times (resample.c): a sinc of 32 steps under Kaiser's window; a signal below 0.44 of the lower rate to 1e-4 ---- */

/*
 * x[n] at times t[n] of y[m] at t0 + k dt, 0 outside; band below 1: only frequencies below that share of y's Nyquist frequency are
 * kept. Cost: 32/band operations a sample.
 */
void resample_uniform(const double y[], size_t m, double t0, double dt, const double t[], size_t n, double band,
                      double x[]);

/*
 * x[n] at t0 + k dt of samples y[m] at any times t[m]: the band-limited signal that is nearest to them (least squares, conjugate
 * gradients). m must be above n, and no gap longer than a few dt. Returns the rms of what it leaves at the samples: what lies above the
 * band, and noise.
 */
double resample_jittered(const double t[], const double y[], size_t m, double t0, double dt, size_t n, double x[]);

/* ---- Spectra of records (dt_s is the sample interval; bin k lies at k·df_Hz) ---- */

enum window { WINDOW_NONE, WINDOW_HANN, WINDOW_BLACKMAN_HARRIS };

/* w: [n], periodic form, largest value 1. */
void window_fill(enum window kind, size_t n, double *w);

/*
 * Single-sided amplitude spectrum in the unit of x: a sinusoid of amplitude A on a bin shows A. amplitude: [n/2 + 1].
 * The window's coherent gain is divided out. n ≥ 2.
 */
enum bf_status spectrum_amplitude(const double *x, size_t n, enum window kind, double *amplitude, struct bf_error *err);

/* power[n/2 + 1]: |X|² of x[n], no window. */
enum bf_status spectrum_power(const double *x, size_t n, double *power, struct bf_error *err);

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
/* The mean of `sum` and of a spectrum with the same bins, by their segments; an empty sum ({0}) becomes a copy. */
void cross_spectrum_join(struct cross_spectrum *sum, const struct cross_spectrum *more);
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
 * LOCAL RATIONAL — what a linear system cannot have done, in narrow bands of one record's spectrum.
 *
 * In a band of a few dozen bins the spectrum of a channel of any linear system, in any initial and final state, is
 *     Y(x) = Σ_i U_i(x) [P_i(x) + Σ_j b_ij/(x − p_j)] + P_0(x) + Σ_j a_j/(x − p_j)
 * with quadratic polynomials P and at most two poles p_j: the local rational method (McKelvey & Guérin 2012), with
 * its poles found by variable projection (Kaufman 1975) instead of the linearised equation error, whose noise estimate
 * is biased by noise in its regressors, and only where an F test asks for them.
 * The residual of that fit is noise and whatever is not linear.
 */

struct local_rational; /* the fitted bands, as projections that can be applied to other data */

/* z: [n], u: n_inputs arrays of [n], n ≥ 64. Free with local_rational_free(). O(n). */
enum bf_status local_rational_new(const double *z, size_t n, const double *const u[], size_t n_inputs,
                                  struct local_rational **out, struct bf_error *err);

/* Residual of x (the record itself, or noise sent the same way) in time, without the mean. x, r: [n], may be the same. */
enum bf_status local_rational_residual(const struct local_rational *fit, const double *x, double *r,
                                       struct bf_error *err);
void local_rational_free(struct local_rational *fit);

#endif
