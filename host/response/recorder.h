/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * recorder.h — the recorder's anti-alias filter, where a record states it:
 *     # anti-alias filter: Butterworth order 8 at 409.6 Hz, forward and backward
 * A linear path does not care that input and output went through the same filter. What is not linear felt the input before
 * the filter, and its effect was recorded behind it: the filter is undone on the input, as far as that can be told, and
 * applied to what comes of it.
 */
#ifndef BEAMFIT_RECORDER_H
#define BEAMFIT_RECORDER_H

#include "record/record.h"
#include "response.h"
#include "kernel.h"

/* order 0: not stated. */
struct recorder_filter {
    int order;
    double corner_samples; /* corner frequency × the stated sample interval */
    bool twice;            /* forward and backward */
};

struct recorder_filter recorder_filter_read(const struct record *record);

/*
 * A[m] of the filter on a grid, in the memory of `old` (which may be NULL); `old` as it is where no filter is stated or inputs
 * are held. To be freed with free().
 */
double complex *recorder_line(const struct recorder_filter *filter, const struct response_grid *grid,
                              double complex *old);
/* On a spectrum [m]. Both do nothing where A is NULL. */
void recorder_undo(const double complex A[], size_t m, double complex U[]);
void recorder_apply(const double complex A[], size_t m, double complex Y[]);
/* The same at one frequency; order > 0. */
double complex recorder_at(const struct recorder_filter *filter, double cycles_per_sample);
double complex recorder_inverse(double complex A);
/* The same for a decaying motion e^(pt), p in 1/s. */
double complex recorder_at_pole(const struct recorder_filter *filter, double dt_s, double complex p);

#endif
