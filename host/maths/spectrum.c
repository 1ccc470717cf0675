/* SPDX-License-Identifier: GPL-3.0-or-later */
/* spectrum.c — the only file that sees FFTW. */
#include "maths.h"
#include "spectrum.h"

#include <fftw3.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* ---- Transforms ---- */

/* FFTW wants the same alignment in every execution; each direction has a plan for aligned and one for any memory. */
struct fft {
    size_t n;
    fftw_plan forward[2], inverse[2]; /* [0] any alignment, [1] SIMD-aligned */
    struct fft *next;
};

/* The planner is not reentrant (FFTW manual, 5.4): every call of it holds this lock. Executing needs none. */
static pthread_mutex_t planner_lock = PTHREAD_MUTEX_INITIALIZER;
static struct fft *plans;

static bool is_good(size_t n)
{
    static const size_t factors[3] = {2, 3, 5};
    for (int i = 0; i < 3; i++)
        while (n % factors[i] == 0)
            n /= factors[i];
    return n == 1;
}

size_t fft_good_size(size_t at_least)
{
    size_t n = at_least < 2 ? 2 : at_least + at_least % 2;
    while (!is_good(n))
        n += 2;
    return n;
}

/* FFTW_ESTIMATE: the same plan, hence the same rounding, on every run of the same machine. */
static struct fft *make_plan(size_t n)
{
    struct fft *plan = bf_alloc(1, sizeof *plan);
    double *x = fftw_alloc_real(n);
    fftw_complex *X = fftw_alloc_complex(n / 2 + 1);
    const unsigned flags = FFTW_ESTIMATE | FFTW_PRESERVE_INPUT;
    plan->n = n;
    if (x != NULL && X != NULL) {
        for (unsigned aligned = 0; aligned < 2; aligned++) {
            unsigned f = aligned ? flags : flags | FFTW_UNALIGNED;
            plan->forward[aligned] = fftw_plan_dft_r2c_1d((int)n, x, X, f);
            plan->inverse[aligned] = fftw_plan_dft_c2r_1d((int)n, X, x, f);
        }
    }
    fftw_free(x);
    fftw_free(X);
    if (plan->forward[0] && plan->forward[1] && plan->inverse[0] && plan->inverse[1])
        return plan;
    for (int i = 0; i < 2; i++) {
        if (plan->forward[i])
            fftw_destroy_plan(plan->forward[i]);
        if (plan->inverse[i])
            fftw_destroy_plan(plan->inverse[i]);
    }
    free(plan);
    return NULL;
}

enum bf_status fft_get(size_t n, const struct fft **out, struct bf_error *err)
{
    *out = NULL;
    if (n < 1 || n > (size_t)1 << 30)
        return bf_fail(err, BF_NUMERIC, "a Fourier transform of %zu samples is not possible; use 1 to 2^30 samples", n);
    pthread_mutex_lock(&planner_lock);
    struct fft *plan = plans;
    while (plan != NULL && plan->n != n)
        plan = plan->next;
    if (plan == NULL && (plan = make_plan(n)) != NULL) {
        plan->next = plans;
        plans = plan;
    }
    pthread_mutex_unlock(&planner_lock);
    if (plan == NULL)
        return bf_fail(err, BF_NUMERIC, "no memory for a Fourier transform of %zu samples; use a shorter record", n);
    *out = plan;
    return BF_OK;
}

size_t fft_size(const struct fft *plan)
{
    return plan->n;
}

static int both_aligned(const double *x, const double complex *X)
{
    return fftw_alignment_of((double *)x) == 0 && fftw_alignment_of((double *)X) == 0;
}

void fft_forward(const struct fft *plan, const double *x, double complex *X)
{
    fftw_execute_dft_r2c(plan->forward[both_aligned(x, X)], (double *)x, X);
}

void fft_inverse(const struct fft *plan, const double complex *X, double *x)
{
    const double scale = 1.0 / (double)plan->n;
    fftw_execute_dft_c2r(plan->inverse[both_aligned(x, X)], (double complex *)X, x);
    for (size_t i = 0; i < plan->n; i++)
        x[i] *= scale;
}

/* ---- Spectra ---- */

