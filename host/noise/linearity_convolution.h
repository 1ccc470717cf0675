/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linearity_convolution.h — convolutions of whole records. Private to noise/. */
#ifndef BEAMFIT_LINEARITY_CONVOLUTION_H
#define BEAMFIT_LINEARITY_CONVOLUTION_H

#include <complex.h>

#include "maths/maths.h"

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
