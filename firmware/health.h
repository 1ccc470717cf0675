/* SPDX-License-Identifier: MIT */
/*
 * health.h — the sensor judged by its codes alone, whatever the model says: too quiet, stuck, at an end of its range.
 *
 *     too quiet   the rms about the mean of a block of 64 codes is below quiet_ratio × noise   found within 128 samples
 *     stuck       setup.stuck_samples equal codes in a row                                     found within as many
 *     at an end   8 codes of a block are at an end of the range                                found within 128 samples
 *
 * A beam that moves only makes a healthy sensor louder, so motion raises none of them. Noise below one code is not heard
 * block by block: then only `stuck` judges. In whole numbers: equal on every target.
 */
#ifndef HEALTH_H
#define HEALTH_H

#include <stdint.h>
#include "beam_image.h"
#include "beam_wire.h"

enum {
    HEALTH_BLOCK = 64,
    HEALTH_END_LEAST = 8,
    HEALTH_HOLD = 256 /* samples for which a fault is shown after its cause */
};

struct health {
    uint32_t quiet_limit;   /* of 64 Σd² − (Σd)², d codes of a block; 0: not judged */
    uint32_t stuck_samples; /* 0: not judged */
    uint32_t run;           /* equal codes in a row, up to stuck_samples */
    uint32_t square;        /* of the block: Σd², d from its first code */
    int32_t sum;            /* Σd */
    uint16_t last, first;   /* code of the last sample; of the block's first */
    uint8_t filled, at_end; /* samples in the block; of them at an end */
    uint16_t hold[3];       /* samples for which QUIET, STUCK, AT_END are still shown */
};

/* Begins anew with this image's limits; faults that are shown stay for their time. */
void health_begin(struct health *h, const struct beam_image_setup *setup);

/* One code; BEAM_LIVE_QUIET, _STUCK, _AT_END. About 40 instructions, 70 at the end of a block. */
uint32_t health_sample(struct health *h, uint16_t code, uint16_t code_max);

#endif
