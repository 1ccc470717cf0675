/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * amplitude.h — frequency and damping of each mode against its amplitude, from the parts of records in which nothing drives
 * the beam: after hits, after a drive was switched off, in free decays.
 *
 * The channel is filtered to the band of one mode (FFT, smooth edges), made analytic (Hilbert), and in windows of a few
 * periods the slopes of phase and logarithmic amplitude give f and ζ. Windows whose amplitude is below a few times the noise
 * in the band are left out. The prediction goes through the same path, so that what the filter does cancels.
 */
#ifndef BEAMFIT_AMPLITUDE_H
#define BEAMFIT_AMPLITUDE_H

#include "compare.h"

/* One mode in one free stretch of one channel. */
struct amplitude_curve {
    size_t record;
    const char *channel; /* in the comparison's */
    size_t mode;         /* 1 = lowest */
    size_t n;
    double *t_s;                          /* [n] middle of each window */
    double *amplitude;                    /* [n] of the filtered channel, unit of the channel */
    double *frequency_Hz, *damping_ratio; /* [n] measured */
    double *frequency_sd_Hz, *damping_sd; /* [n] one standard error, from the noise in the band */
    double *model_amplitude, *model_frequency_Hz,
        *model_damping_ratio; /* [n] of the prediction; NAN where it is too small */
    double
        frequency_drift; /* relative change of measured f from the smallest to the largest amplitude, straight line in A */
    double frequency_drift_sd;
    double damping_drift; /* change of ζ, the same way */
    double damping_drift_sd;
};

struct amplitude_curves {
    size_t n;
    struct amplitude_curve *curves;
    char text[400]; /* what drifts, in words; "" when nothing does */
};

/* comparison: as of compare_run(). Records that are driven to their end give no curve. Free with amplitude_free(). */
enum bf_status amplitude_measure(const struct comparison *comparison, struct amplitude_curves *out,
                                 struct bf_error *err);
void amplitude_free(struct amplitude_curves *curves);

#endif
