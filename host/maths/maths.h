/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * maths.h — mathematics on plain arrays. Section by section:
 *
 *     DENSE, SPARSE    linear algebra: eigenpairs, solves, orthonormal bases
 *     SPLINE           cubic B-splines with edges where the second derivative may jump
 *     SPECTRUM         Fourier transforms, amplitude and cross spectra, coherence
 *     LOCAL RATIONAL   what no linear system can have done, band by band
 *     RESIDUAL         size, colour, whiteness of what a model leaves unexplained, and where it is
 *     OPTIMISE         least squares within bounds
 *     VECTOR           inner loops for processors with vectors
 */
#ifndef BEAMFIT_MATHS_H
#define BEAMFIT_MATHS_H

#include <complex.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "ground/ground.h"

/*
 * DENSE — dense linear algebra. Only dense.c sees LAPACKE and CBLAS.
 *
 * Every matrix is column-major and packed: A[m][n] (m rows, n columns) has element (i, j) at A[i + j·m].
 * A NULL output is not computed. Functions return BF_NUMERIC when a factorisation fails or an input is not finite
 * where LAPACK would not end or would answer wrongly; inputs are never changed unless marked in/out. Not for sizes above INT_MAX.
 */

/*
 * K v = λ M v, K symmetric, M symmetric positive definite (NULL: identity); lower triangles are read. values[n]
 * ascend; vectors[n × n] stand in columns with vᵀ M v = 1. O(n³).
 */
enum bf_status dense_symmetric_eigen(size_t n, const double K[], const double M[], double values[], double vectors[],
                                     struct bf_error *err);

/*
 * A v = λ v, uᴴ A = λ uᴴ for a square real A. values[n], left[n × n], right[n × n] in columns, each column of unit
 * 2-norm; conjugate pairs are adjacent, positive imaginary part first. O(n³).
 */
enum bf_status dense_general_eigen(size_t n, const double A[], double complex values[], double complex left[],
                                   double complex right[], struct bf_error *err);

/* A X = B by Cholesky, A symmetric positive definite (lower triangle read); B[n × n_rhs] in/out. */
enum bf_status dense_cholesky_solve(size_t n, size_t n_rhs, const double A[], double B[], struct bf_error *err);

/* A X = B by LU with pivoting, A any square matrix that is not singular; B[n × n_rhs] in/out. */
enum bf_status dense_lu_solve(size_t n, size_t n_rhs, const double A[], double B[], struct bf_error *err);

/* C[m × n] = α op(A) op(B) + β C, op(X) = X or Xᵀ; k is the inner dimension. β = 0 ignores what C holds. */
void dense_gemm(bool transpose_A, bool transpose_B, size_t m, size_t n, size_t k, double alpha, const double A[],
                const double B[], double beta, double C[]);

/* y = α op(A) x + β y for A[m × n]; x and y have the lengths that op(A) asks for. */
void dense_gemv(bool transpose, size_t m, size_t n, double alpha, const double A[], const double x[], double beta,
                double y[]);

/* a[n] −= Q Qᴴ a for orthonormal columns Q[n × rank]. */
void dense_project_out(size_t n, size_t rank, const double complex Q[], double complex a[]);

/* G[n × n] = Aᵀ A for A[m × n], both triangles filled. */
void dense_gram(size_t m, size_t n, const double A[], double G[]);

double dense_dot(size_t n, const double x[], const double y[]);
double dense_norm(size_t n, const double x[]); /* 2-norm, safe against overflow */

/*
 * A[m × n] = U diag(s) Vᵀ with s descending. s[min(m, n)], V[n × n] (columns; all n of them, so that those beyond
 * min(m, n) span the null space), U[m × min(m, n)]; U and V may be NULL. O(m n²).
 */
enum bf_status dense_svd(size_t m, size_t n, const double A[], double U[], double s[], double V[],
                         struct bf_error *err);

