/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * localise.h — where the misfit above the noise is: record, channel, band of one mode, time, amplitude.
 *
 * Shares are of Σ (|R|² − noise)/noise_rms² over all channels, so that channels of different units weigh by their noise and what is
 * noise counts nothing.
 */
#ifndef BEAMFIT_LOCALISE_H
#define BEAMFIT_LOCALISE_H

#include "compare.h"
#include "noise/evidence.h"

enum localise_amplitude { AMPLITUDE_ALL, AMPLITUDE_LARGE, AMPLITUDE_SMALL };
/* "all", "large", "small" */
const char *localise_amplitude_text(enum localise_amplitude amplitude);

/* One band of one channel of one record. */
struct localised {
    size_t channel; /* index into the caller's channels */
    double from_Hz, to_Hz;
    size_t mode;        /* the one inside, 1 = lowest; 0: none */
    double share;       /* of the whole misfit above the noise, 0 … 1 */
    double noise_ratio; /* rms in the band over the noise's there */
    double relative;    /* rms of the misfit above the noise over rms of the measured signal in the band */
    enum localise_amplitude
        amplitude;     /* relative misfit clearly larger where, or in the records in which, the motion is large … */
    double late_share; /* of the band's misfit, in the second half of the motion (by energy: 0.5 is even) */
};

struct localisation {
    double excess; /* Σ (r² − noise²)/noise² over all rows, over the rows: 0 nothing is left, 3: noise_ratio 2 */
    size_t n;      /* parts with a share of at least localise_least_share, largest first */
    struct localised *parts;
    char text[600]; /* sentences for a person */
};

extern const double localise_least_share;

/*
 * frequency_Hz: [n_modes] ascending; 0 modes: octaves. Channels without a noise level are left out. Free with
 * localise_free(), also after a failure. Cost: about 2 ms a channel of 4096 samples.
 */
enum bf_status localise_misfit(const struct misfit_channel channels[], size_t n_channels, const double frequency_Hz[],
                               size_t n_modes, struct localisation *out, struct bf_error *err);
void localise_free(struct localisation *localisation);

/* Views of a comparison's channels that are (or are not) held out; out: [comparison->n_channels]; returns how many. */
size_t localise_channels(const struct comparison *comparison, bool held_out, struct misfit_channel out[]);

/* [{file, channel, from_Hz, to_Hz, share, amplitude}, …]: the `where` of `diagnose --json`. */
struct json *localise_json(const struct localisation *localisation, const struct misfit_channel channels[]);

#endif
