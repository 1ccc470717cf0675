/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linearity_plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SEGMENTS = 16, /* lengths of a segment that a record holds */ SEGMENT_LEAST = 32 };

/* ---- Spectrograms ---- */

enum bf_status linearity_plane_new(size_t n, struct linearity_plane *out, struct bf_error *err)
{
    size_t segment = SEGMENT_LEAST;
    while (2 * segment * SEGMENTS <= n)
        segment *= 2;
    *out = (struct linearity_plane){.segment = segment, .hop = segment / 4, .n_bins = segment / 2 + 1};
    out->n_times = (n + segment) / out->hop; /* the first segments begin before the record */
    out->window = bf_alloc(segment, sizeof *out->window);
    window_fill(WINDOW_HANN, segment, out->window);
    return fft_get(segment, &out->plan, err);
}

/* Zero outside; segment t ends before sample (t + 1)·hop. */
void linearity_segment(const struct linearity_plane *p, const double *x, size_t n, size_t t, double *a,
                       double complex *A)
{
    for (size_t i = 0; i < p->segment; i++) {
        const size_t end = (t + 1) * p->hop + i; /* sample + segment */
        a[i] = end >= p->segment && end - p->segment < n ? p->window[i] * x[end - p->segment] : 0.0;
    }
    fft_forward(p->plan, a, A);
}

void linearity_spectrogram(const struct linearity_plane *p, const double *x, size_t n, double *power)
{
    double *a = bf_alloc(p->segment, sizeof *a);
    double complex *A = bf_alloc(p->n_bins, sizeof *A);
    for (size_t t = 0; t < p->n_times; t++) {
        linearity_segment(p, x, n, t, a, A);
        for (size_t k = 0; k < p->n_bins; k++)
            power[t * p->n_bins + k] = creal(A[k]) * creal(A[k]) + cimag(A[k]) * cimag(A[k]);
    }
    free(a);
    free(A);
}

/* ---- Linear convolution of whole records, cut to the record ---- */

enum bf_status linearity_convolution_new(size_t n, struct linearity_convolution *out, struct bf_error *err)
{
    const size_t size = fft_good_size(2 * n);
    *out = (struct linearity_convolution){.n = n, .m = size / 2 + 1};
    out->x = bf_alloc(size, sizeof *out->x);
    out->X = bf_alloc(out->m, sizeof *out->X);
    return fft_get(size, &out->plan, err);
}

void linearity_convolution_free(struct linearity_convolution *c)
{
    free(c->x);
    free(c->X);
}

double complex *linearity_transform(struct linearity_convolution *c, const double *x)
{
    double complex *X = bf_alloc(c->m, sizeof *X);
    memset(c->x, 0, fft_size(c->plan) * sizeof *c->x);
    memcpy(c->x, x, c->n * sizeof *x);
    fft_forward(c->plan, c->x, X);
    return X;
}

/* e[n] = b * x − a * y */
void linearity_commute(struct linearity_convolution *c, const double complex *B, const double complex *X,
                       const double complex *A, const double complex *Y, double *e)
{
    for (size_t k = 0; k < c->m; k++) {
        const double re = creal(B[k]) * creal(X[k]) - cimag(B[k]) * cimag(X[k]) - creal(A[k]) * creal(Y[k]) +
                          cimag(A[k]) * cimag(Y[k]);
        const double im = creal(B[k]) * cimag(X[k]) + cimag(B[k]) * creal(X[k]) - creal(A[k]) * cimag(Y[k]) -
                          cimag(A[k]) * creal(Y[k]);
        c->X[k] = CMPLX(re, im);
    }
    fft_inverse(c->plan, c->X, c->x);
    memcpy(e, c->x, c->n * sizeof *e);
}