/* Upper triangle R[n × n] of A = Q R, m ≥ n, zeros below the diagonal. The Gram matrix without squaring: RᵀR = AᵀA. */
enum bf_status dense_qr_triangle(size_t m, size_t n, const double A[], double R[], struct bf_error *err);

/*
 * Orthonormal basis Q[m × n] of the columns of A[m × n], m ≥ n, by QR with column pivoting; columns that depend on
 * earlier ones to within `tolerance` (relative to the largest) are left out. *rank columns of Q are filled.
 */
enum bf_status dense_orthonormal(size_t m, size_t n, const double A[], double tolerance, double Q[], size_t *rank,
                                 struct bf_error *err);

/*
 * Q[m × n] orthonormal and R[n × n], upper triangle, of A = QR, m ≥ n, by way of the Gram matrix of the columns, twice. False, and nothing to be read, where the columns are
 * far from independent (a condition above 1e6 when each has norm 1), dense_orthonormal() would leave one out, or a number is not finite. A fifth of its time.
 */
bool dense_cholesky_qr(size_t m, size_t n, const double A[], double tolerance, double Q[], double R[]);
/* x ← R⁻¹ x for an upper triangle R[n × n] without zeros on its diagonal. */
void dense_back_substitute(size_t n, const double R[], double x[]);

/*
 * Minimum-norm x[n] of min ‖A x − b‖₂ for A[m × n], b[m]; singular values below `tolerance` times the largest count as
 * zero. *rank may be NULL.
 */
enum bf_status dense_least_squares(size_t m, size_t n, const double A[], const double b[], double tolerance, double x[],
                                   size_t *rank, struct bf_error *err);

/*
 * Steady-state Kalman filter of x⁺ = A x + w, y = cᵀx + v with covariances Q[n × n] ≥ 0 and r > 0: P = A P Aᵀ − K s Kᵀ + Q is the prediction's
 * covariance, s = cᵀP c + r the innovation's variance, K = A P c/s the gain of x̂⁺ = A x̂ + K (y − cᵀx̂). A stable filter exists when what is not
 * stable is seen and every motion is shaken. covariance[n × n], gain[n]: the caller's. NUMERIC. O(n³) a step, a few dozen steps.
 */
struct kalman {
    double *covariance, *gain;
    double innovation_variance;
    int steps; /* doublings */
};
enum bf_status kalman_steady(size_t n, const double A[], const double c[], const double Q[], double r,
                             struct kalman *out, struct bf_error *err);

/* SPARSE — sparse factorisation, solves and lowest modes. Only sparse.c sees CHOLMOD and ARPACK. */

struct sparse_factor;

/*
 * Cholesky factor of the symmetric banded matrix A(i, i+d) = band[i·width + d], i = 0 … n−1, d = 0 … width−1.
 * BF_NUMERIC when A is not positive definite or not finite.
 */
enum bf_status sparse_factorise(size_t n, size_t width, const double band[], struct sparse_factor **out,
                                struct bf_error *err);

/* x[n] = A⁻¹ b[n]; x may be b. */
enum bf_status sparse_solve(struct sparse_factor *factor, const double b[], double x[], struct bf_error *err);
void sparse_free(struct sparse_factor *factor);

/*
 * The n_modes lowest eigenpairs of K v = λ M v by shift-invert Lanczos (ARPACK) about `shift` < λ_1: factor holds
 * K − shift·M. values[n_modes] ascend, vectors[n_modes][n] with vᵀMv = 1, largest entry positive. n_modes ≤ n − 2.
 * multiply(context, x, y): y = M x.
 */
enum bf_status sparse_modes(struct sparse_factor *factor, size_t n, size_t n_modes, double shift,
                            void (*multiply)(const void *context, const double x[], double y[]), const void *context,
                            double values[], double vectors[], struct bf_error *err);

/*
 * SPLINE — cubic B-splines on [0, ℓ] whose second derivative may jump at given edges (double knots there).
 * Basis functions are numbered 0 … n−1; at any x at most four of them are not zero.
 */

enum { SPLINE_ORDER = 4 };

