/* SPDX-License-Identifier: MIT */
/*
 * sampler.h — one sample: codes → input and measured value → beam_step() → residual, running mean square, alarm.
 *
 * Which drive acts when: at tick k the converter has just finished sensor code s(k), the beam's voltage at the tick.
 * The interrupt writes drive code d(k) to the D/A at its very start; it acts from tick k to tick k + 1. Step k is
 * beam_step(u(k)) with u(k) from d(k), and y(k) is compared with s(k). With the zero-order hold a step's output
 * depends on u(k − 1) and before; u(k) itself enters only an acceleration, at the instant of the tick, after the jump.
 *
 * The residual has a running mean and a running variance. A mean that stands out is an offset of the sensor. The variance is
 * what nobody drove or the model fails to explain; the observer of the image tells the two apart, since what was pushed goes
 * on as the model says: the alarm is about what surprises it. health.h judges the sensor's codes by themselves.
 */
#ifndef SAMPLER_H
#define SAMPLER_H

#include <stdbool.h>
#include <stdint.h>
#include "beam_image.h"
#include "beam_wire.h"
#include "health.h"

enum { SAMPLER_PAST = BEAM_HISTORY }; /* sensor codes remembered; above every plan's latency */
_Static_assert((SAMPLER_PAST & (SAMPLER_PAST - 1)) == 0, "a power of two");

struct sampler {
    struct beam_state state;
    uint32_t sequence; /* of the next sample; the caller adds what was missed */
    uint32_t taken;    /* samples that were stepped */
    struct health health;
    uint32_t averaged;       /* samples in the running mean and variance, up to their time constant */
    uint32_t above;          /* samples in a row with the innovation_ratio above alarm_ratio */
    float mean;              /* of the residual, output's unit */
    float variance;          /* of the residual about it, output's unit squared */
    float innovation_square; /* running mean square of the innovation, limited, in innovation_rms² */
    uint32_t lasted;         /* samples since the ratio rose above alarm_ratio; 0: it is below clear_ratio again */
    struct beam_observed observed;
    bool alarm, offset, sensor_fault;
    uint16_t past[SAMPLER_PAST];
};

/* Model to rest, statistics begun anew; the sequence and the past codes go on. */
void sampler_rest(struct sampler *s, const struct beam_image *image);

/*
 * One sample of the model in `image`; out->crc32 and the image's part of out->status are left to the caller.
 * A state or statistic that is not finite puts the model to rest: BEAM_LIVE_RESET, predicted 0 in that sample.
 * Cost: beam_step(), beam_image_observe() and about 260 instructions.
 */
void sampler_step(struct sampler *s, const struct beam_image *image, uint16_t sensor_code, uint16_t drive_code,
                  uint16_t sensor_code_max, struct beam_live *out);

#endif
