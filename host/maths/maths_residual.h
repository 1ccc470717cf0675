/* SPDX-License-Identifier: GPL-3.0-or-later */
/* maths_residual.h — what a model leaves unexplained, and what can be said of it; part of maths.h */
#ifndef BEAMFIT_MATHS_RESIDUAL_H
#define BEAMFIT_MATHS_RESIDUAL_H

#include <stdbool.h>
#include <stddef.h>

#include "ground/ground.h"

/*
 * RESIDUAL — what a model leaves unexplained: r = z − ŷ of one channel of one record, and what can be said of it.
 * All functions take plain arrays; r: [n], uniform sampling. They allocate nothing that they do not free.
 */

/* ---- Size ---- */

/* √(mean x²); 0 for n = 0. */
double root_mean_square(const double *x, size_t n);

void sort_ascending(size_t n, double x[]);
/* NaN for n = 0; x is sorted. O(n log n). */
double median(size_t n, double x[]);
/* Standard deviation of a normal variable with the median distance that x[n] has from its median, *middle. NaN for n = 0. O(n log n). */
double robust_deviation(size_t n, const double x[], double *middle);

/* ‖z − ŷ‖/‖z‖; INFINITY when z is zero and ŷ is not, 0 when both are. */
double residual_nrmse(const double *z, const double *y, size_t n);

/* ---- Colour: an autoregressive model r_t = Σ_{i=1..order} a[i−1] r_{t−i} + e_t, e ~ N(0, sigma²) ---- */

enum { AR_MAX = 40 };

struct ar_model {
    int order; /* 0 … AR_MAX; 0: white */
    double a[AR_MAX];
    double sigma; /* standard deviation of the innovation, ≥ 0 */
};

/*
 * Burg's method (always stable), order by the Bayesian criterion among 0 … min(AR_MAX, n/10). The mean is not removed.
 * O(n AR_MAX). n = 0 or r = 0 gives order 0, sigma 0.
 */
void ar_fit(const double *r, size_t n, struct ar_model *out);

/* One-sided power spectral density at f_Hz (0 … 1/(2 dt)), unit²/Hz. */
double ar_psd(const struct ar_model *model, double dt_s, double f_Hz);

/*
 * Whitening: w = C^(−1/2) x with C the covariance of the (stationary) model, exact from the first sample on: noise of
 * the model becomes independent samples of variance 1. Linear in x, so it serves residuals and Jacobian columns alike.
 * x: [n], w: [n], may be the same array. sigma 0 copies x. O(n order).
 */
void ar_whiten(const struct ar_model *model, const double *x, size_t n, double *w);

/* ---- Tests ---- */

/* Upper tail P(χ²_dof > x). */
double chi_square_tail(double x, double dof);

/* Upper tail P(F > x) of Fisher's F with `above` and `below` degrees of freedom. */
double f_tail(double x, double above, double below);

/*
 * Is r white? Two tests that fail differently: Ljung–Box sees short memory, Bartlett's cumulative periodogram
 * (Kolmogorov–Smirnov) sees any concentration in frequency. p-values are uniform for white noise.
 */
struct whiteness {
    size_t lags;      /* of Ljung–Box: min(25, n/5) */
    double ljung_box; /* Q = n(n+2) Σ ρ_k²/(n−k) ~ χ²_lags */
    double ljung_box_p;
    double periodogram_ks; /* largest distance of the cumulative periodogram from the diagonal */
    double periodogram_p;
    double p_value;           /* of both together (Bonferroni) */
    double correlation_bound; /* one autocorrelation exceeds it with probability 5 % */
};

/* n ≥ 20; shorter or all-zero residuals give p = 1. */
enum bf_status residual_whiteness(const double *r, size_t n, struct whiteness *out, struct bf_error *err);

/* ρ[k] = Σ r_t r_{t+k} / Σ r_t², k = 0 … n_lags − 1 ≤ n − 1. */
enum bf_status residual_autocorrelation(const double *r, size_t n, size_t n_lags, double *rho, struct bf_error *err);

/*
 * Correlation of the residual with an input u: ρ(τ) = Σ u_t r_{t+τ}/(‖u‖ ‖r‖) of residual and input filtered by the
 * residual's own AR model, so that the bounds hold for coloured residuals too. Positive lags: the response to the input
 * is not explained. Negative lags: the input follows the output (a wrong clock, a closed loop).
 */
struct input_correlation {
    size_t n_lags;    /* lags run from −n_lags … n_lags */
    double *rho;      /* [2 n_lags + 1] */
    double bound_lag; /* one lag exceeds it with probability 1 % */
    double bound_all; /* any lag exceeds it with probability 1 % */
    double largest;   /* largest |ρ| */
    long largest_lag; /* in samples */
    /*
     * Lags (samples) over which the filtered input resembles itself: a response to what went before shows at a lag of as much less, so
     * that only a lag below −alike says that the residual runs ahead.
     */
    long alike;
    double p_value; /* of the largest, all lags considered */
};