struct spline {
    size_t n;       /* basis functions, before any boundary condition */
    size_t n_knots; /* n + 4 */
    double *knots;  /* non-decreasing; 4-fold at both ends, 2-fold at the edges */
};

/* Values and derivatives of the four functions first … first+3 at x: d[k][j] = k-th derivative of function first+j. */
struct spline_values {
    size_t first;
    double d[4][SPLINE_ORDER];
};

/*
 * edges[n_edges]: strictly increasing, inside (0, length_m). About n functions: elements of nearly equal length, at
 * least two between neighbouring edges.
 */
enum bf_status spline_new(double length_m, const double edges[], size_t n_edges, size_t n, struct spline *out,
                          struct bf_error *err);
void spline_free(struct spline *spline);

/* x in [0, ℓ]; at an edge the limit from the right (from the left at ℓ). Cost: about 40 flops. */
void spline_evaluate(const struct spline *spline, double x, struct spline_values *out);

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

/*
 * OPTIMISE — minimisation of a sum of squares ½‖r(x)‖² within bounds. Only optimise.c sees NLopt.
 *
 * The local search is a Gauss–Newton trust-region method (optimise_local.c), because NLopt's gradient methods see only the value and the
 * gradient and need several times as many evaluations as a method that sees JᵀJ, which costs little once the Jacobian is
 * there. NLopt searches a box (controlled random search, DIRECT, multi-level single linkage) and checks the result at the
 * end by a gradient method of its own.
 */

/* A least-squares problem in n unknowns. Unknowns should be scaled so that steps of 1 are large (logarithms are). */
struct least_squares {
    size_t n;
    const double *lower, *upper; /* [n], ±INFINITY where there is none; NULL: no bounds at all */
    void *context;
    /* ½‖r(x)‖² (r includes the rows of priors). BF_NUMERIC: there is no value at x, the step is shortened. */
    enum bf_status (*value)(void *context, const double x[], double *half_square, struct bf_error *err);
    /*
     * Value, gradient[n] = Jᵀr and gram[n × n] = JᵀJ. The problem may refine itself before (a rebased model), so this
     * value may differ slightly from that of value(); later values must be consistent with this one. A step that it shows to
     * have gone uphill is taken back.
     */
    enum bf_status (*derivative)(void *context, const double x[], double *half_square, double gradient[], double gram[],
                                 struct bf_error *err);
    bool (*interrupted)(void *context); /* may be NULL; asked before every evaluation */
};

struct optimise_options {
    int iterations;    /* accepted or rejected steps at most; 0: 50 */
    double radius;     /* first trust radius, 2-norm of a step; 0: 0.5 */
    double radius_max; /* 0: 4 */
    double tolerance;  /* stop when a full step would lower ½‖r‖² by less than this; 0: 1e-6 */
    double relative;   /* … or by less than this share of ½‖r‖² */
    double form;       /* … or by less than this share of what ½‖r‖² has above `noise` */
    double noise;      /* ½‖r‖² of noise alone; only with `form` */
    double
        give_up_above; /* stop when ten times the predicted fall of ½‖r‖² would not bring it down to this; 0: never */
    double enough; /* stop without another derivative when ½‖r‖² is at most this: no `decrement` then; 0: never */
    double rank;   /* directions with eigenvalue of JᵀJ below rank × the largest are not moved; 0: 1e-13 */
};

enum optimise_end { OPTIMISE_CONVERGED, OPTIMISE_ITERATIONS, OPTIMISE_STALLED, OPTIMISE_INTERRUPTED, OPTIMISE_GAVE_UP };

struct optimise_result {
    enum optimise_end end;
    double half_square;
    double decrement; /* predicted fall of ½‖r‖² of one more full step: half the squared distance in standard errors */
    int values, derivatives;
};

/*
 * Trust-region Gauss–Newton with an active set for the bounds. x[n] in/out: the best point found, also after an
 * interruption. Along null directions of J the step has minimum norm, so they stay where they were. Fails only when
 * there is no value at the start.
 */