void window_fill(enum window kind, size_t n, double *w)
{
    static const double harris[4] = {0.35875, 0.48829, 0.14128, 0.01168}; /* Harris 1978, −92 dB */
    for (size_t i = 0; i < n; i++) {
        const double a = 2.0 * M_PI * (double)i / (double)n;
        if (kind == WINDOW_NONE)
            w[i] = 1.0;
        else if (kind == WINDOW_HANN)
            w[i] = 0.5 - 0.5 * cos(a);
        else
            w[i] = harris[0] - harris[1] * cos(a) + harris[2] * cos(2.0 * a) - harris[3] * cos(3.0 * a);
    }
}

/* Times 2 for the negative frequencies, except at zero and at an even length's Nyquist bin, which have none. */
static double single_sided(size_t bin, size_t n)
{
    return bin == 0 || 2 * bin == n ? 1.0 : 2.0;
}

enum bf_status spectrum_power(const double *x, size_t n, double *power, struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(n, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    fft_forward(plan, x, X);
    for (size_t k = 0; k <= n / 2; k++)
        power[k] = creal(X[k]) * creal(X[k]) + cimag(X[k]) * cimag(X[k]);
    free(X);
    return BF_OK;
}

enum bf_status spectrum_amplitude(const double *x, size_t n, enum window kind, double *amplitude, struct bf_error *err)
{
    const struct fft *plan;
    enum bf_status status = fft_get(n, &plan, err);
    if (status != BF_OK)
        return status;
    double *w = bf_alloc(n, sizeof *w), gain = 0.0;
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    window_fill(kind, n, w);
    for (size_t i = 0; i < n; i++) {
        gain += w[i];
        w[i] *= x[i];
    }
    fft_forward(plan, w, X);
    for (size_t k = 0; k <= n / 2; k++)
        amplitude[k] = single_sided(k, n) * cabs(X[k]) / gain;
    free(w);
    free(X);
    return BF_OK;
}

/* Mean removed, windowed, transformed. work: [m]. */
static void transform_segment(const struct fft *plan, const double *x, const double *w, double *work, double complex *X)
{
    const size_t m = fft_size(plan);
    double mean = 0.0;
    for (size_t i = 0; i < m; i++)
        mean += x[i];
    mean /= (double)m;
    for (size_t i = 0; i < m; i++)
        work[i] = w[i] * (x[i] - mean);
    fft_forward(plan, work, X);
}

/* Overlapping segments are correlated: K/(1 + 2ρ²(K−1)/K), ρ the window's autocorrelation at the hop (Welch 1967). */
static double independent_averages(const double *w, size_t m, size_t hop, size_t n_segments)
{
    double self = 0.0, overlap = 0.0;
    for (size_t i = 0; i < m; i++)
        self += w[i] * w[i];
    for (size_t i = 0; i + hop < m; i++)
        overlap += w[i] * w[i + hop];
    const double rho2 = overlap * overlap / (self * self), k = (double)n_segments;
    return k / (1.0 + 2.0 * rho2 * (k - 1.0) / k);
}

/* square: [n_bins] Σ over segments of the squared periodogram of x. */
static void accumulate(const struct cross_spectrum *s, const double complex *X, const double complex *Y, double scale,
                       size_t m, double *square)
{
    for (size_t k = 0; k < s->n_bins; k++) {
        const double a = scale * single_sided(k, m), p = a * creal(X[k] * conj(X[k]));
        s->pxx[k] += p;
        square[k] += p * p;
        if (s->pxy != NULL) {
            s->pyy[k] += a * creal(Y[k] * conj(Y[k]));
            s->pxy[k] += a * conj(X[k]) * Y[k];
        }
    }
}

static double steadiness(const struct cross_spectrum *s, const double *square)
{
    double top = 0.0, bottom = 0.0;
    for (size_t k = 0; k < s->n_bins; k++)
        if (square[k] > 0.0) {
            top += s->pxx[k] * (s->pxx[k] * s->pxx[k] / ((double)s->n_segments * square[k]));
            bottom += s->pxx[k];
        }
    return bottom > 0.0 ? top / bottom : 0.0;
}

static size_t default_segment(size_t n)
{
    size_t m = 2 * n / 9; /* eight half-overlapping segments span 4.5 segment lengths */
    if (m < 16)
        return n;
    while (!is_good(m) || m % 2 != 0)
        m--;
    return m;
}

enum bf_status spectrum_cross(const double *x, const double *y, size_t n, double dt_s, size_t segment,
                              struct cross_spectrum *out, struct bf_error *err)
{
    const size_t m = segment == 0 ? default_segment(n) : segment, hop = m / 2;
    const struct fft *plan;
    *out = (struct cross_spectrum){0};
    if (m < 4 || m > n)
        return bf_fail(err, BF_NUMERIC, "a spectrum of %zu samples in segments of %zu is not possible; record longer",
                       n, m);
    enum bf_status status = fft_get(m, &plan, err);
    if (status != BF_OK)
        return status;
    out->n_bins = m / 2 + 1;
    out->df_Hz = 1.0 / (dt_s * (double)m);
    out->n_segments = 1 + (n - m) / hop;
    out->pxx = bf_alloc(out->n_bins, sizeof *out->pxx);
    if (y != NULL) {
        out->pyy = bf_alloc(out->n_bins, sizeof *out->pyy);
        out->pxy = bf_alloc(out->n_bins, sizeof *out->pxy);
    }
    double *w = bf_alloc(m, sizeof *w), *work = bf_alloc(m, sizeof *work), energy = 0.0;
    double *square = bf_alloc(out->n_bins, sizeof *square);
    double complex *X = bf_alloc(out->n_bins, sizeof *X), *Y = bf_alloc(out->n_bins, sizeof *Y);
    window_fill(WINDOW_HANN, m, w);
    for (size_t i = 0; i < m; i++)
        energy += w[i] * w[i];
    for (size_t s = 0; s < out->n_segments; s++) {
        transform_segment(plan, x + s * hop, w, work, X);
        if (y != NULL)
            transform_segment(plan, y + s * hop, w, work, Y);
        accumulate(out, X, Y, dt_s / (energy * (double)out->n_segments), m, square);
    }
    out->steadiness = steadiness(out, square);
    out->averages = independent_averages(w, m, hop, out->n_segments);
    free(w);
    free(work);
    free(square);
    free(X);
    free(Y);
    return BF_OK;
}

static double *copy_of(const double *x, size_t n)
{
    double *copy = bf_alloc(n, sizeof *copy);
    memcpy(copy, x, n * sizeof *copy);
    return copy;
}

static void copy_spectrum(const struct cross_spectrum *from, struct cross_spectrum *out)
{
    *out = *from;
    out->pxx = copy_of(from->pxx, from->n_bins);
    if (from->pxy == NULL)
        return;
    out->pyy = copy_of(from->pyy, from->n_bins);
    out->pxy = bf_alloc(from->n_bins, sizeof *out->pxy);
    memcpy(out->pxy, from->pxy, from->n_bins * sizeof *out->pxy);
}

/* Effective segments of two stretches whose power is a and b times their segments: (Σ P)²/Σ P² again, over both. */
static double joined_steadiness(const struct cross_spectrum *x, double a, const struct cross_spectrum *y, double b)
{
    const double nx = (double)x->n_segments, ny = (double)y->n_segments;
    const double squares = a * a / fmax(1.0, x->steadiness * nx) + b * b / fmax(1.0, y->steadiness * ny);
    return squares > 0.0 ? (a + b) * (a + b) / (squares * (nx + ny)) : 0.0;
}

void cross_spectrum_join(struct cross_spectrum *sum, const struct cross_spectrum *more)
{
    double a = 0.0, b = 0.0;
    if (sum->n_bins == 0) {
        copy_spectrum(more, sum);
        return;
    }
    const double nx = (double)sum->n_segments, ny = (double)more->n_segments;
    const double old = nx / (nx + ny), add = ny / (nx + ny);
    for (size_t k = 0; k < sum->n_bins; k++) {
        a += nx * sum->pxx[k];
        b += ny * more->pxx[k];
    }
    sum->steadiness = joined_steadiness(sum, a, more, b);
    for (size_t k = 0; k < sum->n_bins; k++) {
        sum->pxx[k] = old * sum->pxx[k] + add * more->pxx[k];
        if (sum->pxy != NULL) {
            sum->pyy[k] = old * sum->pyy[k] + add * more->pyy[k];
            sum->pxy[k] = old * sum->pxy[k] + add * more->pxy[k];
        }
    }
    sum->averages += more->averages;
    sum->n_segments += more->n_segments;
}

void cross_spectrum_free(struct cross_spectrum *spectrum)
{
    free(spectrum->pxx);
    free(spectrum->pyy);
    free(spectrum->pxy);
    *spectrum = (struct cross_spectrum){0};
}

double coherence(const struct cross_spectrum *spectrum, size_t bin)
{
    if (spectrum->pxy == NULL)
        return 0.0;
    const double power = spectrum->pxx[bin] * spectrum->pyy[bin];
    const double complex c = spectrum->pxy[bin];
    return power > 0.0 ? fmin(1.0, creal(c * conj(c)) / power) : 0.0;
}

double coherence_bound(const struct cross_spectrum *spectrum, double alpha)
{
    if (spectrum->averages <= 1.0)
        return 1.0;
    return 1.0 - pow(alpha, 1.0 / (spectrum->averages - 1.0));
}

/* ---- Time domain ---- */

/*
 * x with `pad` samples in front and the rest behind, continued by point reflection about the end samples (value and
 * slope stay continuous) and faded to the line between the two ends, so that the whole is smooth and periodic.
 */
static void extend(const double *x, size_t n, size_t pad, size_t total, double *out)
{
    const size_t behind = total - pad - n;
    const double first = x[0], last = x[n - 1];
    for (size_t i = 0; i < total; i++) {
        if (i >= pad && i < pad + n) {
            out[i] = x[i - pad];
            continue;
        }
        const bool front = i < pad;
        const size_t d = front ? pad - i : i - pad - n + 1; /* distance from the end sample, ≥ 1 */
        const size_t reach = front ? pad : behind;
        const double fade = 0.5 + 0.5 * cos(M_PI * (double)d / (double)(reach + 1));
        const double mirrored =
            d < n ? (front ? 2.0 * first - x[d] : 2.0 * last - x[n - 1 - d]) : (front ? first : last);
        out[i] = fade * mirrored + (1.0 - fade) * 0.5 * (first + last);
    }
}

enum bf_status resample_band_limited(const double *x, size_t n, size_t factor, double *out, struct bf_error *err)
{
    const struct fft *coarse, *fine;
    const size_t pad = n < 512 ? n : 512;
    const size_t total = fft_good_size(n + 2 * pad);
    enum bf_status status = fft_get(total, &coarse, err);
    if (status == BF_OK)
        status = fft_get(total * factor, &fine, err);
    if (status != BF_OK)
        return status;
    double *long_x = bf_alloc(total, sizeof *long_x), *long_y = bf_alloc(total * factor, sizeof *long_y);
    double complex *X = bf_alloc(total * factor / 2 + 1, sizeof *X);
    extend(x, n, pad, total, long_x);
    fft_forward(coarse, long_x, X);
    for (size_t k = 0; k <= total / 2; k++)
        X[k] *= (double)factor;
    if (factor > 1)
        X[total / 2] *= 0.5; /* the Nyquist bin is shared by both signs */
    fft_inverse(fine, X, long_y);
    memcpy(out, long_y + pad * factor, n * factor * sizeof *out);
    free(long_x);
    free(long_y);
    free(X);
    return BF_OK;
}

enum bf_status correlate(const double *x, const double *y, size_t n, size_t n_lags, double *c, struct bf_error *err)
{
    const struct fft *plan;
    enum bf_status status = fft_get(fft_good_size(n + n_lags), &plan, err);
    if (status != BF_OK)
        return status;
    const size_t m = fft_size(plan);
    double *work = bf_alloc(m, sizeof *work);
    double complex *X = bf_alloc(m / 2 + 1, sizeof *X), *Y = bf_alloc(m / 2 + 1, sizeof *Y);
    memcpy(work, x, n * sizeof *work);
    fft_forward(plan, work, X);
    memcpy(work, y, n * sizeof *work);
    fft_forward(plan, work, Y);
    for (size_t k = 0; k <= m / 2; k++)
        X[k] = conj(X[k]) * Y[k];
    fft_inverse(plan, X, work);
    memcpy(c, work, n_lags * sizeof *c);
    free(work);
    free(X);
    free(Y);
    return BF_OK;
}
