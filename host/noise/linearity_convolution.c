/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linearity_convolution.h"

#include <stdlib.h>
#include <string.h>

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