enum bf_status optimise_local(const struct least_squares *problem, const struct optimise_options *options, double x[],
                              struct optimise_result *out, struct bf_error *err);

/*
 * The predicted fall of ½‖r‖² of the full Gauss–Newton step from x, given gradient[n] and gram[n × n], and the step
 * itself (NULL: not wanted). Unknowns at a bound that the gradient presses against are held; 0 at a stationary point.
 */
enum bf_status optimise_decrement(const struct least_squares *problem, const double x[], const double gradient[],
                                  const double gram[], double rank, double *decrement, double step[],
                                  struct bf_error *err);

/*
 * Independent check by NLopt's gradient method (SLSQP) in whitened unknowns, from x: does a method that shares nothing
 * with optimise_local() find a lower value? x is replaced when it does; *gain is the fall of ½‖r‖².
 */
enum bf_status optimise_polish(const struct least_squares *problem, int evaluations, double x[], double *gain,
                               struct bf_error *err);

enum optimise_search { OPTIMISE_CRS, OPTIMISE_DIRECT, OPTIMISE_MLSL };

/*
 * Search of a box by NLopt with at most `evaluations` values (MLSL: of values and derivatives). Bounds of the problem
 * must be finite. x[n] in/out. Deterministic: the seed is fixed.
 */
enum bf_status optimise_global(const struct least_squares *problem, enum optimise_search search, int evaluations,
                               double x[], double *half_square, struct bf_error *err);

/*
 * VECTOR — inner loops compiled three times, for processors with vectors of 512 bits, of 256 bits and others, chosen when the
 * program starts. Off under the address sanitizer, which must be running before any choice of that kind.
 */

#if defined __x86_64__ && defined __gnu_linux__ && !defined __SANITIZE_ADDRESS__ && !defined __clang__
#define VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define VECTOR_CLONES
#endif
#define VECTOR_INLINE static inline __attribute__((always_inline))

/*
 * Four numbers at once, in functions with VECTOR_CLONES and what is inlined into them; without 256-bit vectors the
 * compiler makes two or four instructions of each. Arrays need no alignment, but a length that is a multiple.
 */
enum { VECTOR_LENGTH = 4 };
typedef double vector_real __attribute__((vector_size(32)));

VECTOR_INLINE size_t vector_round(size_t n)
{
    return (n + VECTOR_LENGTH - 1) / VECTOR_LENGTH * VECTOR_LENGTH;
}

VECTOR_INLINE void vector_load(vector_real *out, const double x[VECTOR_LENGTH])
{
    memcpy(out, x, sizeof *out);
}

VECTOR_INLINE void vector_store(double x[VECTOR_LENGTH], const vector_real *in)
{
    memcpy(x, in, sizeof *in);
}

VECTOR_INLINE double vector_sum(const vector_real *x)
{
    return ((*x)[0] + (*x)[2]) + ((*x)[1] + (*x)[3]);
}

/* Σ a_i b_i; n is a multiple of the length. */
VECTOR_INLINE double vector_dot(size_t n, const double a[], const double b[])
{
    vector_real sum = {0.0};
    for (size_t i = 0; i < n; i += VECTOR_LENGTH) {
        vector_real x, y;
        vector_load(&x, a + i);
        vector_load(&y, b + i);
        sum += x * y;
    }
    return vector_sum(&sum);
}

/*
 * ALIGNMENT — which measured value belongs to which of a model's, when all may be off by one factor (up to 4.5 either way): two ascending lists of
 * positive numbers, in order, values left out on either side. pair[n]: index into model, SIZE_MAX: none is within 10 % once the factor is off.
 * O(n · n_model).
 */
void alignment_find(const double measured[], size_t n, const double model[], size_t n_model, size_t pair[]);
/* Geometric mean of measured/model over the pairs; 1 where there is none. */
double alignment_factor(const double measured[], size_t n, const double model[], const size_t pair[]);

#endif
