/* SPDX-License-Identifier: GPL-3.0-or-later */
/* board_drive.h — the chirp as a person states it, in Hz, seconds and the input's unit. */
#ifndef BEAMFIT_BOARD_DRIVE_H
#define BEAMFIT_BOARD_DRIVE_H

#include <stdbool.h>
#include "beam_image.h"
#include "beam_wire.h"
#include "ground/ground.h"

struct chirp {
    double from_Hz, to_Hz, sweep_s, amplitude; /* amplitude: the input's unit */
    double every_s;                            /* repeated so often; 0: at once again; < 0: never */
};

/* "F0:F1:T:AMPL" into the first four members. BF_USAGE. */
enum bf_status chirp_read(const char *text, struct chirp *out, struct bf_error *err);
/* For a board that samples so fast and has these scales. BF_USAGE when it cannot make it; generation and flags are 0. */
enum bf_status chirp_make(const struct chirp *chirp, double sample_Hz, const struct beam_image_setup *setup,
                          struct beam_drive *out, struct bf_error *err);
/* The frequency at which the sweep of a drive ends. */
double chirp_end_Hz(const struct beam_drive *drive, double sample_Hz);
double chirp_start_Hz(const struct beam_drive *drive, double sample_Hz);

#endif
