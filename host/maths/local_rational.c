/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ORDER = 2, POLES = 2, MAX_INPUTS = 4, MAX_COLUMNS = (MAX_INPUTS + 1) * (ORDER + 1 + POLES) };
static const double worth_refining = 1.5; /* F of a pole where it is guessed, for a search to begin */
static const double pole_f_test = 6.0;    /* F of a pole against none; about 1 % of bands with noise only exceed it */

struct band {
    size_t first, length;      /* bins */
    size_t keep_from, keep_to; /* residuals kept, relative to first; neighbours supply the rest */
    size_t rank;
    double complex *q; /* [rank][length] orthonormal */
};

struct local_rational {
    size_t n, n_bands;
    struct band *bands;
};

/* One band during its fit. Columns stand in rows of q, orthonormalised as they come. */
struct work {
    size_t length, n_inputs;
    const double complex *y;
    const double complex *u[MAX_INPUTS];
    double *x; /* [length] −1 … 1 */
    size_t rank;
    double complex *q;                 /* [MAX_COLUMNS][length] */
    double complex *residual;          /* [length] of y against q */
    double complex *column, *weighted; /* [length] */
};

/* Real arithmetic: the products of C's complex type look after infinities that cannot occur here, at four times the cost. */
static double complex inner(const double complex *a, const double complex *b, size_t n)
{
    double re = 0.0, im = 0.0;
    for (size_t i = 0; i < n; i++) {
        re += creal(a[i]) * creal(b[i]) + cimag(a[i]) * cimag(b[i]);
        im += creal(a[i]) * cimag(b[i]) - cimag(a[i]) * creal(b[i]);
    }
    return CMPLX(re, im);
}

static double power(const double complex *a, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += creal(a[i]) * creal(a[i]) + cimag(a[i]) * cimag(a[i]);
    return sum;
}

static double complex product(double complex a, double complex b)
{
    return CMPLX(creal(a) * creal(b) - cimag(a) * cimag(b), creal(a) * cimag(b) + cimag(a) * creal(b));
}

/* Append the column to the basis unless it depends on the rest. Twice is enough (Kahan). */
static void append(struct work *w, const double complex *column)
{
    const size_t n = w->length;
    double complex *row = w->q + w->rank * n;
    const double before = power(column, n);
    memcpy(row, column, n * sizeof *row);
    dense_project_out(n, w->rank, w->q, row);
    dense_project_out(n, w->rank, w->q, row);
    const double after = power(row, n);
    if (!(after > 1e-18 * before) || w->rank == n)
        return;
    const double scale = 1.0 / sqrt(after);
    for (size_t i = 0; i < n; i++)
        row[i] *= scale;
    w->rank++;
}

static void refresh_residual(struct work *w)
{
    memcpy(w->residual, w->y, w->length * sizeof *w->residual);
    dense_project_out(w->length, w->rank, w->q, w->residual);
}

static void append_polynomials(struct work *w)
{
    for (size_t input = 0; input <= w->n_inputs; input++) {
        for (int k = 0; k <= ORDER; k++) {
            for (size_t i = 0; i < w->length; i++) {
                const double x = w->x[i], t = k == 0 ? 1.0 : k == 1 ? x : 2.0 * x * x - 1.0;
                w->column[i] = input == 0 ? t : t * w->u[input - 1][i];
            }
            append(w, w->column);
        }
    }
}

static double complex resonance(double x, double complex pole)
{
    const double re = x - creal(pole), im = -cimag(pole), size = re * re + im * im;
    return size > 1e-18 ? CMPLX(re / size, -im / size) : 1e9; /* 1/(x − p) */
}

static void append_pole(struct work *w, double complex pole)
{
    for (size_t input = 0; input <= w->n_inputs; input++) {
        for (size_t i = 0; i < w->length; i++) {
            const double complex g = resonance(w->x[i], pole);
            w->column[i] = input == 0 ? g : product(g, w->u[input - 1][i]);
        }
        append(w, w->column);
    }
}

/* Misfit with the pole added; the residual is left in w->residual, the basis keeps its rank. */
static double try_pole(struct work *w, double complex pole)
{
    const size_t rank = w->rank;
    append_pole(w, pole);
    refresh_residual(w);
    w->rank = rank;
    return power(w->residual, w->length);
}