/* n_lags < n/2. A zero input or residual gives ρ = 0 and p = 1. Free with input_correlation_free(). */
enum bf_status residual_input_correlation(const double *u, const double *r, size_t n, size_t n_lags,
                                          struct input_correlation *out, struct bf_error *err);
/* Of several segments, by their samples n[n_parts]: ρ is the mean, bounds and p-value those of all samples. All have the same lags. */
void residual_input_correlations_join(const struct input_correlation parts[], const size_t n[], size_t n_parts,
                                      struct input_correlation *out);
void input_correlation_free(struct input_correlation *correlation);

/* ---- Where the misfit is ---- */

/*
 * Share of Σ r² in each of n_edges − 1 bands [edge_i, edge_{i+1}) (Hz, ascending; what lies outside is counted in the first
 * or last band, so shares add up to 1). The mean counts as 0 Hz. share: [n_edges − 1].
 */
enum bf_status residual_band_shares(const double *r, size_t n, double dt_s, const double *edge_Hz, size_t n_edges,
                                    double *share, struct bf_error *err);

/*
 * Band edges from 0 to the Nyquist frequency: halfway (geometrically) between consecutive frequencies, ascending, but for those of
 * rigid motions; or whole octaves down from the Nyquist frequency when there are none. edge_Hz: [n_frequencies + 2, at least 12]; returns
 * the number of edges.
 */
size_t residual_band_edges(const double *frequency_Hz, size_t n_frequencies, double dt_s, double *edge_Hz);

/* What is left of one channel. */
struct residual_channel {
    const double *r; /* [n] */
    size_t n;
    double dt_s, scale; /* of its noise, or what else makes channels comparable */
};

/*
 * lines_Hz[most]: where lines stand out of what is left of all channels between low and high, *n of them, by turns the most prominent and the largest: a line
 * next to a mode that it excites is hidden in what surrounds it, and a weak one by the ringing of modes. Two are 2/T apart at least, T the longest. O(n log n).
 */
enum bf_status residual_lines(const struct residual_channel channels[], size_t n_channels, double low_Hz,
                              double high_Hz, size_t most, double lines_Hz[], size_t *n, struct bf_error *err);

/* Share of Σ r² in the first, middle and last third of the record. */
void residual_time_shares(const double *r, size_t n, double share[3]);

/*
 * By size of the motion: samples are ranked by the running rms of z (window_n samples) and cut into three equal groups.
 * relative: rms r/rms z of each group, small motion first; share: of Σ r².
 */
struct amplitude_shares {
    double share[3], relative[3];
};
enum bf_status residual_amplitude_shares(const double *z, const double *r, size_t n, size_t window_n,
                                         struct amplitude_shares *out, struct bf_error *err);

/* ---- The same of a residual that is never in memory as a whole: in segments of one length, residual_sums.c ---- */

enum {
    RESIDUAL_AMPLITUDES = 4096,                  /* levels of the motion's power, sixteen to an octave */
    RESIDUAL_OCTAVES = RESIDUAL_AMPLITUDES / 16, /* about 1 */
};

struct residual_sums {
    size_t segment, n_segments, n_lags;
    size_t n;        /* of all segments */
    double *power;   /* [segment/2 + 1] Σ |R|² of the segments */
    double *product; /* [n_lags] Σ r_t r_{t+k} of pairs that are in one segment */
    struct residual_amplitude {
        double n, motion, misfit; /* samples, Σ z², Σ r² */
    } * amplitude;                /* [RESIDUAL_AMPLITUDES] by the running power of z */
};

/* segment ≥ 64 samples, lags ≤ segment/2. Free with residual_sums_free(). */
void residual_sums_new(size_t segment, size_t n_lags, struct residual_sums *out);
/* One segment more: z, r [segment]; window as residual_amplitude_shares(). Cost: three transforms. */
enum bf_status residual_sums_add(struct residual_sums *sums, const double *z, const double *r, size_t window_n,
                                 struct bf_error *err);
/* As the functions of a whole residual, but for pairs of samples across the ends of segments; n_lags ≤ that of the sums, 26 for the first. */
void residual_sums_whiteness(const struct residual_sums *sums, struct whiteness *out);
void residual_sums_autocorrelation(const struct residual_sums *sums, size_t n_lags, double *rho);
void residual_sums_bands(const struct residual_sums *sums, double dt_s, const double *edge_Hz, size_t n_edges,
                         double *share);
void residual_sums_amplitudes(const struct residual_sums *sums, struct amplitude_shares *out);
void residual_sums_free(struct residual_sums *sums);

#endif
