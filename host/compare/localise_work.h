/* SPDX-License-Identifier: GPL-3.0-or-later */
/* localise_work.h — what localise.c (numbers) and localise_text.c (words) share; for nobody else. */
#ifndef BEAMFIT_LOCALISE_WORK_H
#define BEAMFIT_LOCALISE_WORK_H

#include "compare.h"
#include "localise.h"

/* A band of a channel before shares are known. */
struct localised_band {
    struct localised part;
    size_t from, to;        /* bins */
    double weight;          /* excess over noise variance, times samples */
    double noise;           /* mean square of the noise in the band */
    double motion, misfit;  /* rms of the measured signal, and of the misfit above the noise */
    double exponent_inside; /* of relative misfit against motion within the record; 0 when it cannot be told */
};

struct localise_work {
    size_t n_bands;
    struct localised_band *bands;
};

/* Fills out->text from out->parts. */
void localise_describe(const struct misfit_channel channels[], struct localisation *out);

#endif
