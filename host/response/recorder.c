/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recorder.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* 1/A is bounded by about 1/(2 √this): what the filter has taken out cannot be brought back. */
static const double inverse_floor = 0.01;
enum { HIGHEST_ORDER = 2 * RECORDER_RINGS };

/* "Butterworth order N at F Hz…", whatever the locale. */
static bool read_filter(const char *text, long *order, double *corner_Hz)
{
    static const char before[] = "Butterworth order ", between[] = " at ";
    if (strncmp(text, before, strlen(before)) != 0)
        return false;
    char *rest;
    *order = strtol(text + strlen(before), &rest, 10);
    if (strncmp(rest, between, strlen(between)) != 0)
        return false;
    const char *number = rest + strlen(between), *end = number_scan(number, text + strlen(text), '.', corner_Hz);
    return end != NULL && end != number && strncmp(end, " Hz", 3) == 0;
}

struct recorder_filter recorder_filter_read(const struct record *record)
{
    struct recorder_filter filter = {.order = 0};
    const char *text = record_meta(record, RECORD_FILTER);
    long order;
    double corner_Hz;
    if (text == NULL || !read_filter(text, &order, &corner_Hz))
        return filter;
    if (order < 1 || order > HIGHEST_ORDER || !(corner_Hz > 0.0) || !isfinite(corner_Hz))
        return filter;
    filter.order = (int)order;
    filter.corner_samples = corner_Hz * record->dt_s;
    filter.twice = strstr(text, "forward and backward") != NULL;
    return filter;
}

/* Relative to the corner; the upper half of the left half circle comes first. */
static double complex butterworth_pole(const struct recorder_filter *filter, size_t i)
{
    return cexp(CMPLX(0.0, acos(-1.0) * (0.5 + (2.0 * (double)i + 1.0) / (2.0 * filter->order))));
}

/* Butterworth low-pass at s relative to its corner: H(s) H(−s) = 1/(1 + (−s²)^n). */
static double complex butterworth(const struct recorder_filter *filter, double complex s)
{
    double complex result = 1.0, square = -s * s;
    if (filter->twice) {
        for (int i = 0; i < filter->order; i++)
            result *= square;
        return 1.0 / (1.0 + result);
    }
    for (int k = 0; k < filter->order; k++)
        result /= s - butterworth_pole(filter, (size_t)k); /* the product of −poles is 1 */
    return result;
}

size_t recorder_rings(const struct record *record, double complex poles[RECORDER_RINGS])
{
    const struct recorder_filter filter = recorder_filter_read(record);
    if (!record_is_free_decay(record) || filter.twice)
        return 0;
    for (int i = 0; 2 * i < filter.order; i++)
        poles[i] = 2.0 * acos(-1.0) * filter.corner_samples * butterworth_pole(&filter, (size_t)i);
    return (size_t)filter.order;
}

void recorder_ring(const double complex poles[], size_t i, size_t n, double column[])
{
    static const double silent = 1e-18;
    double complex z = 1.0;
    for (size_t k = 0; k < n; k++) {
        if (cabs(z) > silent)
            z = cexp(poles[i / 2] * (double)k);
        else
            z = 0.0;
        column[k] = i % 2 == 0 ? creal(z) : cimag(z);
    }
}

double complex *recorder_line(const struct recorder_filter *filter, const struct response_grid *grid,
                              double complex *old)
{
    if (filter->order == 0 || grid->intersample != INTERSAMPLE_BAND_LIMITED)
        return old;
    double corner_rad = 2.0 * acos(-1.0) * filter->corner_samples / grid->dt_s; /* by the recorder's own clock */
    double complex *A = bf_grow(old, grid->m, sizeof *A);
    for (size_t k = 0; k < grid->m; k++)
        A[k] = butterworth(filter, grid->s[k] / corner_rad);
    return A;
}

double complex recorder_at(const struct recorder_filter *filter, double cycles_per_sample)
{
    return butterworth(filter, CMPLX(0.0, cycles_per_sample / filter->corner_samples));
}

double complex recorder_at_pole(const struct recorder_filter *filter, double dt_s, double complex p)
{
    return butterworth(filter, p * dt_s / (2.0 * acos(-1.0) * filter->corner_samples));
}

double complex recorder_inverse(double complex A)
{
    return conj(A) / (creal(A * conj(A)) + inverse_floor * (1.0 - fmin(1.0, cabs(A))));
}

void recorder_undo(const double complex A[], size_t m, double complex U[])
{
    for (size_t k = 0; A != NULL && k < m; k++)
        U[k] *= recorder_inverse(A[k]);
}

void recorder_apply(const double complex A[], size_t m, double complex Y[])
{
    for (size_t k = 0; A != NULL && k < m; k++)
        Y[k] *= A[k];
}
