/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "spectrogram.h"

#include <math.h>
#include <stdlib.h>

enum { SEGMENTS = 16, /* lengths of a segment that a record holds */ SEGMENT_LEAST = 32 };

enum bf_status spectrogram_new(size_t n, struct spectrogram *out, struct bf_error *err)
{
    size_t segment = SEGMENT_LEAST;
    while (2 * segment * SEGMENTS <= n)
        segment *= 2;
    *out = (struct spectrogram){.segment = segment, .hop = segment / 4, .n_bins = segment / 2 + 1};
    out->n_times = (n + segment) / out->hop; /* the first segments begin before the record */
    out->window = bf_alloc(segment, sizeof *out->window);
    window_fill(WINDOW_HANN, segment, out->window);
    return fft_get(segment, &out->plan, err);
}

/* Zero outside; segment t ends before sample (t + 1)·hop. */
void spectrogram_segment(const struct spectrogram *p, const double *x, size_t n, size_t t, double *a, double complex *A)
{
    for (size_t i = 0; i < p->segment; i++) {
        const size_t end = (t + 1) * p->hop + i; /* sample + segment */
        a[i] = end >= p->segment && end - p->segment < n ? p->window[i] * x[end - p->segment] : 0.0;
    }
    fft_forward(p->plan, a, A);
}

void spectrogram_power(const struct spectrogram *p, const double *x, size_t n, double *power)
{
    double *a = bf_alloc(p->segment, sizeof *a);
    double complex *A = bf_alloc(p->n_bins, sizeof *A);
    for (size_t t = 0; t < p->n_times; t++) {
        spectrogram_segment(p, x, n, t, a, A);
        for (size_t k = 0; k < p->n_bins; k++)
            power[t * p->n_bins + k] = creal(A[k]) * creal(A[k]) + cimag(A[k]) * cimag(A[k]);
    }
    free(a);
    free(A);
}
