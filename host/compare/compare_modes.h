/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_modes.h — frequency and damping against amplitude, poles against the order of a free linear model; part of compare.h */
#ifndef BEAMFIT_COMPARE_MODES_H
#define BEAMFIT_COMPARE_MODES_H

#include <stdbool.h>
#include <stddef.h>

#include "ground/ground.h"
#include "model/model.h"
#include "noise/noise.h"
#include "record/record.h"

struct comparison;

/*
 * AMPLITUDE — frequency and damping of each mode against its amplitude, from the parts of records in which nothing drives
 * the beam: after hits, after a drive was switched off, in free decays.
 *
 * In overlapping windows, long enough to part a mode from its neighbours, the complex amplitude at the mode's frequency is
 * taken (Blackman–Harris); its phase and logarithmic magnitude from window to window give f and ζ. Windows whose amplitude
 * is below a few times its standard error are left out. The prediction is treated in the same way, about its own frequency,
 * so that what the windows do cancels in a comparison.
 */

/* One mode in one free stretch of one channel. */
struct amplitude_curve {
    size_t record;
    const char *channel; /* in the comparison's */
    size_t mode;         /* 1 = lowest */
    size_t n;
    double *t_s;                                      /* [n] middle of each window */
    double *amplitude;                                /* [n] of the filtered channel, unit of the channel */
    double amplitude_sd;                              /* one standard error of each, from the noise in the band */
    double *frequency_Hz, *damping_ratio;             /* [n] measured */
    double *frequency_sd_Hz, *damping_sd;             /* [n] one standard error, from the noise in the band */
    double *model_amplitude;                          /* [n] of the prediction */
    double *model_frequency_Hz, *model_damping_ratio; /* [n] NAN where the prediction is too small */
    /* Relative change of the measured f, and change of ζ, from the smallest to the largest amplitude: a straight line in A. */
    double frequency_drift, damping_drift;
    double frequency_drift_sd, damping_drift_sd;
};

struct amplitude_curves {
    size_t n;
    struct amplitude_curve *curves;
    char text[400]; /* what drifts, in words; "" when nothing does */
    size_t n_records;
    size_t *free_stretches; /* [n_records] over all channels: 0 where a drive never rests for long */
};

/*
 * comparison: as of compare_run(). Records that are driven to their end give no curve. Free with amplitude_free(), also after
 * a failure. Cost: about 3 ms a mode and 4096 free samples of a channel.
 */
enum bf_status amplitude_measure(const struct comparison *comparison, struct amplitude_curves *out,
                                 struct bf_error *err);
void amplitude_free(struct amplitude_curves *curves);

/* Why a record has no curve, in words; NULL: it has one. */
const char *amplitude_no_decay(const struct amplitude_curves *curves, size_t record);

/*
 * The modes with the largest amplitudes in one channel of one record (SIZE_MAX: of all), ascending: mode[most], 1 = lowest; returns how many.
 * also: a mode that is among them if it has a curve there; 0: none.
 */
size_t amplitude_dominant(const struct amplitude_curves *curves, const char *channel, size_t record, size_t also,
                          size_t mode[], size_t most);

/*
 * STABILISATION — poles of the free linear models of 1, 2, 3 … modes of all fitted records together: what is physical stays where it
 * is from one order to the next.
 *
 * Per channel A Y = Σ B U + C over the lines of the band from 0 to to_Hz, A common: least squares in the frequency domain with a
 * common denominator (Guillaume et al. 2003, 'PolyMAX'), the residues of inputs and of what rings over the edges of the record
 * among the unknowns, lines weighted by the noise of their channel. A is 1 at its highest delay, so that poles of noise are unstable and drop out. Noise makes the damping of weak modes too small, by up to a half near it; that of
 * attainable_find() is not so.
 */

enum { STABILISATION_MODES = 24 }; /* of the highest order */

struct stabilisation_pole {
    size_t modes; /* of the model that it is of */
    double frequency_Hz, damping_ratio;
    bool frequency_stable; /* within 1 % of one of the order below */
    bool stable;           /* and its damping ratio within 5 % */
};

/* Stable poles of several orders that are one: medians. */
struct stabilisation_found {
    double frequency_Hz, damping_ratio;
    size_t orders; /* in which it was stable */
};

struct stabilisation {
    size_t modes; /* highest order; 0: there was nothing to compute from */
    double to_Hz; /* of the band: where every channel has sunk into its noise, or the lowest Nyquist frequency */
    size_t n_poles;
    struct stabilisation_pole *poles; /* [n_poles] order by order, ascending in each */
    size_t n_found;
    struct stabilisation_found *found; /* [n_found] ascending */
    size_t n_lines;
    double *line_Hz, *magnitude; /* [n_lines] root mean square over channels of |Y|, largest 1 */
};

/*
 * comparison: as of compare_run(). Records that are held out take no part. BF_NUMERIC: a transform or a solve failed. Free with
 * stabilisation_free(), also after a failure. Cost: about 10 ms a channel of 4096 samples and 50 ms for the orders.
 */
enum bf_status stabilisation_find(const struct comparison *comparison, struct stabilisation *out, struct bf_error *err);
void stabilisation_free(struct stabilisation *stabilisation);

#endif
