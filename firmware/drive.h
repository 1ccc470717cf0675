/* SPDX-License-Identifier: MIT */
/* drive.h — the chirp of struct beam_drive as D/A codes, in whole numbers: equal on every target, bit for bit. */
#ifndef DRIVE_H
#define DRIVE_H

#include <stdbool.h>
#include <stdint.h>
#include "beam_wire.h"

enum { DRIVE_AMPLITUDE_MAX = 2047 }; /* D/A codes */

struct drive {
    struct beam_drive setting;
    int32_t amplitude; /* 2⁻¹⁶ D/A codes */
    uint32_t phase, rate, sample;
    uint16_t zero; /* D/A code of no drive */
};

/* Is it finite and in range? Only then may it be started. */
bool drive_valid(const struct beam_drive *setting);

/* From the first sample of the chirp. */
void drive_start(struct drive *drive, const struct beam_drive *setting, uint16_t zero);

/* D/A code of the next sample. About 40 instructions. */
uint16_t drive_next(struct drive *drive);

/* sin(2π phase/2³²) in 2⁻³¹, off by less than 2⁻¹⁹ of 1. */
int32_t drive_sine(uint32_t phase);

#endif