/*
 * First guess: the better of the strongest bin of the residual r = P⊥ y, slightly damped, and of the linearised equation
 * P⊥ (x − p) y = 0, p = ⟨r, P⊥ x y⟩/⟨r, r⟩ (Levy 1959). misfit: with that pole added.
 */
static double complex guess_pole(struct work *w, double *misfit)
{
    const size_t n = w->length;
    size_t peak = 0;
    refresh_residual(w);
    for (size_t i = 0; i < n; i++) {
        w->weighted[i] = w->x[i] * w->y[i];
        if (cabs(w->residual[i]) > cabs(w->residual[peak]))
            peak = i;
    }
    dense_project_out(n, w->rank, w->q, w->weighted);
    const double size = power(w->residual, n);
    const double complex at_peak = CMPLX(w->x[peak], 0.05);
    const double complex linear = size > 0.0 ? inner(w->residual, w->weighted, n) / size : at_peak;
    const double by_peak = try_pole(w, at_peak), by_linear = try_pole(w, linear);
    *misfit = fmin(by_peak, by_linear);
    return by_linear < by_peak ? linear : at_peak;
}

/* Gauss–Newton in the pole alone: the tangent is (a + Σ b_i u_i)/(x − p)², projected off every column (Kaufman). */
static double refine_pole(struct work *w, double complex *pole)
{
    const size_t n = w->length, rank = w->rank;
    double best = try_pole(w, *pole);
    for (int pass = 0; pass < 12; pass++) {
        /* the part of y that the pole's columns carry, times 1/(x − p), is the tangent */
        memcpy(w->weighted, w->y, n * sizeof *w->weighted);
        dense_project_out(n, rank, w->q, w->weighted);
        append_pole(w, *pole);
        const size_t with = w->rank;
        refresh_residual(w);
        double complex *tangent = w->weighted;
        for (size_t i = 0; i < n; i++)
            tangent[i] = product(tangent[i] - w->residual[i], resonance(w->x[i], *pole));
        dense_project_out(n, with, w->q, tangent);
        dense_project_out(n, with, w->q, tangent);
        w->rank = rank;
        const double size = power(tangent, n);
        if (!(size > 0.0))
            break;
        double complex step = inner(tangent, w->residual, n) / size;
        if (cabs(step) > 0.3)
            step *= 0.3 / cabs(step);
        double now = INFINITY;
        for (int half = 0; half < 6 && !(now < best); half++, step *= 0.5)
            now = try_pole(w, *pole + step);
        if (!(now < best))
            break;
        *pole += 2.0 * step;
        const bool converged = now > best * (1.0 - 1e-4);
        best = now;
        if (converged)
            break;
    }
    return best;
}

/* Adds poles while an F test asks for them: 2 + inputs complex unknowns each, against the degrees of freedom left. */
static void append_poles(struct work *w)
{
    for (int k = 0; k < POLES; k++) {
        refresh_residual(w);
        const double before = power(w->residual, w->length);
        double after;
        double complex pole = guess_pole(w, &after);
        const double unknowns = (double)w->n_inputs + 2.0;
        const double left = (double)w->length - (double)w->rank - unknowns;
        if (!(left > 2.0 && before - after > worth_refining * unknowns * after / left))
            return;
        after = refine_pole(w, &pole);
        if (!(before - after > pole_f_test * unknowns * after / left))
            return;
        append_pole(w, pole);
    }
}

/* ---- Bands over the spectrum ---- */

static struct work *work_new(size_t length, size_t n_inputs)
{
    struct work *w = bf_alloc(1, sizeof *w);
    w->length = length;
    w->n_inputs = n_inputs;
    w->x = bf_alloc(length, sizeof *w->x);
    w->q = bf_alloc(MAX_COLUMNS * length, sizeof *w->q);
    w->residual = bf_alloc(length, sizeof *w->residual);
    w->column = bf_alloc(length, sizeof *w->column);
    w->weighted = bf_alloc(length, sizeof *w->weighted);
    for (size_t i = 0; i < length; i++)
        w->x[i] = 2.0 * (double)i / (double)(length - 1) - 1.0;
    return w;
}

static void work_free(struct work *w)
{
    free(w->x);
    free(w->q);
    free(w->residual);
    free(w->column);
    free(w->weighted);
    free(w);
}

