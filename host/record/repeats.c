/* SPDX-License-Identifier: GPL-3.0-or-later */
/* repeats.c — repeated hits against the one response that is best for all of them, line by line. */
#include "record.h"

#include <complex.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "maths/maths.h"

enum { BEFORE = 32 }; /* samples before the onset */

static const double onset = 0.02; /* of the largest drive */
static const double beyond = 3.0; /* scatter of all over that without the odd one */
static const double told = 1e-3;  /* |U|² of the others over that of the odd one, in a line that they can judge */

size_t repeats_onset(const double u[], size_t n)
{
    double most = 0.0;
    size_t k = 0;
    for (size_t i = 0; i < n; i++)
        most = fmax(most, fabs(u[i]));
    while (k < n && !(fabs(u[k]) >= onset * most))
        k++;
    return k > BEFORE ? k - BEFORE : 0;
}

void repeats_spectrum(const struct fft *plan, const double x[], size_t n, double rate, double complex X[])
{
    double *windowed = bf_alloc(fft_size(plan), sizeof *windowed);
    for (size_t i = 0; i < n; i++)
        windowed[i] = x[i] * exp(-rate * (double)i);
    fft_forward(plan, windowed, X);
    free(windowed);
}

static double power(double complex z)
{
    return creal(z * conj(z));
}

/* Sums over the records of one line, without `skip`. */
struct line_sums {
    double uu, zz;
    double complex uz;
};

static struct line_sums line_sums(const double complex U[], const double complex Z[], size_t n, size_t bins, size_t b,
                                  size_t skip)
{
    struct line_sums s = {0};
    for (size_t k = 0; k < n; k++) {
        const double complex u = U[k * bins + b], z = Z[k * bins + b];
        if (k != skip)
            s.uu += power(u), s.zz += power(z), s.uz += conj(u) * z;
    }
    return s;
}

/*
 * Scatter of the records without `skip` (SIZE_MAX: all) about their common response, as a share of the signal; and of the one that is skipped. The scatter has a
 * degree of freedom less than records, which is given back.
 */
static double scatter(const double complex U[], const double complex Z[], size_t n, size_t bins, size_t lines,
                      size_t skip, double *skipped)
{
    const double records = (double)n - (skip < n ? 1.0 : 0.0);
    double left = 0.0, all = 0.0, odd = 0.0, odd_all = 0.0;
    for (size_t b = 1; b < lines; b++) {
        const struct line_sums s = line_sums(U, Z, n, bins, b, skip);
        if (!(s.uu > 0.0))
            continue;
        left += fmax(s.zz - power(s.uz) / s.uu, 0.0), all += s.zz; /* Σ |Z − H U|², H = Σ U* Z / Σ |U|² */
        if (skip < n && s.uu > told * power(U[skip * bins + b])) {
            odd += power(Z[skip * bins + b] - s.uz / s.uu * U[skip * bins + b]);
            odd_all += power(Z[skip * bins + b]);
        }
    }
    *skipped = odd_all > 0.0 ? sqrt(odd / odd_all) : 0.0;
    return all > 0.0 ? sqrt(left / all * records / (records - 1.0)) : 0.0;
}

/* The odd one is that without which the others scatter least. */
void repeats_judge(const double complex U[], const double complex Z[], size_t n, size_t bins, size_t lines,
                   struct repeats *out)
{
    double odd;
    *out = (struct repeats){.nrmse = scatter(U, Z, n, bins, lines, SIZE_MAX, &odd), .others_nrmse = HUGE_VAL};
    for (size_t k = 0; k < n && n >= 3; k++) {
        const double others = scatter(U, Z, n, bins, lines, k, &odd);
        if (others < out->others_nrmse)
            out->others_nrmse = others, out->odd = k, out->odd_nrmse = odd;
    }
    out->stands_out = out->others_nrmse * beyond < out->nrmse;
}