static void fit_band(struct work *w, const double complex *Y, const double complex *const U[], struct band *band)
{
    w->y = Y + band->first;
    for (size_t i = 0; i < w->n_inputs; i++)
        w->u[i] = U[i] + band->first;
    w->rank = 0;
    append_polynomials(w);
    append_poles(w);
    band->rank = w->rank;
    band->q = bf_alloc(w->rank * w->length, sizeof *band->q);
    memcpy(band->q, w->q, w->rank * w->length * sizeof *band->q);
}

/* Half-overlapping bands over bins 1 … n/2; of each the middle is kept, of the first and last the outer part too. */
static void lay_bands(struct local_rational *fit, size_t length)
{
    const size_t n_bins = fit->n / 2, hop = length / 2; /* bin 0 is left out */
    fit->n_bands = n_bins <= length ? 1 : 1 + (n_bins - length + hop - 1) / hop;
    fit->bands = bf_alloc(fit->n_bands, sizeof *fit->bands);
    size_t done = 1;
    for (size_t b = 0; b < fit->n_bands; b++) {
        struct band *band = &fit->bands[b];
        const bool last = b + 1 == fit->n_bands;
        band->first = last ? n_bins + 1 - length : 1 + b * hop;
        band->length = length;
        band->keep_from = done - band->first;
        band->keep_to = last ? length : length - hop / 2;
        done = band->first + band->keep_to;
    }
}

static double complex *spectrum_of(const double *x, size_t n, const struct fft *plan)
{
    double complex *X = bf_alloc(n / 2 + 1, sizeof *X);
    fft_forward(plan, x, X);
    return X;
}

enum bf_status local_rational_new(const double *z, size_t n, const double *const u[], size_t n_inputs,
                                  struct local_rational **out, struct bf_error *err)
{
    const struct fft *plan;
    *out = NULL;
    if (n < 64 || n_inputs > MAX_INPUTS)
        return bf_fail(err, BF_NUMERIC, "noise needs at least 64 samples and at most %d inputs; got %zu and %zu",
                       MAX_INPUTS, n, n_inputs);
    enum bf_status status = fft_get(n, &plan, err);
    if (status != BF_OK)
        return status;
    size_t length = 21 + 12 * (n_inputs < 1 ? 1 : n_inputs); /* about three degrees of freedom left of four */
    length = length < n / 2 ? length : n / 2;
    struct local_rational *fit = bf_alloc(1, sizeof *fit);
    fit->n = n;
    lay_bands(fit, length);
    double complex *U[MAX_INPUTS] = {0}, *Y = spectrum_of(z, n, plan);
    for (size_t i = 0; i < n_inputs; i++)
        U[i] = spectrum_of(u[i], n, plan);
    struct work *w = work_new(length, n_inputs);
    for (size_t b = 0; b < fit->n_bands; b++)
        fit_band(w, Y, (const double complex *const *)U, &fit->bands[b]);
    work_free(w);
    free(Y);
    for (size_t i = 0; i < n_inputs; i++)
        free(U[i]);
    *out = fit;
    return BF_OK;
}

enum bf_status local_rational_residual(const struct local_rational *fit, const double *x, double *r,
                                       struct bf_error *err)
{
    const struct fft *plan;
    enum bf_status status = fft_get(fit->n, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *X = spectrum_of(x, fit->n, plan), *R = bf_alloc(fit->n / 2 + 1, sizeof *R);
    double complex *a = bf_alloc(fit->bands[0].length, sizeof *a);
    for (size_t b = 0; b < fit->n_bands; b++) {
        const struct band *band = &fit->bands[b];
        memcpy(a, X + band->first, band->length * sizeof *a);
        dense_project_out(band->length, band->rank, band->q, a);
        for (size_t i = band->keep_from; i < band->keep_to; i++)
            R[band->first + i] = a[i];
    }
    fft_inverse(plan, R, r);
    free(X);
    free(R);
    free(a);
    return BF_OK;
}

void local_rational_free(struct local_rational *fit)
{
    if (fit == NULL)
        return;
    for (size_t b = 0; b < fit->n_bands; b++)
        free(fit->bands[b].q);
    free(fit->bands);
    free(fit);
}
